"""The configured camera as a pinhole, and planes seen through it.

Pixel coordinates are continuous: the first pixel covers [0, 1], its centre is at 1/2.
"""

import math

import numpy as np
import numpy.typing as npt

from turnlight.config import CameraConfig, RigConfig

Matrix = npt.NDArray[np.float64]


def intrinsics(camera: CameraConfig) -> Matrix:
    """(3, 3) from camera coordinates (x right, y down, z forward) to pixels."""
    focal = camera.focal_px
    return np.array(
        [[focal, 0.0, camera.width_px / 2], [0.0, focal, camera.height_px / 2], [0.0, 0.0, 1.0]]
    )


def camera_rotation(camera: CameraConfig) -> Matrix:
    """(3, 3) from world to camera axes: looking at the origin, what is farther away is higher."""
    azimuth, polar = math.radians(camera.azimuth_deg), math.radians(camera.polar_deg)
    outward = np.array(
        [
            math.sin(polar) * math.cos(azimuth),
            math.sin(polar) * math.sin(azimuth),
            math.cos(polar),
        ]
    )
    right = np.array([-math.sin(azimuth), math.cos(azimuth), 0.0])
    return np.stack([right, np.cross(-outward, right), -outward])


def platter_pose(config: RigConfig, angle_deg: float) -> tuple[Matrix, Matrix]:
    """Rotation (3, 3) and translation (3,) in mm from the turned platter to the camera.

    The platter's frame is the table's with its origin on the platter's top, z up; a sample's
    surface is at z = its thickness.
    """
    turn = math.radians(angle_deg)
    cosine, sine = math.cos(turn), math.sin(turn)
    table = np.array([[cosine, -sine, 0.0], [sine, cosine, 0.0], [0.0, 0.0, 1.0]])
    to_camera = camera_rotation(config.camera)
    centre = config.camera_position_mm(0.0)
    return to_camera @ table, -to_camera @ centre


def plane_homography(camera: CameraConfig, pose: tuple[Matrix, Matrix], height_mm: float) -> Matrix:
    """(3, 3) from (x, y) in mm at `height_mm` above the platter to pixels."""
    rotation, translation = pose
    origin = translation + rotation[:, 2] * height_mm
    return intrinsics(camera) @ np.column_stack([rotation[:, 0], rotation[:, 1], origin])


def grid_to_plane(side_mm: float, resolution: int) -> Matrix:
    """(3, 3) from the pixels of a square image, row 0 at +y, to mm about its centre."""
    step = side_mm / resolution
    return np.array([[step, 0.0, -side_mm / 2], [0.0, -step, side_mm / 2], [0.0, 0.0, 1.0]])


def project(homography: Matrix, points: Matrix) -> Matrix:
    """(..., 2) points through a (3, 3) homography."""
    homogeneous = points @ homography[:, :2].T + homography[:, 2]
    result: Matrix = homogeneous[..., :2] / homogeneous[..., 2:]
    return result
