"""The camera as a pinhole with a distorting lens, and planes seen through it.

Pixel coordinates are continuous: the first pixel covers [0, 1], its centre is at 1/2. Homographies lead
to the ideal pixels of the pinhole alone; `distort` leads from there to the sensor's.
"""

from dataclasses import dataclass

import cv2
import numpy as np
import numpy.typing as npt

from turnlight.config import RigConfig

Matrix = npt.NDArray[np.floating]
Pose = tuple[Matrix, Matrix]
"""Rotation (3, 3) and translation (3,) in mm, to the camera's axes: x right, y down, z forward."""
UNDISTORT_STEPS = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 40, 1e-9)


@dataclass(frozen=True)
class Lens:
    """matrix: (3, 3) from camera coordinates to ideal pixels; distortion: (5,) k1, k2, p1, p2, k3."""

    matrix: Matrix
    distortion: Matrix

    @property
    def is_ideal(self) -> bool:
        return not self.distortion.any()


def lens(config: RigConfig) -> Lens:
    """The rig's lens, at the resolution that the rig is used with."""
    measured, camera = config.geometry.lens, config.camera
    scale = camera.width_px / measured.width_px, camera.height_px / measured.height_px
    focal, centre = np.multiply(measured.focal_px, scale), np.multiply(measured.centre_px, scale)
    matrix = np.array([[focal[0], 0.0, centre[0]], [0.0, focal[1], centre[1]], [0.0, 0.0, 1.0]])
    return Lens(matrix, np.array(measured.distortion))


def distort(lens: Lens, ideal_px: Matrix) -> Matrix:
    """(..., 2) ideal pixels to the sensor's."""
    if lens.is_ideal:
        return ideal_px
    focal, centre = lens.matrix[[0, 1], [0, 1]], lens.matrix[:2, 2]
    k1, k2, p1, p2, k3 = lens.distortion
    straight = (ideal_px - centre) / focal
    x, y = straight[..., 0], straight[..., 1]
    square = x * x + y * y
    radial = 1 + square * (k1 + square * (k2 + square * k3))
    bent = np.stack(
        [
            x * radial + 2 * p1 * x * y + p2 * (square + 2 * x * x),
            y * radial + p1 * (square + 2 * y * y) + 2 * p2 * x * y,
        ],
        axis=-1,
    )
    result: Matrix = bent * focal + centre
    return result


def undistort(lens: Lens, sensor_px: Matrix) -> Matrix:
    """(..., 2) the sensor's pixels to ideal ones."""
    if lens.is_ideal:
        return sensor_px
    points = np.ascontiguousarray(sensor_px, dtype=float).reshape(-1, 1, 2)
    ideal = cv2.undistortPoints(
        points, lens.matrix, lens.distortion, None, None, lens.matrix, UNDISTORT_STEPS
    )
    return np.asarray(ideal, dtype=float).reshape(sensor_px.shape)


def camera_rotation(config: RigConfig) -> Matrix:
    """(3, 3) from world to camera axes."""
    vector = np.radians(config.geometry.camera.rotation_deg)
    return np.asarray(cv2.Rodrigues(vector)[0], dtype=float)


def platter_pose(config: RigConfig, angle_deg: float) -> Pose:
    """Of the platter turned by angle_deg: its markers' frame with the origin on its top, z up.

    A sample's surface is at z = its thickness.
    """
    to_camera = camera_rotation(config)
    to_world = config.platter_rotation(angle_deg)
    origin = -to_world @ [*config.geometry.table.axis_mm, 0.0]
    return to_camera @ to_world, to_camera @ (origin - config.camera_position_mm(0.0))


def plane_homography(config: RigConfig, pose: Pose, height_mm: float) -> Matrix:
    """(3, 3) from (x, y) in mm at `height_mm` above the platter to ideal pixels."""
    rotation, translation = pose
    origin = translation + rotation[:, 2] * height_mm
    return lens(config).matrix @ np.column_stack([rotation[:, 0], rotation[:, 1], origin])


def grid_to_plane(side_mm: float, resolution: int) -> Matrix:
    """(3, 3) from the pixels of a square image, row 0 at +y, to mm about its centre."""
    step = side_mm / resolution
    return np.array([[step, 0.0, -side_mm / 2], [0.0, -step, side_mm / 2], [0.0, 0.0, 1.0]])


def project(homography: Matrix, points: Matrix) -> Matrix:
    """(..., 2) points through a (3, 3) homography."""
    homogeneous = points @ homography[:, :2].T + homography[:, 2]
    result: Matrix = homogeneous[..., :2] / homogeneous[..., 2:]
    return result
