"""From a frame to a Picture: find the platter, and unwarp the sample's surface above it."""

from dataclasses import dataclass

import cv2
import numpy as np
import numpy.typing as npt

from turnlight.config import RigConfig
from turnlight.errors import ImageError
from turnlight.frame import Frame
from turnlight.picture.markers import find_markers
from turnlight.picture.picture import Picture
from turnlight.picture.pinhole import (
    Matrix,
    camera_rotation,
    grid_to_plane,
    intrinsics,
    plane_homography,
    project,
)
from turnlight.picture.warp import Image, warp

FEWEST_MARKERS = 3
OUTLIER_PX = 2.0
REFERENCE_EXPOSURE_US = 10_000
MARGIN_PX = 8
"""Kept around the sample, for the resampling's averages at its edge."""


@dataclass(frozen=True)
class Rectified:
    """A Picture and how it was aligned.

    measured_angle_deg: turn of the platter in [-180, 180), as its markers show it.
    marker_residual_px: root mean square distance of the markers' corners from where they should be.
    """

    picture: Picture
    measured_angle_deg: float
    markers_seen: int
    marker_residual_px: float


def rectify(
    frame: Frame, dark: Frame | None, config: RigConfig, thickness_mm: float, resolution: int
) -> Rectified:
    """Unwarp the sample's surface to resolution x resolution, in the sample's own frame.

    dark: a frame at the same exposure with every LED off, at any table angle; it is subtracted in
    linear light after the resampling, and what noise makes negative is set to 0. Clipped pixels
    stay valid; those that the sensor did not see do not. Raises ImageError when the platter
    cannot be found.
    """
    _check(frame, dark, config)
    platter = _locate(frame, config)
    image, valid, clipped = _unwarp(frame, platter.pose, config, thickness_mm, resolution)
    if dark is not None:
        pose = _dark_pose(dark, platter, config)
        ambient, _, _ = _unwarp(dark, pose, config, thickness_mm, resolution)
        image -= ambient
    gain = REFERENCE_EXPOSURE_US / frame.exposure.exposure_us / frame.exposure.gain
    return Rectified(
        Picture(np.maximum(image, 0) * valid[..., None], gain, valid, clipped & valid),
        platter.angle_deg,
        platter.markers,
        platter.residual_px,
    )


@dataclass(frozen=True)
class _Platter:
    pose: tuple[Matrix, Matrix]
    angle_deg: float
    markers: int
    residual_px: float


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


def _locate(frame: Frame, config: RigConfig) -> _Platter:
    """The platter's pose from the markers that agree with one plane."""
    camera = config.camera
    markers = find_markers(
        _linear(frame, np.ascontiguousarray(frame.pixels[..., 1])),
        config.platter,
        camera.focal_px / camera.distance_mm * config.platter.marker_side_mm,
    )
    known = config.platter.marker_corners_mm()[markers.ids]
    agreeing = _agreeing(known, markers.corners_px)
    if agreeing.sum() < FEWEST_MARKERS:
        raise ImageError(
            f"Only {agreeing.sum()} of the platter's markers can be seen and {FEWEST_MARKERS} are "
            "needed; uncover and clean them, and light them well."
        )
    flat = known[agreeing].reshape(-1, 2)
    pixels = markers.corners_px[agreeing].reshape(-1, 2)
    points = np.column_stack([flat, np.zeros(len(flat))])
    _, turn, shift = cv2.solvePnP(
        points, pixels, intrinsics(config.camera), None, flags=cv2.SOLVEPNP_IPPE
    )
    turn, shift = cv2.solvePnPRefineLM(points, pixels, intrinsics(config.camera), None, turn, shift)
    rotation = np.asarray(cv2.Rodrigues(turn)[0], dtype=float)
    pose = rotation, np.asarray(shift, dtype=float).ravel()
    on_table = camera_rotation(config.camera).T @ rotation
    angle = float(np.degrees(np.arctan2(on_table[1, 0], on_table[0, 0])))
    miss = project(plane_homography(config.camera, pose, 0.0), flat) - pixels
    residual = float(np.sqrt(np.mean(np.sum(miss**2, axis=1))))
    return _Platter(pose, angle, int(agreeing.sum()), residual)


def _agreeing(known_mm: Matrix, corners_px: Matrix) -> npt.NDArray[np.bool_]:
    """(n,) which markers lie, with all four corners, where one homography puts them."""
    if len(known_mm) < FEWEST_MARKERS:
        return np.ones(len(known_mm), dtype=bool)
    y_down = known_mm.reshape(-1, 2) * [1, -1]  # OpenCV's USAC rejects homographies that mirror
    _, inliers = cv2.findHomography(y_down, corners_px.reshape(-1, 2), cv2.USAC_MAGSAC, OUTLIER_PX)
    if inliers is None:
        return np.zeros(len(known_mm), dtype=bool)
    agreeing: npt.NDArray[np.bool_] = np.logical_and.reduce(inliers.reshape(-1, 4) > 0, axis=1)
    return agreeing


def _dark_pose(dark: Frame, lit: _Platter, config: RigConfig) -> tuple[Matrix, Matrix]:
    """A dark frame may be from before the table turned: where its ambient light shows the markers,
    they say where the sample was; where it does not, there is nothing to align.
    """
    try:
        return _locate(dark, config).pose
    except ImageError:
        return lit.pose


def _unwarp(
    frame: Frame,
    pose: tuple[Matrix, Matrix],
    config: RigConfig,
    thickness_mm: float,
    resolution: int,
) -> tuple[Image, npt.NDArray[np.bool_], npt.NDArray[np.bool_]]:
    """The linear image of the sample's surface, which of its pixels the sensor saw, which clipped."""
    to_pixels = plane_homography(config.camera, pose, thickness_mm) @ grid_to_plane(
        config.sample.side_mm, resolution
    )
    centres = np.stack(np.meshgrid(*[np.arange(resolution) + 0.5] * 2), axis=-1)
    seen_at = project(to_pixels, centres)
    limit = np.array([frame.pixels.shape[1], frame.pixels.shape[0]])
    inside = np.asarray((seen_at >= 0) & (seen_at <= limit))
    left, top = np.clip(np.floor(seen_at.min(axis=(0, 1))) - MARGIN_PX, 0, limit).astype(int)
    right, bottom = np.clip(np.ceil(seen_at.max(axis=(0, 1))) + MARGIN_PX, 0, limit).astype(int)
    if left >= right or top >= bottom:
        raise ImageError("The sample lies outside the camera's picture; point the camera at it.")
    pixels = frame.pixels[top:bottom, left:right]
    shift = np.array([[1.0, 0.0, left], [0.0, 1.0, top], [0.0, 0.0, 1.0]])
    to_grid = np.linalg.inv(to_pixels) @ shift
    image = warp(_linear(frame, pixels), to_grid, resolution, resolution)
    full = np.any(pixels >= (1 << frame.bit_depth) - 1, axis=-1).astype(np.float32)
    clipped = np.asarray(warp(full, to_grid, resolution, resolution) > 0)
    return image, inside[..., 0] & inside[..., 1], clipped


def _linear(frame: Frame, pixels: npt.NDArray[np.uint16]) -> Image:
    """Undo the camera's gamma: float32 in [0, 1]."""
    top = (1 << frame.bit_depth) - 1
    table = (np.arange(top + 1) / top) ** frame.gamma
    return table.astype(np.float32).take(pixels, mode="clip")
