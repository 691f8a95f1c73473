"""The printed frame that lies around a sample photographed by hand: where everything on it is.

Its frame of reference is the sample's: mm from the middle of the opening, x right, y up.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import cv2
import numpy as np
import numpy.typing as npt

from turnlight.picture.pinhole import Matrix
from turnlight.picture.warp import Image

SMALLEST_MM, LARGEST_MM = 20, 144
MARKERS = 8
DICTIONARY = cv2.aruco.DICT_5X5_1000
GAP_MM = 3.0
"""White between opening and marker, and around the markers."""
GREYS = (0.5, 0.25, 0.1)
"""Of the patches, linear and relative to the paper, as far as a printer keeps to it."""
PATCH_GAP_MM = 1.5


@dataclass(frozen=True)
class Rectangle:
    """left, bottom, right, top in mm; value: linear, relative to the paper, 0 is ink."""

    left: float
    bottom: float
    right: float
    top: float
    value: float


@dataclass(frozen=True)
class MarkedFrame:
    """side_mm: of the square opening, whole millimetres from SMALLEST_MM to LARGEST_MM."""

    side_mm: int

    @property
    def marker_mm(self) -> float:
        return float(np.clip(0.18 * self.side_mm, 10, 18))

    @property
    def outer_mm(self) -> float:
        """Side of the square that the frame covers."""
        return self.side_mm + 2 * (2 * GAP_MM + self.marker_mm)

    @property
    def ids(self) -> range:
        """Of the markers, from the upper left clockwise; no other size has them."""
        first = MARKERS * (self.side_mm - SMALLEST_MM)
        return range(first, first + MARKERS)

    def marker_centres_mm(self) -> Matrix:
        """(8, 2)."""
        away = self.side_mm / 2 + GAP_MM + self.marker_mm / 2
        ring = [(-1, 1), (0, 1), (1, 1), (1, 0), (1, -1), (0, -1), (-1, -1), (-1, 0)]
        return np.array(ring, dtype=float) * away

    def marker_corners_mm(self) -> Matrix:
        """(8, 4, 2), each marker's from its upper left clockwise, as they are found."""
        square = np.array([(-1, 1), (1, 1), (1, -1), (-1, -1)]) * self.marker_mm / 2
        return self.marker_centres_mm()[:, None] + square

    def patches(self) -> list[Rectangle]:
        """White and GREYS, in the lower side's gaps between markers."""
        gap = (self.side_mm - self.marker_mm) / 2 + GAP_MM
        side = min(12.0, (gap - 3 * PATCH_GAP_MM) / 2)
        y = -(self.side_mm + self.marker_mm) / 2 - GAP_MM
        middle = (self.marker_mm + gap) / 2
        step = (side + PATCH_GAP_MM) / 2
        places = (-middle - step, -middle + step, middle - step, middle + step)
        return [
            Rectangle(x - side / 2, y - side / 2, x + side / 2, y + side / 2, value)
            for x, value in zip(places, (1.0, *GREYS), strict=True)
        ]

    def rectangles(self) -> Iterator[Rectangle]:
        """Everything that is printed: the markers' black, run by run, and the grey patches."""
        for number, corners in zip(self.ids, self.marker_corners_mm(), strict=True):
            bits = marker_bits(number)
            module = self.marker_mm / len(bits)
            left, top = corners[0]
            for row, line in enumerate(bits):
                edges = np.flatnonzero(np.diff(np.concatenate([[1], line, [1]])))
                for start, end in edges.reshape(-1, 2):
                    yield Rectangle(
                        left + start * module,
                        top - (row + 1) * module,
                        left + end * module,
                        top - row * module,
                        0.0,
                    )
        yield from self.patches()[1:]

    def draw(self, pixels_per_mm: float) -> Image:
        """(n, n) of the square that the frame covers, 1 bare paper; edges are exact at any resolution."""
        size = round(self.outer_mm * pixels_per_mm)
        scale = size / self.outer_mm
        paper = np.ones((size, size), np.float32)
        for r in self.rectangles():
            x = (np.array([r.left, r.right]) + self.outer_mm / 2) * scale
            y = (self.outer_mm / 2 - np.array([r.top, r.bottom])) * scale
            rows, down = _covered(y, size)
            columns, across = _covered(x, size)
            paper[rows, columns] -= (1 - r.value) * down[:, None] * across
        return paper

    def is_paper(self, points_mm: Matrix, margin_mm: float) -> npt.NDArray[np.bool_]:
        """(...) for (..., 2): bare paper of the frame, at least a margin from opening, ink and border."""
        x, y = points_mm[..., 0], points_mm[..., 1]
        reach = np.maximum(abs(x), abs(y))
        bare = (reach > self.side_mm / 2 + margin_mm) & (reach < self.outer_mm / 2 - margin_mm)
        printed = [(c[3], c[1]) for c in self.marker_corners_mm()]
        printed += [
            (np.array([p.left, p.bottom]), np.array([p.right, p.top])) for p in self.patches()
        ]
        for low, high in printed:
            inside = (points_mm > low - margin_mm) & (points_mm < high + margin_mm)
            bare &= ~inside.all(axis=-1)
        return np.asarray(bare)


def frame_of(marker: int) -> tuple[MarkedFrame, int]:
    """The frame that has the marker of this number, and the marker's place on it, 0 to 7."""
    size, place = divmod(marker, MARKERS)
    return MarkedFrame(size + SMALLEST_MM), place


def dictionary() -> cv2.aruco.Dictionary:
    """All frames' markers."""
    return cv2.aruco.getPredefinedDictionary(DICTIONARY)


def marker_bits(number: int) -> npt.NDArray[np.int64]:
    """(7, 7) 0 black, 1 white, with the black border."""
    side = dictionary().markerSize + 2
    drawn = cv2.aruco.generateImageMarker(dictionary(), number, side)
    return (np.asarray(drawn) > 127).astype(np.int64)


def _covered(edges: Matrix, size: int) -> tuple[slice, Image]:
    """Which pixels an interval touches, and how much of each it covers."""
    first, last = int(np.floor(edges[0])), int(np.ceil(edges[1]))
    first, last = max(first, 0), min(last, size)
    start = np.arange(first, last)
    share = np.minimum(edges[1], start + 1) - np.maximum(edges[0], start)
    return slice(first, last), np.clip(share, 0, 1).astype(np.float32)
