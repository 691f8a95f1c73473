"""From a photo and its record to the Picture that estimators see, the same for every use of it."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from svbrdf.lighting import Light, Lighting
from turnlight.handheld.finding import Sighting
from turnlight.handheld.flash import flash_mm, highlight, is_flash
from turnlight.handheld.lens import plane_of, pose_of, residual_px
from turnlight.handheld.photo import Photo
from turnlight.handheld.record import Measured, PhotoRecord
from turnlight.handheld.shading import Shading, Source, find_lamp, read_shading
from turnlight.handheld.sharpness import Bands, bands, detail
from turnlight.handheld.tone import tone
from turnlight.handheld.unwarp import PaperLight, Unwarped, paper_light, unwarp
from turnlight.picture.picture import Picture
from turnlight.picture.pinhole import Lens, Matrix, Pose, grid_to_plane, project
from turnlight.picture.warp import Image

RESOLUTION = 512


@dataclass(frozen=True)
class Look:
    """What is taken from a photo's pixels. lamp_mm: as `shading.find_lamp`."""

    lens: Lens
    unwarped: Unwarped
    paper: PaperLight
    lamp_mm: Matrix | None
    bands: Bands


def look(photo: Photo, record: PhotoRecord, resolution: int = RESOLUTION) -> Look:
    """Straighten sample and paper out of a photo whose frame and lens are known."""
    seen, lens = _known(record)
    plane = plane_of(seen, lens)
    side = seen.frame.side_mm
    square = unwarp(photo, lens, plane, side, resolution, record.shift_mm)
    paper = paper_light(photo, lens, seen)
    lamp = find_lamp(paper, seen.frame.outer_mm / 2)
    return Look(lens, square, paper, lamp, bands(square.light))


def pose(record: PhotoRecord) -> Pose:
    """The frame's, as the record's lens saw it."""
    seen, lens = _known(record)
    return pose_of(seen, lens)


def shading(record: PhotoRecord, seen: Look) -> Shading | None:
    """The light on the frame; None where too little of its paper is to be seen."""
    if seen.lamp_mm is None:
        return None
    sighting, _ = _known(record)
    flash = flash_mm(pose(record), np.array(record.flash_mm))
    return read_shading(seen.paper, flash, seen.lamp_mm, sighting.frame.outer_mm / 2)


def find_highlight(record: PhotoRecord, seen: Look) -> Matrix | None:
    """(2,) mm of the flash's highlight on the sample, where there is one."""
    if seen.lamp_mm is None or not is_flash(pose(record), seen.lamp_mm):
        return None
    sighting, _ = _known(record)
    scale = sighting.frame.outer_mm / 2
    lit = read_shading(seen.paper, seen.lamp_mm, seen.lamp_mm, scale)
    points = _grid(sighting.frame.side_mm, len(seen.unwarped.light))
    image = seen.unwarped.light / np.maximum(lit.reading(points), 1e-6)[..., None]
    return highlight(image.astype(np.float32), seen.unwarped.clipped, sighting.frame.side_mm)


def picture(record: PhotoRecord, seen: Look, lit: Shading | None, white: float) -> Picture:
    """The sample, its white balanced by the frame's paper, whose reflectance is `white`."""
    square = seen.unwarped
    if lit is None:
        return Picture(square.light, 1.0, square.valid, square.clipped)
    sighting, _ = _known(record)
    side = sighting.frame.side_mm
    image = np.asarray(square.light / lit.colour, np.float32)
    points = _grid(side, len(image))
    flat = lit.reading(points) / white
    middle = float(lit.reading(np.zeros(2))) / white
    if lit.light_mm is None:
        return Picture(image, 1 / middle, square.valid, square.clipped)
    height = lit.light_mm[2]
    distance = np.sqrt(np.sum((points - lit.light_mm[:2]) ** 2, axis=-1) + height**2)
    facing = np.asarray(flat * distance / height, np.float32)
    facing_middle = middle * float(np.linalg.norm(lit.light_mm)) / height
    rotation, translation = pose(record)
    view = -rotation.T @ translation * 2 / side
    light = Light(
        (lit.light_mm * 2 / side).astype(np.float32), np.repeat(facing[..., None], 3, axis=-1)
    )
    lighting = Lighting(view.astype(np.float32), (light,))
    return Picture(image, 1 / facing_middle, square.valid, square.clipped, lighting)


def measure(
    record: PhotoRecord, seen: Look, lit: Shading | None, others: Sequence[Look]
) -> Measured:
    """What the checks need. others: looks at the sample's other photos."""
    sighting, lens = _known(record)
    rotation, translation = pose(record)
    camera = -rotation.T @ translation
    plane = plane_of(sighting, lens)
    square = seen.unwarped
    return Measured(
        elevation_deg=float(np.degrees(np.arcsin(camera[2] / np.linalg.norm(camera)))),
        resolution_px=_resolution(plane, sighting),
        residual_px=residual_px(sighting, lens, plane),
        detail=detail(seen.bands, [other.bands for other in others]),
        clipped=float(square.clipped.mean()),
        paper_clipped=seen.paper.clipped,
        shadow=0.0 if lit is None else lit.shadow,
        tone=None if lit is None else tone(seen.paper, lit),
        source=Source.UNKNOWN if lit is None else lit.source,
        camera_mm=_triple(camera),
        light_mm=None if lit is None or lit.light_mm is None else _triple(lit.light_mm),
    )


def _known(record: PhotoRecord) -> tuple[Sighting, Lens]:
    assert record.frame is not None and record.lens is not None
    return record.frame.sighting, record.lens.lens(record.width_px, record.height_px)


def _resolution(plane: Matrix, seen: Sighting) -> float:
    """Pixels along the sample's side at its middle, in the direction in which they are fewest."""
    step = 0.5
    around = project(plane, np.array([[step, 0], [-step, 0], [0, step], [0, -step]]))
    jacobian = np.stack([around[0] - around[1], around[2] - around[3]], axis=-1)
    return float(np.linalg.svd(jacobian, compute_uv=False)[-1] * seen.frame.side_mm)


def _grid(side_mm: float, resolution: int) -> Image:
    pixels = np.stack(np.meshgrid(*[np.arange(resolution) + 0.5] * 2), axis=-1)
    return np.asarray(project(grid_to_plane(side_mm, resolution), pixels), np.float32)


def _triple(vector: Matrix) -> tuple[float, float, float]:
    x, y, z = (float(v) for v in vector)
    return x, y, z


def without_light(picture: Picture) -> Picture:
    """For estimators that are to be told all pictures' lights or none."""
    return replace(picture, lighting=None)
