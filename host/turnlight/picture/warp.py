"""Perspective resampling without aliasing."""

import math

import cv2
import numpy as np
import numpy.typing as npt

from turnlight.picture.pinhole import Matrix, project

Image = npt.NDArray[np.float32]
FINEST = 4
"""Samples per target pixel and axis; beyond it the source is halved first."""


def warp(image: Image, homography: Matrix, width: int, height: int) -> Image:
    """Resample (h, w[, c]) linear values into (height, width[, c]); border pixels extend outward.

    homography: (3, 3) from source to target, in continuous pixel coordinates. Where the source is
    the finer grid it is averaged: halved by area, then sampled several times per target pixel.
    """
    density = _source_pixels_per_target_pixel(homography, width, height)
    while density > FINEST and min(image.shape[:2]) >= 2:
        rows, columns = image.shape[0] // 2, image.shape[1] // 2
        halve = np.diag([columns / image.shape[1], rows / image.shape[0], 1.0])
        image = cv2.resize(image, (columns, rows), interpolation=cv2.INTER_AREA).astype(np.float32)
        homography = homography @ np.linalg.inv(halve)
        density /= 2
    samples = min(max(math.ceil(density), 1), FINEST)
    fine = np.diag([samples, samples, 1.0]) @ homography
    result = cv2.warpPerspective(
        image,
        _centred(fine),
        (width * samples, height * samples),
        flags=cv2.INTER_LINEAR,
        borderMode=cv2.BORDER_REPLICATE,
    )
    if samples > 1:
        result = cv2.resize(result, (width, height), interpolation=cv2.INTER_AREA)
    return result.astype(np.float32, copy=False)


def _source_pixels_per_target_pixel(homography: Matrix, width: int, height: int) -> float:
    """The largest at the target's corners and centre, over directions."""
    back = np.asarray(np.linalg.inv(homography), np.float64)
    corners = [(0, 0), (width, 0), (width, height), (0, height), (width / 2, height / 2)]
    points: Matrix = np.array(corners, dtype=np.float64)
    steps = [(0.5, 0), (0, 0.5), (-0.5, 0), (0, -0.5)]
    right, down, left, up = (project(back, np.add(points, step)) for step in steps)
    jacobians = np.stack([right - left, down - up], axis=-1)
    return float(np.linalg.norm(jacobians, ord=2, axis=(-2, -1)).max())


def _centred(homography: Matrix) -> Matrix:
    """From continuous coordinates to OpenCV's, in which the first pixel's centre is at 0."""
    shift = np.array([[1.0, 0.0, 0.5], [0.0, 1.0, 0.5], [0.0, 0.0, 1.0]])
    centred: Matrix = np.linalg.inv(shift) @ homography @ shift
    return centred
