"""The platter's printed markers: drawing them and finding them.

The printed target and the simulated one are both `draw_platter`.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
import numpy.typing as npt

from turnlight.config import PlatterConfig
from turnlight.picture.pinhole import Matrix
from turnlight.picture.warp import Image

DETECTION_SIDE_PX = 32
"""Markers are found at about this size, then refined at full resolution."""
NOISE_BLUR_PX = 0.8
REFINEMENTS = 2
EDGE_REACH = 0.09
"""How far to either side an edge is looked at, in marker sides: less than the border's width."""
EDGE_POINTS, EDGE_SAMPLES = 24, 25
MARGIN = 0.25
"""Around a marker, in its sides: more than refining looks at."""


@dataclass(frozen=True)
class Detection:
    """Markers found in one image.

    ids: (n,) marker numbers, ascending; corners_px: (n, 4, 2) in the order of
    PlatterConfig.marker_corners_mm, continuous pixel coordinates.
    """

    ids: npt.NDArray[np.int64]
    corners_px: Matrix


def draw_platter(platter: PlatterConfig, corners_mm: Matrix, pixels_per_mm: float) -> Image:
    """(n, n) of the square around the platter's disc: 1 bare white paper, 0 ink.

    corners_mm: (8, 4, 2) of the markers, which stand upright.
    Row 0 is at +y with the table at 0 degrees. Edges are exact at any resolution.
    """
    size = round(2 * platter.radius_mm * pixels_per_mm)
    step = size / (2 * platter.radius_mm)
    paper = np.ones((size, size), np.float32)
    for bits, corners in zip(_marker_bits(platter), corners_mm, strict=True):
        left, top = (corners[0] * [1, -1] + platter.radius_mm) * step
        edges = np.linspace(0, (corners[2, 0] - corners[0, 0]) * step, len(bits) + 1)
        down, across = _overlap(size, top + edges), _overlap(size, left + edges)
        paper -= down @ (1 - bits) @ across.T
    return paper


def find_markers(
    green: npt.NDArray[np.uint16] | Image,
    platter: PlatterConfig,
    marker_px: float,
    linear: Callable[[Any], Image] = lambda values: values,
) -> Detection:
    """Find the platter's markers in the green channel (h, w).

    Coarsely in a reduced image, then each corner at full resolution.

    marker_px: side of a marker at the image's centre, roughly. linear: makes light of green's values, of
    as few of them as are needed.
    """
    reduction = max(1, int(marker_px / DETECTION_SIDE_PX))
    height, width = green.shape[0] // reduction, green.shape[1] // reduction
    small = linear(cv2.resize(green, (width, height), interpolation=cv2.INTER_AREA))
    bright = max(float(np.percentile(small[::2, ::2], 99)), 1e-6)
    coded = cv2.GaussianBlur(np.clip(small / bright, 0, 1) * 255, (0, 0), NOISE_BLUR_PX)
    detector = cv2.aruco.ArucoDetector(_dictionary(platter))
    found, numbers, _ = detector.detectMarkers(coded.astype(np.uint8))
    scale = np.array([green.shape[1] / width, green.shape[0] / height])
    known = len(platter.marker_corners_mm())
    coarse = {
        int(number): (corners[0] + 0.5) * scale
        for number, corners in zip(np.ravel(numbers) if found else (), found, strict=True)
        if number < known
    }
    ids = sorted(coarse)
    corners_px = [_refined_alone(green, coarse[i], linear) for i in ids]
    return Detection(np.array(ids, dtype=np.int64), np.reshape(corners_px, (-1, 4, 2)))


def _refined_alone(green: Any, corners_px: Matrix, linear: Callable[[Any], Image]) -> Matrix:
    """(4, 2) corners of one marker, by the light around it."""
    low, high = corners_px.min(axis=0), corners_px.max(axis=0)
    margin = (high - low).max() * MARGIN
    left, top = np.maximum(low - margin, 0).astype(int)
    right, bottom = (high + margin).astype(int) + 1
    light = linear(np.ascontiguousarray(green[top:bottom, left:right]))
    here = corners_px[None] - [left, top]
    for _ in range(REFINEMENTS):
        here = refined(light, here)
    result: Matrix = here[0] + [left, top]
    return result


def refined(green: Image, corners_px: Matrix) -> Matrix:
    """(n, 4, 2) corners where straight lines through the border's outer edges meet.

    Across an edge, what the light integrates to says where the step is, whatever the blur.
    """
    following = np.roll(corners_px, -1, axis=1)
    along = following - corners_px
    length = np.linalg.norm(along, axis=-1, keepdims=True)
    outward = np.stack([along[..., 1], -along[..., 0]], axis=-1) / length
    reach = length.min(axis=1, keepdims=True) * EDGE_REACH
    share = np.linspace(0.1, 0.9, EDGE_POINTS)
    across = np.linspace(-1, 1, EDGE_SAMPLES)
    base = corners_px[:, :, None] + along[:, :, None] * share[:, None]
    points = base[..., None, :] + (outward * reach)[:, :, None, None] * across[:, None]
    grid = (points - 0.5).reshape(-1, EDGE_SAMPLES, 2).astype(np.float32)
    light = cv2.remap(
        green, grid[..., 0], grid[..., 1], cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE
    )
    light = np.asarray(light, dtype=float).reshape(points.shape[:-1])
    ends = EDGE_SAMPLES // 6
    ink, paper = light[..., :ends].mean(-1), light[..., -ends:].mean(-1)
    contrast = np.maximum(paper - ink, 1e-6)
    inked = np.clip((paper[..., None] - light) / contrast[..., None], -1, 2).mean(-1)
    offset = (2 * inked - 1) * reach
    slope = ((share - share.mean()) * offset).sum(-1) / ((share - share.mean()) ** 2).sum()
    start = offset.mean(-1) - slope * share.mean()
    first = corners_px + outward * start[..., None]
    direction = along + outward * slope[..., None]
    return _meet(np.roll(first, 1, axis=1), np.roll(direction, 1, axis=1), first, direction)


def _meet(p: Matrix, along_p: Matrix, q: Matrix, along_q: Matrix) -> Matrix:
    """(..., 2) where the lines p + s along_p and q + t along_q cross."""
    cross = along_p[..., 0] * along_q[..., 1] - along_p[..., 1] * along_q[..., 0]
    gap = q - p
    s = (gap[..., 0] * along_q[..., 1] - gap[..., 1] * along_q[..., 0]) / cross
    result: Matrix = p + along_p * s[..., None]
    return result


def _marker_bits(platter: PlatterConfig) -> list[Image]:
    """Eight (modules, modules) arrays, 1 white and 0 black, border included."""
    dictionary = _dictionary(platter)
    modules = dictionary.markerSize + 2
    images = [cv2.aruco.generateImageMarker(dictionary, i, modules) for i in range(8)]
    return [(image > 127).astype(np.float32) for image in images]


def _overlap(size: int, edges: Matrix) -> Image:
    """(size, modules) how much of each pixel lies between consecutive edges."""
    start = np.arange(size)[:, None]
    shared = np.minimum(edges[None, 1:], start + 1) - np.maximum(edges[None, :-1], start)
    return np.asarray(np.clip(shared, 0, 1), np.float32)


def _dictionary(platter: PlatterConfig) -> cv2.aruco.Dictionary:
    return cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, platter.dictionary))
