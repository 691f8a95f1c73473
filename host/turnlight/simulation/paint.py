"""Laying a lit plane over the simulated sensor's image, through the lens."""

import numpy as np

from turnlight.config import RigConfig
from turnlight.picture.pinhole import (
    Lens,
    Matrix,
    Pose,
    distort,
    grid_to_plane,
    lens,
    plane_homography,
    project,
    undistort,
)
from turnlight.picture.warp import Image, dense, resample

EDGE_POINTS = 16


def paint(image: Image, radiance: Image, side_mm: float, config: RigConfig, pose: Pose) -> None:
    """Lay (n, n[, c]) radiance of a square about the pose's origin over the image, edges anti-aliased."""
    rig_lens = lens(config)
    to_ideal = plane_homography(config, pose, 0.0)
    corners = project(to_ideal, np.array([(-1, 1), (1, 1), (1, -1), (-1, -1)]) * side_mm / 2)
    share = np.linspace(0, 1, EDGE_POINTS)[:, None, None]
    outline = distort(rig_lens, corners + share * (np.roll(corners, -1, axis=0) - corners))
    limit = (image.shape[1], image.shape[0])
    left, top = np.clip(np.floor(outline.min(axis=(0, 1))), 0, limit).astype(int)
    right, bottom = np.clip(np.ceil(outline.max(axis=(0, 1))), 0, limit).astype(int)
    width, height = int(right - left), int(bottom - top)
    if width == 0 or height == 0:
        return
    rows, columns = radiance.shape[:2]
    to_unit = np.diag([1 / columns, 1 / rows, 1.0])
    to_radiance = np.linalg.inv(to_ideal @ grid_to_plane(side_mm, 1) @ to_unit)

    def source_of(points: Matrix) -> Matrix:
        return project(to_radiance, undistort(rig_lens, np.add(points, [left, top])))

    seen = resample(radiance, source_of, width, height).reshape(height, width, -1)
    under = image[top:bottom, left:right]
    ideal = _ideal(rig_lens, int(left), int(top), width, height)
    under += _coverage(corners, *ideal)[..., None] * (seen - under)


def _ideal(rig_lens: Lens, left: int, top: int, width: int, height: int) -> tuple[Image, Image]:
    """Ideal x and y of a region's pixel centres, arrays that broadcast to (height, width)."""
    if rig_lens.is_ideal:
        x = np.arange(left, left + width, dtype=np.float32) + 0.5
        return x, np.arange(top, top + height, dtype=np.float32)[:, None] + 0.5
    ideal = dense(lambda points: undistort(rig_lens, np.add(points, [left, top])), width, height)
    return ideal[..., 0], ideal[..., 1]


def _coverage(corners: Matrix, x: Image, y: Image) -> Image:
    """(height, width) share of each pixel inside a polygon, from the distance to its edges."""
    inside = np.full(np.broadcast_shapes(x.shape, y.shape), np.inf, np.float32)
    for start, end in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        along = (end - start) / np.linalg.norm(end - start)
        # y points down and the corners run clockwise on screen: the inside is on the right.
        across = np.float32(along[0]) * (y - np.float32(start[1]))
        np.minimum(inside, across - np.float32(along[1]) * (x - np.float32(start[0])), out=inside)
    return np.asarray(np.clip(inside + 0.5, 0, 1), np.float32)
