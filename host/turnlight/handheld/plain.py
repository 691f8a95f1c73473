"""A plain white paper frame, as the method's paper has it: where its opening is in a photo.

Nothing on it says how large it is or which side is up: the first has to be told, and the phone has to be held
the same way up for every photo.
"""

import itertools
from dataclasses import dataclass

import cv2
import numpy as np
import numpy.typing as npt

from turnlight.picture.marked_frame import Rectangle
from turnlight.picture.pinhole import Matrix
from turnlight.picture.warp import Image

COARSE_PX = 1200
SMALLEST_SHARE = 0.03
"""Of the picture, that the opening takes."""
PAPER_SHARE = 0.08
"""Of the opening's side: how broad the paper around it is at least."""
_SATURATION = 0.25
_CORNERS_SHARE = 0.03
_POINTS, _SAMPLES, _REACH = 96, 41, 0.02
_OUTLIER_PX = 1.5


@dataclass(frozen=True)
class PlainFrame:
    """Stands where a MarkedFrame does; its opening's corners are its one marker."""

    side_mm: int

    @property
    def ids(self) -> range:
        return range(1)

    @property
    def marker_mm(self) -> float:
        return float(self.side_mm)

    @property
    def outer_mm(self) -> float:
        return self.side_mm * (1 + 2 * PAPER_SHARE)

    def marker_corners_mm(self) -> Matrix:
        """(1, 4, 2), from the upper left clockwise."""
        return np.array([[(-1, 1), (1, 1), (1, -1), (-1, -1)]]) * self.side_mm / 2

    def patches(self) -> list[Rectangle]:
        """None."""
        return []

    def is_paper(self, points_mm: Matrix, margin_mm: float) -> npt.NDArray[np.bool_]:
        """(...) for (..., 2): paper, at least a margin from opening and border."""
        reach = abs(points_mm).max(axis=-1)
        return np.asarray(
            (reach > self.side_mm / 2 + margin_mm) & (reach < self.outer_mm / 2 - margin_mm)
        )


def find_opening(pixels: Image) -> Matrix | None:
    """(4, 2) corners of the opening in a photo (h, w, 3), linear and upright, from the upper left clockwise.

    The largest four-cornered hole in something white, its sides then fitted at full resolution. None if
    there is none.
    """
    shrink = min(1.0, COARSE_PX / max(pixels.shape[:2]))
    size = round(pixels.shape[1] * shrink), round(pixels.shape[0] * shrink)
    small = np.maximum(cv2.resize(pixels, size, interpolation=cv2.INTER_AREA), 0)
    darkest, brightest = small.min(axis=-1), np.maximum(small.max(axis=-1), 1e-6)
    full_white = max(float(np.percentile(darkest, 99)), 1e-6)
    coded = (np.sqrt(np.clip(darkest / full_white, 0, 1)) * 255).astype(np.uint8)
    _, bright = cv2.threshold(coded, 0, 255, cv2.THRESH_BINARY | cv2.THRESH_OTSU)
    white = (bright > 0) & (1 - darkest / brightest < _SATURATION)
    mask = cv2.morphologyEx(white.astype(np.uint8), cv2.MORPH_OPEN, np.ones((3, 3), np.uint8))
    contours, tree = cv2.findContours(mask, cv2.RETR_CCOMP, cv2.CHAIN_APPROX_NONE)
    best: Matrix | None = None
    largest = SMALLEST_SHARE * mask.size
    for contour, (_, _, _, parent) in zip(contours, tree[0] if contours else (), strict=True):
        if parent < 0 or cv2.contourArea(contour) < largest:
            continue
        corners = cv2.approxPolyDP(contour, _CORNERS_SHARE * cv2.arcLength(contour, True), True)
        if len(corners) == 4 and cv2.isContourConvex(corners):
            best, largest = np.asarray(corners, dtype=float).reshape(4, 2), cv2.contourArea(contour)
    if best is None:
        return None
    full = (_ordered(best) + 0.5) / shrink
    green = np.ascontiguousarray(pixels[..., 1])
    for _ in range(2):
        fitted = _fitted(green, full)
        if fitted is None:
            return None
        full = fitted
    return full


def _ordered(corners: Matrix) -> Matrix:
    """Clockwise as seen, the upper left one first."""
    around = corners - corners.mean(axis=0)
    clockwise = corners[np.argsort(np.arctan2(around[:, 1], around[:, 0]))]
    return np.asarray(np.roll(clockwise, -int(np.argmin(clockwise.sum(axis=1))), axis=0))


def _fitted(green: Image, corners: Matrix) -> Matrix | None:
    """Corners where lines through each side's steps from sample to paper cross."""
    lines = []
    for start, end in itertools.pairwise([*corners, corners[0]]):
        along = end - start
        outward = np.array([along[1], -along[0]]) / np.linalg.norm(along)
        reach = _REACH * float(np.linalg.norm(along))
        base = start + along * np.linspace(0.06, 0.94, _POINTS)[:, None]
        offsets = np.linspace(-reach, reach, _SAMPLES)
        points = (base[:, None] + outward * offsets[:, None] - 0.5).astype(np.float32)
        light = np.asarray(
            cv2.remap(green, points[..., 0], points[..., 1], cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
        )  # fmt: skip
        rise = np.diff(cv2.GaussianBlur(light, (5, 1), 0), axis=1)
        step = (offsets[np.argmax(rise, axis=1)] + offsets[np.argmax(rise, axis=1) + 1]) / 2
        edge = base + outward * step[:, None]
        line = _line(edge)
        if line is None:
            return None
        lines.append(line)
    crossings = [np.cross(lines[i - 1], lines[i]) for i in range(4)]
    return np.array([c[:2] / c[2] for c in crossings])


def _line(points: Matrix) -> Matrix | None:
    """(3,) homogeneous; from most of the points."""
    keep = np.ones(len(points), dtype=bool)
    line: Matrix = np.zeros(3)
    for _ in range(6):
        if keep.sum() < _POINTS // 4:
            return None
        middle = points[keep].mean(axis=0)
        _, _, axes = np.linalg.svd(points[keep] - middle)
        line = np.append(axes[1], -axes[1] @ middle)
        off = abs(points @ line[:2] + line[2])
        keep = off < max(2.5 * float(np.median(off)), _OUTLIER_PX)
    return line
