"""Resampling without aliasing."""

import math
from collections.abc import Callable

import cv2
import numpy as np
import numpy.typing as npt

from turnlight.picture.pinhole import Matrix, project

Image = npt.NDArray[np.float32]
Mapping = Callable[[Matrix], Matrix]
"""(..., 2) points of one image to where they lie in another, in continuous pixel coordinates."""
FINEST = 4
"""Samples per target pixel and axis; beyond it the source is halved first."""
NODE_PX = 8
"""Mappings are worked out this far apart and are linear between: they bend slowly."""


def warp(image: Image, homography: Matrix, width: int, height: int) -> Image:
    """`resample` through a (3, 3) homography from source to target."""
    back = np.asarray(np.linalg.inv(homography), dtype=float)
    return resample(image, lambda points: project(back, points), width, height)


def resample(image: Image, source_of: Mapping, width: int, height: int) -> Image:
    """Resample (h, w[, c]) linear values into (height, width[, c]); border pixels extend outward.

    source_of: from target to source. Where the source is the finer grid it is averaged: first over blocks
    of `reduction`, then sampled several times per target pixel.
    """
    density = _source_pixels_per_target_pixel(source_of, width, height)
    side = min(_halved(density), *image.shape[:2])
    rows, columns = image.shape[0] // side, image.shape[1] // side
    scale = np.array([columns / image.shape[1], rows / image.shape[0]])
    if side > 1:
        image = cv2.resize(image, (columns, rows), interpolation=cv2.INTER_AREA).astype(np.float32)
    samples = min(max(math.ceil(density / side), 1), FINEST)
    places = dense(lambda p: source_of(p / samples) * scale, width * samples, height * samples)
    places -= np.float32(0.5)  # in OpenCV, the first pixel's centre is at 0
    result = cv2.remap(  # its stubs do not know that a map may have two channels
        image, places, None, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE
    )  # type: ignore[call-overload]
    if samples > 1:
        result = cv2.resize(result, (width, height), interpolation=cv2.INTER_AREA)
    return result.astype(np.float32, copy=False)


def reduction(source_of: Mapping, width: int, height: int) -> int:
    """Side of the blocks of source pixels that `resample` averages first."""
    return _halved(_source_pixels_per_target_pixel(source_of, width, height))


def _halved(density: float) -> int:
    side = 1
    while density > FINEST * side:
        side *= 2
    return side


def dense(mapping: Mapping, width: int, height: int) -> Image:
    """(height, width, 2) a mapping at every pixel's centre."""
    across, down = (math.ceil(n / NODE_PX) + 2 for n in (width, height))
    nodes = np.stack(np.meshgrid(np.arange(across), np.arange(down)), axis=-1)
    coarse = mapping((nodes - 0.5) * NODE_PX).astype(np.float32)
    size = (across * NODE_PX, down * NODE_PX)
    fine = cv2.resize(coarse, size, interpolation=cv2.INTER_LINEAR)
    inside = fine[NODE_PX : NODE_PX + height, NODE_PX : NODE_PX + width]
    return np.ascontiguousarray(inside, np.float32)


def _source_pixels_per_target_pixel(source_of: Mapping, width: int, height: int) -> float:
    """The largest at the target's corners and centre, over directions."""
    corners = [(0, 0), (width, 0), (width, height), (0, height), (width / 2, height / 2)]
    points: Matrix = np.array(corners, dtype=np.float64)
    steps = [(0.5, 0), (0, 0.5), (-0.5, 0), (0, -0.5)]
    right, down, left, up = (source_of(points + step) for step in steps)
    jacobians = np.stack([right - left, down - up], axis=-1)
    return float(np.linalg.norm(jacobians, ord=2, axis=(-2, -1)).max())
