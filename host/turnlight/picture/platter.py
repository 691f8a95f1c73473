"""Where a frame shows the platter, by its markers."""

from dataclasses import dataclass
from functools import partial

import cv2
import numpy as np
import numpy.typing as npt

from turnlight.config import RigConfig
from turnlight.errors import ImageError
from turnlight.frame import Frame
from turnlight.picture.markers import find_markers
from turnlight.picture.pinhole import (
    Matrix,
    Pose,
    camera_rotation,
    lens,
    plane_homography,
    project,
    undistort,
)
from turnlight.picture.radiometry import linear

FEWEST_MARKERS = 3
OUTLIER_PX = 2.0


@dataclass(frozen=True)
class Platter:
    """The platter in one frame.

    pose: as `pinhole.platter_pose` has it. angle_deg: turn about the world's z axis, in [-180, 180).
    ids, corners_px: the markers that agree with it, (n,) and (n, 4, 2) on the sensor. residual_px:
    root mean square distance of their corners from where they should be.
    """

    pose: Pose
    angle_deg: float
    ids: npt.NDArray[np.int64]
    corners_px: Matrix
    residual_px: float


def locate(frame: Frame, config: RigConfig) -> Platter:
    """The platter's pose from the markers that agree with one plane.

    Raises ImageError when too few do.
    """
    camera = config.camera
    green = np.asarray(cv2.extractChannel(frame.pixels, 1), np.uint16)
    marker_px = camera.focal_px / camera.distance_mm * config.platter.marker_side_mm
    markers = find_markers(green, config.platter, marker_px, partial(linear, frame))
    rig_lens = lens(config)
    known = config.marker_corners_mm()[markers.ids]
    ideal_px = undistort(rig_lens, markers.corners_px)
    agreeing = _agreeing(known, ideal_px)
    if agreeing.sum() < FEWEST_MARKERS:
        raise ImageError(
            f"Only {agreeing.sum()} of the platter's markers can be seen and {FEWEST_MARKERS} are "
            "needed; uncover and clean them, and light them well."
        )
    flat = known[agreeing].reshape(-1, 2)
    pixels = ideal_px[agreeing].reshape(-1, 2)
    points = np.column_stack([flat, np.zeros(len(flat))])
    _, turn, shift = cv2.solvePnP(points, pixels, rig_lens.matrix, None, flags=cv2.SOLVEPNP_IPPE)
    turn, shift = cv2.solvePnPRefineLM(points, pixels, rig_lens.matrix, None, turn, shift)
    rotation = np.asarray(cv2.Rodrigues(turn)[0], dtype=float)
    pose = rotation, np.asarray(shift, dtype=float).ravel()
    on_table = camera_rotation(config).T @ rotation
    angle = float(np.degrees(np.arctan2(on_table[1, 0], on_table[0, 0])))
    miss = project(plane_homography(config, pose, 0.0), flat) - pixels
    residual = float(np.sqrt(np.mean(np.sum(miss**2, axis=1))))
    return Platter(pose, angle, markers.ids[agreeing], markers.corners_px[agreeing], residual)


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
