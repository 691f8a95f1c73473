"""Where the LEDs are, from their highlights on a glossy ball that rides on the turning platter.

A highlight's place on the ball gives the direction in which the LED is seen in it; the ball's places
around the turn triangulate. Ball and LEDs are fitted together.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares

from turnlight.calibrate.bench import green
from turnlight.calibration import Calibration, triple
from turnlight.config import RigConfig
from turnlight.errors import CalibrationError
from turnlight.frame import Frame
from turnlight.picture.pinhole import Matrix, camera_rotation, distort, lens
from turnlight.picture.warp import Image

HIGHLIGHT_PX = 0.3
"""How well a highlight's centre is found, to begin with."""
PLACE_SIGMA_MM = 5.0
FEWEST_SIGHTS = 2
CONTRAST = 4.0
"""A highlight is at least so many times brighter than its surroundings."""
ROUNDS = 12


@dataclass(frozen=True)
class Sight:
    """The highlight of one LED on the ball, with the table at angle_deg; place_px: (2,) on the sensor."""

    led: int
    angle_deg: float
    place_px: Matrix


@dataclass(frozen=True)
class Placed:
    """The calibration with the LEDs' positions replaced; ball_mm: where the ball was found to lie."""

    calibration: Calibration
    residual_px: float
    ball_mm: tuple[float, float]


def find_highlight(
    lit: Frame, dark: Frame, config: RigConfig, angle_deg: float, ball: tuple[Matrix, float]
) -> Matrix | None:
    """(2,) centre of the highlight on a ball of (centre (3,) over the platter, radius); None if none."""
    centre, radius = ball
    rig_lens = lens(config)
    world = _on_table(config, centre, angle_deg)
    at = camera_rotation(config) @ (world - _camera(config))
    middle = distort(rig_lens, (rig_lens.matrix @ at / at[2])[:2])
    reach = radius * rig_lens.matrix[0, 0] / at[2]
    left, top = np.maximum(np.floor(middle - reach), 0).astype(int)
    right, bottom = np.ceil(middle + reach).astype(int)
    light = (green(lit) - green(dark))[top:bottom, left:right]
    if light.size == 0:
        return None
    place = _blob_centre(light)
    return None if place is None else np.add(place, [left, top])


def place_leds(
    config: RigConfig, sights: Sequence[Sight], ball_mm: tuple[float, float], diameter_mm: float
) -> Placed:
    """Fit. ball_mm: roughly where the ball touches the platter. Raises CalibrationError."""
    _check(config, sights)
    problem = _Problem(config, sights, ball_mm, diameter_mm / 2)
    fit = least_squares(
        problem.residuals, problem.start, jac_sparsity=problem.sparsity, loss="soft_l1",
        f_scale=3.0, x_scale="jac",
    )  # fmt: skip
    return problem.placed(fit.x, fit.jac.toarray())


class _Problem:
    """Parameters: the ball's x, y on the platter, then x, y, z of every LED."""

    def __init__(
        self,
        config: RigConfig,
        sights: Sequence[Sight],
        ball_mm: tuple[float, float],
        radius_mm: float,
    ) -> None:
        self._config = config
        self._radius = radius_mm
        self._leds = np.array([s.led for s in sights])
        self._seen = np.array([s.place_px for s in sights])
        self._angles = np.array([s.angle_deg for s in sights])
        self._begin = np.array(ball_mm)
        self._camera = _camera(config)
        self._rotation = camera_rotation(config)
        self._lens = lens(config)
        self.start = np.concatenate([ball_mm, config.led_positions_mm(self._reference).ravel()])
        rows = np.arange(2 * len(sights))
        self.sparsity = np.zeros((2 * len(sights) + 2, len(self.start)), dtype=int)
        self.sparsity[:, :2] = 1
        for axis in range(3):
            self.sparsity[rows, 2 + 3 * np.repeat(self._leds, 2) + axis] = 1

    @property
    def _reference(self) -> float:
        return self._config.sample.reference_thickness_mm

    def residuals(self, x: Matrix) -> Matrix:
        misses = (self._predict(x) - self._seen) / HIGHLIGHT_PX
        return np.concatenate([misses.ravel(), (x[:2] - self._begin) / PLACE_SIGMA_MM])

    def placed(self, x: Matrix, jacobian: Matrix) -> Placed:
        misses = self._predict(x) - self._seen
        spread = np.sqrt(np.mean(misses**2)) / HIGHLIGHT_PX
        sigma = np.sqrt(np.diag(np.linalg.pinv(jacobian.T @ jacobian))) * spread
        positions, own = x[2:].reshape(-1, 3), sigma[2:].reshape(-1, 3)
        shared = self._shared_sigma_mm(positions)
        before = self._config.geometry
        leds = tuple(
            led.model_copy(
                update={
                    "position_mm": triple(positions[i]),
                    "position_sigma_mm": triple(np.hypot(own[i], shared[i])),
                }
            )
            for i, led in enumerate(before.led)
        )
        residual = float(np.sqrt(np.mean(np.sum(misses**2, axis=1))))
        ball = float(x[0]), float(x[1])
        return Placed(before.model_copy(update={"led": leds}), residual, ball)

    def _predict(self, x: Matrix) -> Matrix:
        """(n, 2) pixels of the highlights: where the ball's normal halves the angle to LED and camera."""
        leds = x[2:].reshape(-1, 3)[self._leds]
        on_platter = np.array([x[0], x[1], self._radius])
        centres = np.stack([_on_table(self._config, on_platter, a) for a in self._angles])
        normal = _unit(_unit(leds - centres) + _unit(self._camera - centres))
        for _ in range(ROUNDS):
            points = centres + self._radius * normal
            normal = _unit(_unit(leds - points) + _unit(self._camera - points))
        seen = (centres + self._radius * normal - self._camera) @ self._rotation.T
        matrix = self._lens.matrix
        ideal = seen[:, :2] / seen[:, 2:] * matrix[[0, 1], [0, 1]] + matrix[:2, 2]
        return distort(self._lens, ideal)

    def _shared_sigma_mm(self, positions: Matrix) -> Matrix:
        """What the camera's uncertain pose adds."""
        camera = self._config.geometry.camera
        turned = np.radians(np.linalg.norm(camera.rotation_sigma_deg)) * np.linalg.norm(
            positions, axis=1, keepdims=True
        )
        return np.broadcast_to(turned, positions.shape)


def highlights_missing(config: RigConfig, sights: Sequence[Sight]) -> Mapping[int, int]:
    """LEDs whose highlight was seen at too few angles, and at how many."""
    seen = np.bincount([s.led for s in sights], minlength=config.led_count)
    return {led: int(n) for led, n in enumerate(seen) if n < FEWEST_SIGHTS}


def _check(config: RigConfig, sights: Sequence[Sight]) -> None:
    missing = highlights_missing(config, sights)
    if missing:
        raise CalibrationError(
            f"The highlight of LED {', '.join(map(str, missing))} was not seen on the ball at "
            f"{FEWEST_SIGHTS} angles or more; check that they light, and that the ball is glossy "
            "and lies where it should."
        )


def _blob_centre(light: Image) -> Matrix | None:
    """(2,) x, y of the brightest spot, weighed by what of it exceeds half of its peak."""
    peak = float(light.max())
    if peak < CONTRAST * max(float(np.median(light)), 1e-3):
        return None
    row, column = np.unravel_index(int(light.argmax()), light.shape)
    reach = max(3, round(0.12 * min(light.shape)))
    top, left = max(int(row) - reach, 0), max(int(column) - reach, 0)
    near = light[top : row + reach + 1, left : column + reach + 1]
    weight = np.maximum(near - 0.3 * peak, 0)
    rows, columns = np.mgrid[: near.shape[0], : near.shape[1]] + 0.5
    total = weight.sum()
    return np.array([(weight * columns).sum() / total + left, (weight * rows).sum() / total + top])


def _on_table(config: RigConfig, on_platter: Matrix, angle_deg: float) -> Matrix:
    """A point over the turned platter in the world of the reference sample."""
    axis = np.array([*config.geometry.table.axis_mm, 0.0])
    return config.platter_rotation(angle_deg) @ (on_platter - axis) + config.lift_mm(0.0)


def _camera(config: RigConfig) -> Matrix:
    return np.array(config.geometry.camera.position_mm)


def _unit(vectors: Matrix) -> Matrix:
    result: Matrix = vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)
    return result
