"""The sample's surface and the paper around it, straightened out of a photo."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from turnlight.handheld.finding import Sighting
from turnlight.handheld.lens import plane_of
from turnlight.handheld.photo import Photo
from turnlight.picture.pinhole import Lens, Matrix, distort, grid_to_plane, project
from turnlight.picture.warp import Image, resample

MARGIN_PX = 8
"""Kept around what is unwarped, for the resampling's averages at its edge."""
PAPER_PX = 256
PAPER_MARGIN_MM = 1.2
PATCH_MARGIN = 0.25
"""Of a patch's side: what is left out at its edges."""


@dataclass(frozen=True)
class Unwarped:
    """A square of the frame's plane. light: (n, n, 3) linear; valid, clipped: (n, n) as a Picture's."""

    light: Image
    valid: npt.NDArray[np.bool_]
    clipped: npt.NDArray[np.bool_]


@dataclass(frozen=True)
class Grey:
    """A grey patch. printed: relative to the paper. middle_mm: (2,). reading: green, linear."""

    printed: float
    middle_mm: Matrix
    reading: float


@dataclass(frozen=True)
class PaperLight:
    """Bare white paper of the frame. points_mm: (p, 2); readings: (p, 3) linear, none of them clipped;
    clipped: share of the paper seen that is; greys: of the patches that are seen.
    """

    points_mm: Matrix
    readings: Matrix
    clipped: float
    greys: tuple[Grey, ...] = ()


def unwarp(
    photo: Photo,
    lens: Lens,
    plane: Matrix,
    side_mm: float,
    resolution: int,
    shift_mm: tuple[float, float] = (0.0, 0.0),
) -> Unwarped:
    """The square of this side about the opening's middle, row 0 at +y; anti-aliased, in linear light.

    plane: as `lens.plane_of`. shift_mm: what is added to positions on the plane.
    """
    to_plane = grid_to_plane(side_mm, resolution)
    to_plane[:2, 2] += shift_mm
    to_ideal = plane @ to_plane

    def on_photo(points: Matrix) -> Matrix:
        return distort(lens, project(to_ideal, points))

    height, width = photo.pixels.shape[:2]
    limit = np.array([width, height])
    seen_at = on_photo(np.stack(np.meshgrid(*[np.arange(resolution) + 0.5] * 2), axis=-1))
    within = np.asarray((seen_at >= 0) & (seen_at <= limit))
    inside = within[..., 0] & within[..., 1]
    left, top = np.clip(np.floor(seen_at.min(axis=(0, 1))) - MARGIN_PX, 0, limit - 2).astype(int)
    right, bottom = np.clip(np.ceil(seen_at.max(axis=(0, 1))) + MARGIN_PX, 2, limit).astype(int)

    def in_crop(points: Matrix) -> Matrix:
        return on_photo(points) - [left, top]

    crop = np.s_[top:bottom, left:right]
    full_scale = photo.clipped[crop].astype(np.float32)
    light = np.maximum(resample(photo.pixels[crop], in_crop, resolution, resolution), 0)
    clipped = resample(full_scale, in_crop, resolution, resolution) > 0
    return Unwarped(light * inside[..., None], inside, np.asarray(clipped & inside))


def paper_light(photo: Photo, lens: Lens, seen: Sighting) -> PaperLight:
    """What the frame's bare paper reads, on a grid of PAPER_PX over the frame."""
    outer = seen.frame.outer_mm
    square = unwarp(photo, lens, plane_of(seen, lens), outer, PAPER_PX)
    pixels = np.stack(np.meshgrid(*[np.arange(PAPER_PX) + 0.5] * 2), axis=-1)
    points = project(grid_to_plane(outer, PAPER_PX), pixels)
    paper = seen.frame.is_paper(points, PAPER_MARGIN_MM) & square.valid
    good = paper & ~square.clipped
    share = float((paper & square.clipped).sum() / max(paper.sum(), 1))
    greys = []
    for patch in seen.frame.patches():
        low, high = np.array([patch.left, patch.bottom]), np.array([patch.right, patch.top])
        edge = PATCH_MARGIN * (high - low)
        inside = ((points > low + edge) & (points < high - edge)).all(axis=-1) & square.valid
        if patch.value < 1 and inside.any():
            reading = float(np.median(square.light[inside][:, 1]))
            greys.append(Grey(patch.value, (low + high) / 2, reading))
    return PaperLight(points[good], square.light[good].astype(float), share, tuple(greys))
