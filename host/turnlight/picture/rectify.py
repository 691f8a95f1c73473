"""From a frame to a Picture: find the platter, and unwarp the sample's surface above it."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from turnlight.config import RigConfig
from turnlight.errors import ImageError
from turnlight.frame import Exposure, Frame
from turnlight.picture.picture import Picture
from turnlight.picture.pinhole import (
    Matrix,
    Pose,
    distort,
    grid_to_plane,
    lens,
    plane_homography,
    project,
)
from turnlight.picture.platter import locate
from turnlight.picture.radiometry import averaged, colour_corrected, vignetting
from turnlight.picture.warp import Image, Mapping, reduction, resample

REFERENCE_EXPOSURE_US = 10_000
MARGIN_PX = 8
"""Kept around the sample, for the resampling's averages at its edge."""


@dataclass(frozen=True)
class Rectified:
    """A Picture and how it was aligned.

    pose: the platter's, as `pinhole.platter_pose` has it, and measured_angle_deg: its turn in
    [-180, 180), as its markers show them.
    marker_residual_px: root mean square distance of the markers' corners from where they should be.
    """

    picture: Picture
    measured_angle_deg: float
    markers_seen: int
    marker_residual_px: float
    pose: Pose


@dataclass(frozen=True)
class Ambient:
    """What a dark frame shows of the sample, ready to be subtracted from any frame taken like it.

    light: (n, n, 3) linear, in the sample's own frame.
    """

    exposure: Exposure
    light: Image


def ambient(dark: Frame, config: RigConfig, thickness_mm: float, resolution: int) -> Ambient | None:
    """Prepare a dark frame, which may be from before the table turned, for many frames.

    None where the room's light does not show the markers: where the sample was, each lit frame has to
    say, and needs the dark frame itself. Raises ImageError.
    """
    try:
        pose = locate(dark, config).pose
    except ImageError:
        return None
    seen = _light_and_clipped(dark, _view(pose, config, thickness_mm, resolution))
    return Ambient(dark.exposure, seen[..., :3])


def rectify(
    frame: Frame,
    dark: Frame | Ambient | None,
    config: RigConfig,
    thickness_mm: float,
    resolution: int,
    leds: Sequence[int] = (),
) -> Rectified:
    """Unwarp the sample's surface to resolution x resolution, in the sample's own frame.

    dark: a frame at the same exposure with every LED off, at any table angle, or what `ambient` has
    made of it for this thickness and resolution; it is subtracted in linear light after the
    resampling, and what noise makes negative is set to 0. Without one, the calibrated dark level is.
    leds: those lit, whose colour a calibrated rig takes out; none stands for all. Clipped pixels stay
    valid; those that the sensor did not see do not. Raises ImageError when the platter cannot be found.
    """
    _check(frame, dark, config)
    platter = locate(frame, config)
    view = _view(platter.pose, config, thickness_mm, resolution)
    seen = _light_and_clipped(frame, view)
    light, full_scale = seen[..., :3], seen[..., 3] > 0
    without = _without_leds(dark, view, config, thickness_mm, resolution)
    light = np.asarray((light - without) / vignetting(config, view.seen_at), np.float32)
    image = colour_corrected(light, config, leds) * view.valid[..., None]
    gain = REFERENCE_EXPOSURE_US / frame.exposure.exposure_us / frame.exposure.gain
    return Rectified(
        Picture(image, gain, view.valid, full_scale & view.valid),
        platter.angle_deg,
        len(platter.ids),
        platter.residual_px,
        platter.pose,
    )


def _without_leds(
    dark: Frame | Ambient | None,
    view: "_View",
    config: RigConfig,
    thickness_mm: float,
    resolution: int,
) -> Image | Matrix:
    if dark is None:
        return np.array(config.geometry.dark.level)
    if isinstance(dark, Ambient):
        return dark.light
    known = ambient(dark, config, thickness_mm, resolution)
    return known.light if known else _light_and_clipped(dark, view)[..., :3]


def _check(frame: Frame, dark: Frame | Ambient | None, config: RigConfig) -> None:
    expected = (config.camera.height_px, config.camera.width_px)
    if frame.pixels.shape[:2] != expected:
        raise ImageError(
            f"The frame is {frame.pixels.shape[1]}x{frame.pixels.shape[0]} pixels but the rig file "
            f"says {expected[1]}x{expected[0]}; correct its width_px and height_px."
        )
    alike = dark is None or dark.exposure == frame.exposure
    if isinstance(dark, Frame):
        alike &= dark.pixels.shape == frame.pixels.shape
    if not alike:
        raise ImageError(
            "The dark frame was not taken like the frame; take one at the same exposure and gain."
        )


@dataclass(frozen=True)
class _View:
    """Where a frame shows the sample's surface.

    seen_at: (n, n, 2) on the sensor. crop: the part of the sensor that holds it. source_of: from the
    surface's pixels to the crop's.
    """

    seen_at: Matrix
    valid: npt.NDArray[np.bool_]
    crop: tuple[slice, slice]
    source_of: Mapping


def _view(pose: Pose, config: RigConfig, thickness_mm: float, resolution: int) -> _View:
    to_ideal = plane_homography(config, pose, thickness_mm) @ grid_to_plane(
        config.sample.side_mm, resolution
    )
    rig_lens = lens(config)

    def on_sensor(points: Matrix) -> Matrix:
        return distort(rig_lens, project(to_ideal, points))

    seen_at = on_sensor(np.stack(np.meshgrid(*[np.arange(resolution) + 0.5] * 2), axis=-1))
    x, y = seen_at[..., 0], seen_at[..., 1]
    width, height = config.camera.width_px, config.camera.height_px
    left, right = (int(np.clip(at, 0, width)) for at in (x.min() - MARGIN_PX, x.max() + MARGIN_PX))
    top, bottom = (int(np.clip(at, 0, height)) for at in (y.min() - MARGIN_PX, y.max() + MARGIN_PX))
    if left >= right or top >= bottom:
        raise ImageError("The sample lies outside the camera's picture; point the camera at it.")
    return _View(
        seen_at=seen_at,
        valid=np.asarray((x >= 0) & (x <= width) & (y >= 0) & (y <= height)),
        crop=(slice(top, bottom), slice(left, right)),
        source_of=lambda points: on_sensor(points) - [left, top],
    )


def _light_and_clipped(frame: Frame, view: _View) -> Image:
    """(n, n, 4) linear light of the sample's surface, and above 0 what draws on clipped pixels."""
    resolution = len(view.seen_at)
    side = reduction(view.source_of, resolution, resolution)
    light = averaged(frame, frame.pixels[view.crop], side)
    return resample(light, lambda p: view.source_of(p) / side, resolution, resolution)
