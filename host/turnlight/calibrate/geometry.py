"""Lens, camera pose, table axis and markers, from frames of a board that rides on the turning platter.

One bundle adjustment over all frames. The board leans, so that its plane differs from frame to frame, as
finding the lens needs it; that everything turns about one axis ties it, the markers and the scale
together.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
import numpy.typing as npt
from scipy.optimize import least_squares

from turnlight.calibration import Calibration, CameraPose, Lens, Table, triple
from turnlight.config import RigConfig
from turnlight.errors import CalibrationError
from turnlight.picture.charuco import SQUARES, Corners, corner_positions_mm
from turnlight.picture.pinhole import Lens as PinholeLens
from turnlight.picture.pinhole import Matrix, distort, lens, undistort
from turnlight.picture.platter import Platter

CORNER_PX = 0.1
"""How well a corner is found, to begin with."""
ANGLE_SIGMA_DEG = 0.03
CENTRE_SIGMA = 0.02
"""Of the principal point, in focal lengths."""
DISTORTION_SIGMA = np.array([0.5, 0.5, 0.01, 0.01, 0.1])
MARKER_SIGMA_MM = 1.0
FEWEST_VIEWS = 6
SOFT = 3.0
INDEPENDENT = 0.25
"""Share of the corners whose errors count as independent: neighbours err alike."""


@dataclass(frozen=True)
class View:
    """What one frame shows. angle_deg: as the controller has it."""

    angle_deg: float
    platter: Platter
    board: Corners


@dataclass(frozen=True)
class Adjusted:
    """The calibration with lens, camera and table replaced, and how well it fits.

    residual_px: root mean square; angle_error_deg: of the controller's angles.
    """

    calibration: Calibration
    residual_px: float
    angle_error_deg: float
    views: int


def adjust(config: RigConfig, views: Sequence[View], square_mm: float) -> Adjusted:
    """Fit geometry to the views. Raises CalibrationError when they are too few."""
    usable = [view for view in views if len(view.board.ids)]
    if len(usable) < FEWEST_VIEWS:
        raise CalibrationError(
            f"The board's corners and the markers were found in {len(usable)} of {len(views)} frames "
            f"and {FEWEST_VIEWS} are needed; lean the board so that the camera sees all of it, and "
            "light it evenly."
        )
    problem = _Problem(config, usable, square_mm)
    fit = least_squares(problem.softened, problem.start, method="lm", x_scale="jac", ftol=1e-6)
    return problem.adjusted(fit.x, fit.jac)


class _Problem:
    """The bundle's parameters, in this order, and what they predict.

    lens: focal lengths, centre, distortion (9); camera: rotation from its start, position (6); table:
    axis, tilt (4); board: rotation, position on the platter (6); angles after the first; markers'
    corners, in an orthonormal basis without shift and rotation, which are the platter's own.
    """

    def __init__(self, config: RigConfig, views: Sequence[View], square_mm: float) -> None:
        self._config = config
        self._views = views
        self._reference_mm = config.sample.reference_thickness_mm
        self._nominal = config.platter.marker_corners_mm().reshape(-1, 2)
        self._board = np.column_stack(
            [corner_positions_mm(square_mm), np.zeros((SQUARES - 1) ** 2)]
        )
        self._basis = _shape_basis(self._nominal)
        self._reported = np.array([view.angle_deg for view in views])
        first = views[0]
        self._camera_start, position, board = self._begin(first)
        self._lens_start = np.concatenate(
            [lens(config).matrix[[0, 1, 0, 1], [0, 1, 2, 2]], lens(config).distortion]
        )
        corners = config.marker_corners_mm().reshape(-1, 2) - self._nominal
        self.start = np.concatenate(
            [
                self._lens_start,
                np.zeros(3),
                position,
                np.zeros(4),
                board,
                self._reported[1:],
                self._basis.T @ corners.ravel(),
            ]
        )
        self._seen = np.concatenate(
            [
                np.concatenate([v.platter.corners_px.reshape(-1, 2), v.board.corners_px])
                for v in views
            ]
        )
        per_view = len(self._nominal) + len(self._board)
        self._which = np.concatenate(
            [
                i * per_view
                + np.concatenate(
                    [
                        (v.platter.ids[:, None] * 4 + np.arange(4)).ravel(),
                        len(self._nominal) + v.board.ids,
                    ]
                )
                for i, v in enumerate(views)
            ]
        )

    def residuals(self, x: Matrix) -> Matrix:
        """Measured, in units of CORNER_PX, then how far each weak prior is left, in its own sigma."""
        misses = (self._project(x) - self._seen) / CORNER_PX
        return np.concatenate([misses.ravel(), self._priors(x)])

    def softened(self, x: Matrix) -> Matrix:
        """Residuals of which large ones count as their root: a corner that was misread pulls little."""
        misses = self.residuals(x)
        soft = 2 * (np.sqrt(1 + (misses / SOFT) ** 2) - 1)
        return np.asarray(np.copysign(SOFT * np.sqrt(soft), misses))

    def adjusted(self, x: Matrix, jacobian: Matrix) -> Adjusted:
        misses = self._project(x) - self._seen
        residual = float(np.sqrt(np.mean(np.sum(misses**2, axis=1))))
        spread = np.sqrt(np.mean(misses**2) / INDEPENDENT) / CORNER_PX
        sigma = np.sqrt(np.diag(np.linalg.pinv(jacobian.T @ jacobian))) * spread
        angles = x[25 : 24 + len(self._views)]
        off = (angles - self._reported[1:] + 180) % 360 - 180
        before = self._config.geometry
        changed = {
            "lens": self._lens(x, sigma, before.lens),
            "camera": self._camera(x, sigma),
            "table": self._table(x, sigma),
        }
        return Adjusted(
            before.model_copy(update=changed),
            residual,
            float(np.sqrt(np.mean(off**2))),
            len(self._views),
        )

    def _project(self, x: Matrix, shift_mm: Matrix | None = None) -> Matrix:
        """(n, 2) where the corners that were seen should be. shift_mm: (views, 3) of the platter."""
        rotation = _rotation(x[9:12]) @ self._camera_start
        position = x[12:15]
        to_axis = _tilt(x[17:19])
        corners = self._corners(x) - x[15:17]
        flat = np.column_stack([corners, np.zeros(len(corners))])
        markers = flat @ to_axis.T - [0, 0, self._reference_mm]
        board = self._board @ _rotation(x[19:22]).T + x[22:25]
        points = np.concatenate([markers, board])
        turned = np.stack([points @ _turn(a).T for a in self._angles(x)])
        if shift_mm is not None:
            turned = turned + shift_mm[:, None]
        seen = (turned.reshape(-1, 3)[self._which] - position) @ rotation.T
        return distort(_pinhole(x), _divided(seen) * x[0:2] + x[2:4])

    def _corners(self, x: Matrix) -> Matrix:
        shape = self._basis @ x[24 + len(self._views) :]
        return self._nominal + shape.reshape(-1, 2)

    def _angles(self, x: Matrix) -> Matrix:
        return np.concatenate([self._reported[:1], x[25 : 24 + len(self._views)]])

    def _priors(self, x: Matrix) -> Matrix:
        focal = self._lens_start[0]
        return np.concatenate(
            [
                (x[2:4] - self._lens_start[2:4]) / (CENTRE_SIGMA * focal),
                (x[4:9] - self._lens_start[4:9]) / DISTORTION_SIGMA,
                (self._angles(x)[1:] - self._reported[1:]) / ANGLE_SIGMA_DEG,
                x[24 + len(self._views) :] / MARKER_SIGMA_MM,
            ]
        )

    def _begin(self, first: View) -> tuple[Matrix, Matrix, Matrix]:
        """Camera rotation, position, and the board's place on the platter, from one view."""
        rotation, translation = first.platter.pose
        rotation = rotation @ _turn(first.angle_deg).T
        translation = translation + rotation[:, 2] * self._reference_mm
        known = self._board[first.board.ids]
        ideal = undistort(lens(self._config), first.board.corners_px)
        _, turn, shift = cv2.solvePnP(
            known, ideal, lens(self._config).matrix, None, flags=cv2.SOLVEPNP_IPPE
        )
        to_table = _turn(first.angle_deg).T @ rotation.T
        board = to_table @ _rotation(np.ravel(np.asarray(turn, dtype=float)))
        place = to_table @ (np.ravel(np.asarray(shift, dtype=float)) - translation)
        return rotation, -rotation.T @ translation, np.concatenate([_vector(board), place])

    def _lens(self, x: Matrix, sigma: Matrix, before: Lens) -> Lens:
        camera = self._config.camera
        return Lens(
            width_px=camera.width_px,
            height_px=camera.height_px,
            focal_px=_pair(x[0:2]),
            focal_sigma_px=_pair(sigma[0:2]),
            centre_px=_pair(x[2:4]),
            centre_sigma_px=_pair(sigma[2:4]),
            distortion=tuple(x[4:9].tolist()),
            distortion_sigma=tuple(sigma[4:9].tolist()),
            vignetting=before.vignetting,
            vignetting_sigma=before.vignetting_sigma,
        )

    def _camera(self, x: Matrix, sigma: Matrix) -> CameraPose:
        rotation = _rotation(x[9:12]) @ self._camera_start
        return CameraPose(
            position_mm=triple(x[12:15]),
            position_sigma_mm=triple(sigma[12:15]),
            rotation_deg=triple(np.degrees(_vector(rotation))),
            rotation_sigma_deg=triple(np.degrees(sigma[9:12])),
        )

    def _table(self, x: Matrix, sigma: Matrix) -> Table:
        shape_sigma = np.sqrt(self._basis**2 @ sigma[24 + len(self._views) :] ** 2)
        corners: Any = self._corners(x).reshape(-1, 4, 2).tolist()
        return Table(
            axis_mm=_pair(x[15:17]),
            axis_sigma_mm=_pair(sigma[15:17]),
            tilt_deg=_pair(np.degrees(x[17:19])),
            tilt_sigma_deg=_pair(np.degrees(sigma[17:19])),
            radial_runout_mm=self._runout_mm(x),
            marker_corners_mm=corners,
            marker_sigma_mm=float(np.sqrt(np.mean(shape_sigma**2))),
        )

    def _runout_mm(self, x: Matrix) -> float:
        """The largest shift of a single frame's platter that its corners ask for."""
        none = np.zeros((len(self._views), 3))
        there = self._project(x)
        steps = [self._project(x, none + np.eye(3)[axis]) - there for axis in (0, 1)]
        misses = self._seen - there
        per_view = len(self._nominal) + len(self._board)
        shifts = []
        for i in range(len(self._views)):
            mine = self._which // per_view == i
            slopes = np.stack([step[mine].ravel() for step in steps], axis=1)
            shifts.append(np.linalg.lstsq(slopes, misses[mine].ravel(), rcond=None)[0])
        return float(np.linalg.norm(shifts, axis=1).max())


def _shape_basis(nominal: Matrix) -> Matrix:
    """(2n, 2n - 3) orthonormal: every displacement of n points but shifts and a rotation."""
    count = len(nominal)
    rigid = np.zeros((2 * count, 3))
    rigid[0::2, 0] = rigid[1::2, 1] = 1
    rigid[0::2, 2], rigid[1::2, 2] = -nominal[:, 1], nominal[:, 0]
    whole, _ = np.linalg.qr(np.concatenate([rigid, np.eye(2 * count)], axis=1))
    return np.asarray(whole[:, 3:])


def _pinhole(x: Matrix) -> PinholeLens:
    matrix = np.array([[x[0], 0.0, x[2]], [0.0, x[1], x[3]], [0.0, 0.0, 1.0]])
    return PinholeLens(matrix, np.asarray(x[4:9], dtype=float))


def _divided(points: Matrix) -> Matrix:
    result: Matrix = points[..., :2] / points[..., 2:]
    return result


def _tilt(slopes: Matrix) -> Matrix:
    return _rotation(np.array([slopes[1], -slopes[0], 0.0]))


def _turn(angle_deg: float) -> Matrix:
    return _rotation(np.array([0.0, 0.0, np.radians(angle_deg)]))


def _rotation(vector: Matrix) -> Matrix:
    return np.asarray(cv2.Rodrigues(np.asarray(vector, dtype=float))[0], dtype=float)


def _vector(rotation: Matrix) -> Matrix:
    return np.asarray(cv2.Rodrigues(rotation)[0], dtype=float).ravel()


def _pair(values: npt.ArrayLike) -> tuple[float, float]:
    first, second = np.ravel(np.asarray(values, dtype=float)).tolist()
    return first, second
