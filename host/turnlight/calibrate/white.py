"""Power, lobe and colour of each LED, and the lens's vignetting, from a white board of known reflectance."""

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from scipy.optimize import least_squares

from turnlight.calibration import Calibration, Led, triple
from turnlight.config import RigConfig
from turnlight.errors import CalibrationError
from turnlight.frame import Frame
from turnlight.picture.pinhole import Matrix, Pose, distort, lens, plane_homography, project
from turnlight.picture.rectify import rectify

GRID = 12
"""Points per side of the board at which light is compared."""
OVERSAMPLING = 8
EDGE = 1
"""Points left out along the board's edges."""
FAINTEST = 0.02
"""Of full scale; fainter readings are left out."""
AIM_SIGMA_MM, EXPONENT_SIGMA, VIGNETTING_SIGMA = 40.0, 0.4, 0.4
AIM_REACH_MM = 100.0
NOISE = 0.003
"""Relative, of a grid point's reading, to begin with."""
PER_LED = 4


@dataclass(frozen=True)
class Board:
    """The white board by one LED.

    reading: (n, 3) linear, dark subtracted, at 10 ms and gain 1, NaN where it cannot be used;
    points_mm: (n, 3) in the world of the reference sample; normal: (3,) the board's; radius: (n,) on
    the sensor, 1 in its corners.
    """

    led: int
    reading: Matrix
    points_mm: Matrix
    normal: Matrix
    radius: Matrix


@dataclass(frozen=True)
class Lit:
    """The calibration with lights and vignetting replaced; residual: relative, of the worst LED."""

    calibration: Calibration
    residual: float


def bare(config: RigConfig) -> RigConfig:
    """The rig with every correction of light and colour undone."""
    calibration = config.geometry
    leds = tuple(
        led.model_copy(update={"colour": (1, 1, 1), "aim_mm": (0, 0), "exponent": 1})
        for led in calibration.led
    )
    plain = calibration.lens.model_copy(update={"vignetting": (0, 0)})
    undone = {"led": leds, "lens": plain, "colour": None}
    return config.calibrated(calibration.model_copy(update=undone))


def read_board(
    frame: Frame, dark: Frame, config: RigConfig, led: int, thickness_mm: float
) -> Board:
    """What the board reads by this LED. config: `bare`. Raises ImageError without markers."""
    seen = rectify(frame, dark, config, thickness_mm, GRID * OVERSAMPLING)
    size = (GRID, GRID)
    reading = cv2.resize(seen.picture.image, size, interpolation=cv2.INTER_AREA).astype(float)
    clipped = seen.picture.clipped.astype(np.float32)
    reading[cv2.resize(clipped, size, interpolation=cv2.INTER_AREA) > 0] = np.nan
    reading[reading[..., 1] < FAINTEST] = np.nan
    inside = np.s_[EDGE:-EDGE, EDGE:-EDGE]
    grid = ((np.arange(GRID) + 0.5) / GRID - 0.5) * config.sample.side_mm
    on_board = np.stack(np.meshgrid(grid, -grid), axis=-1)[inside].reshape(-1, 2)
    return Board(
        led,
        reading[inside].reshape(-1, 3) * seen.picture.gain,
        _in_world(config, on_board, thickness_mm, seen.measured_angle_deg),
        config.platter_rotation(seen.measured_angle_deg)[:, 2],
        _sensor_radius(config, seen.pose, on_board, thickness_mm),
    )


def fit_lights(config: RigConfig, boards: Sequence[Board], reflectance: float) -> Lit:
    """Fit all LEDs and the vignetting that they share. Raises CalibrationError."""
    dim = sorted(
        {b.led for b in boards if np.isfinite(b.reading[:, 1]).mean() < 0.5}
        | set(range(config.led_count)) - {b.led for b in boards}
    )
    if dim:
        raise CalibrationError(
            f"The white board is too dark or too bright by LED {', '.join(map(str, dim))}; check "
            "that it lights, and that the board lies flat and unshaded."
        )
    problem = _Problem(config, boards, reflectance)
    fit = least_squares(
        problem.residuals, problem.start, jac_sparsity=problem.sparsity, bounds=problem.bounds,
        x_scale="jac",
    )  # fmt: skip
    return problem.lit(fit.x, fit.jac.toarray())


class _Problem:
    """Parameters: vignetting a, b; then log power in green, aim x, y, exponent of every LED."""

    def __init__(self, config: RigConfig, boards: Sequence[Board], reflectance: float) -> None:
        self._config = config
        self._boards = boards
        self._reflectance = reflectance
        leds = config.geometry.led
        self._positions = np.array([led.position_mm for led in leds])
        each = [(np.log(led.power), 0.0, 0.0, 1.0) for led in leds]
        self.start = np.concatenate([[0.0, 0.0], np.ravel(each)])
        reach = np.array([3.0, AIM_REACH_MM, AIM_REACH_MM, 0.7])
        limits = np.concatenate([[1.0, 1.0], np.tile(reach, len(leds))])
        self.bounds = self.start - limits, self.start + limits
        self._known = [np.isfinite(b.reading[:, 1]) for b in boards]
        counts = [int(known.sum()) for known in self._known]
        self._rows = np.concatenate([[0], np.cumsum(counts)])
        total = int(self._rows[-1])
        self.sparsity = np.zeros((total + len(self.start), len(self.start)), dtype=int)
        self.sparsity[:total, :2] = 1
        for board, start, end in zip(boards, self._rows[:-1], self._rows[1:], strict=True):
            own = 2 + PER_LED * board.led
            self.sparsity[start:end, own : own + PER_LED] = 1
        self.sparsity[total:] = np.eye(len(self.start), dtype=int)

    def residuals(self, x: Matrix) -> Matrix:
        misses = [self._miss(x, i) / NOISE for i in range(len(self._boards))]
        led_prior = np.array([0, 1 / AIM_SIGMA_MM, 1 / AIM_SIGMA_MM, 1 / EXPONENT_SIGMA])
        priors = (x - self.start) * np.concatenate(
            [np.full(2, 1 / VIGNETTING_SIGMA), np.tile(led_prior, len(self._positions))]
        )
        return np.concatenate([*misses, priors])

    def lit(self, x: Matrix, jacobian: Matrix) -> Lit:
        misses = [self._miss(x, i) for i in range(len(self._boards))]
        spread = np.sqrt(np.mean(np.concatenate(misses) ** 2)) / NOISE
        sigma = np.sqrt(np.diag(np.linalg.pinv(jacobian.T @ jacobian))) * max(spread, 1.0)
        before = self._config.geometry
        leds = tuple(self._led(i, led, x, sigma, misses) for i, led in enumerate(before.led))
        vignetting = {
            "vignetting": tuple(x[:2].tolist()),
            "vignetting_sigma": tuple(sigma[:2].tolist()),
        }
        changed = {"led": leds, "lens": before.lens.model_copy(update=vignetting)}
        worst = max(led.flat_field_residual for led in leds)
        return Lit(before.model_copy(update=changed), worst)

    def _led(self, number: int, led: Led, x: Matrix, sigma: Matrix, misses: list[Matrix]) -> Led:
        own = slice(2 + PER_LED * number, 2 + PER_LED * (number + 1))
        log_power, aim_x, aim_y, exponent = x[own].tolist()
        power_sigma, *aim_sigma, exponent_sigma = sigma[own].tolist()
        mine = [i for i, board in enumerate(self._boards) if board.led == number]
        readings = np.concatenate([self._boards[i].reading[self._known[i]] for i in mine])
        ratios = readings / readings[:, 1:2]
        left = np.concatenate([misses[i] for i in mine])
        relative_sigma = np.hypot(power_sigma, _slant_sigma(led))
        return led.model_copy(
            update={
                "power": float(np.exp(log_power)),
                "power_sigma": float(np.exp(log_power) * relative_sigma),
                "aim_mm": (aim_x, aim_y),
                "aim_sigma_mm": tuple(aim_sigma),
                "exponent": exponent,
                "exponent_sigma": exponent_sigma,
                "colour": triple(np.median(ratios, axis=0)),
                "colour_sigma": triple(ratios.std(axis=0) / np.sqrt(len(ratios))),
                "flat_field_residual": float(np.sqrt(np.mean(left**2))),
            }
        )

    def _miss(self, x: Matrix, index: int) -> Matrix:
        """Relative, of one board's usable points."""
        board, known = self._boards[index], self._known[index]
        log_power, aim_x, aim_y, exponent = x[2 + PER_LED * board.led :][:PER_LED]
        position = self._positions[board.led]
        aim = np.array([aim_x, aim_y, 0.0])
        points = board.points_mm[known]
        there = _irradiance(position, aim, exponent, points)
        white = there / _irradiance(position, aim, exponent, np.zeros(3))
        toward = position - points
        cosine = toward @ board.normal / np.linalg.norm(toward, axis=-1)
        square = board.radius[known] ** 2
        vignetting = 1 + square * (x[0] + square * x[1])
        expected = np.exp(log_power) * self._reflectance * cosine * white * vignetting
        result: Matrix = np.log(board.reading[known, 1] / expected)
        return result


def _slant_sigma(led: Led) -> float:
    """What the LED's uncertain direction adds to its power, relative: the board is seen aslant."""
    x, y, z = led.position_mm
    off = np.linalg.norm(led.position_sigma_mm) / np.linalg.norm(led.position_mm)
    return float(np.hypot(x, y) / z * off)


def _irradiance(position: Matrix, aim: Matrix, exponent: float, points: Matrix) -> Matrix:
    axis, offset = position - aim, position - points
    distance = np.linalg.norm(offset, axis=-1)
    lobe = offset @ axis / (distance * np.linalg.norm(axis))
    result: Matrix = np.maximum(lobe, 1e-3) ** exponent / distance**2
    return result


def _in_world(config: RigConfig, on_board: Matrix, thickness_mm: float, angle_deg: float) -> Matrix:
    """(n, 3) points of the board's surface in the world of the reference sample."""
    above = np.column_stack([on_board, np.full(len(on_board), thickness_mm)])
    axis = [*config.geometry.table.axis_mm, 0.0]
    turned: Matrix = (above - axis) @ config.platter_rotation(angle_deg).T
    return turned + config.lift_mm(0.0)


def _sensor_radius(config: RigConfig, pose: Pose, on_board: Matrix, thickness_mm: float) -> Matrix:
    measured, camera = config.geometry.lens, config.camera
    size = np.array([camera.width_px, camera.height_px])
    centre = np.divide(measured.centre_px, (measured.width_px, measured.height_px)) * size
    seen = distort(lens(config), project(plane_homography(config, pose, thickness_mm), on_board))
    return np.asarray(np.linalg.norm(seen - centre, axis=1) / np.linalg.norm(size / 2))
