"""From a frame to a Picture: find the platter, and unwarp the sample's surface above it."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from turnlight.config import RigConfig
from turnlight.errors import ImageError
from turnlight.frame import Frame
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
from turnlight.picture.platter import Platter, locate
from turnlight.picture.radiometry import clipped, colour_corrected, linear, vignetting
from turnlight.picture.warp import Image, resample

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


def rectify(
    frame: Frame,
    dark: Frame | None,
    config: RigConfig,
    thickness_mm: float,
    resolution: int,
    leds: Sequence[int] = (),
) -> Rectified:
    """Unwarp the sample's surface to resolution x resolution, in the sample's own frame.

    dark: a frame at the same exposure with every LED off, at any table angle; it is subtracted in
    linear light after the resampling, and what noise makes negative is set to 0. Without one, the
    calibrated dark level is. leds: those lit, whose colour a calibrated rig takes out; none stands
    for all. Clipped pixels stay valid; those that the sensor did not see do not. Raises ImageError
    when the platter cannot be found.
    """
    _check(frame, dark, config)
    platter = locate(frame, config)
    seen = _unwarp(frame, platter.pose, config, thickness_mm, resolution)
    ambient: Image | Matrix = np.array(config.geometry.dark.level)
    if dark is not None:
        pose = _dark_pose(dark, platter, config)
        ambient = _unwarp(dark, pose, config, thickness_mm, resolution).light
    light = np.asarray((seen.light - ambient) / seen.vignetting, np.float32)
    image = np.maximum(colour_corrected(light, config, leds), 0) * seen.valid[..., None]
    gain = REFERENCE_EXPOSURE_US / frame.exposure.exposure_us / frame.exposure.gain
    return Rectified(
        Picture(image, gain, seen.valid, seen.clipped & seen.valid),
        platter.angle_deg,
        len(platter.ids),
        platter.residual_px,
        platter.pose,
    )


def _check(frame: Frame, dark: Frame | None, config: RigConfig) -> None:
    expected = (config.camera.height_px, config.camera.width_px)
    if frame.pixels.shape[:2] != expected:
        raise ImageError(
            f"The frame is {frame.pixels.shape[1]}x{frame.pixels.shape[0]} pixels but the rig file "
            f"says {expected[1]}x{expected[0]}; correct its width_px and height_px."
        )
    if dark is not None and (dark.exposure, dark.pixels.shape) != (
        frame.exposure,
        frame.pixels.shape,
    ):
        raise ImageError(
            "The dark frame was not taken like the frame; take one at the same exposure and gain."
        )


def _dark_pose(dark: Frame, lit: Platter, config: RigConfig) -> Pose:
    """A dark frame may be from before the table turned: where its ambient light shows the markers,
    they say where the sample was; where it does not, there is nothing to align.
    """
    try:
        return locate(dark, config).pose
    except ImageError:
        return lit.pose


@dataclass(frozen=True)
class _Unwarped:
    """The sample's surface: linear light (n, n, 3), what the lens let through there (n, n, 1), which
    pixels the sensor saw, and which draw on clipped ones.
    """

    light: Image
    vignetting: Image
    valid: npt.NDArray[np.bool_]
    clipped: npt.NDArray[np.bool_]


def _unwarp(
    frame: Frame, pose: Pose, config: RigConfig, thickness_mm: float, resolution: int
) -> _Unwarped:
    to_ideal = plane_homography(config, pose, thickness_mm) @ grid_to_plane(
        config.sample.side_mm, resolution
    )
    rig_lens = lens(config)

    def on_sensor(points: Matrix) -> Matrix:
        return distort(rig_lens, project(to_ideal, points))

    seen_at = on_sensor(np.stack(np.meshgrid(*[np.arange(resolution) + 0.5] * 2), axis=-1))
    limit = np.array([frame.pixels.shape[1], frame.pixels.shape[0]])
    inside = np.asarray((seen_at >= 0) & (seen_at <= limit))
    left, top = np.clip(np.floor(seen_at.min(axis=(0, 1))) - MARGIN_PX, 0, limit).astype(int)
    right, bottom = np.clip(np.ceil(seen_at.max(axis=(0, 1))) + MARGIN_PX, 0, limit).astype(int)
    if left >= right or top >= bottom:
        raise ImageError("The sample lies outside the camera's picture; point the camera at it.")
    pixels = frame.pixels[top:bottom, left:right]

    def in_crop(points: Matrix) -> Matrix:
        return on_sensor(points) - [left, top]

    full_scale = clipped(frame, pixels).astype(np.float32)
    return _Unwarped(
        light=resample(linear(frame, pixels), in_crop, resolution, resolution),
        vignetting=vignetting(config, seen_at),
        valid=inside[..., 0] & inside[..., 1],
        clipped=np.asarray(resample(full_scale, in_crop, resolution, resolution) > 0),
    )
