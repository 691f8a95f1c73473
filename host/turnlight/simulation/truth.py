"""A simulated rig whose truth differs from its configuration: what the simulation images, while the
software knows only the configuration or a calibration.
"""

from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np

from turnlight.calibration import CameraPose, Colour, Dark, Led, Lens, Table, triple
from turnlight.config import RigConfig, Vector
from turnlight.simulation import spectra


def perturbed(
    config: RigConfig,
    seed: int,
    *,
    led_direction_deg: float = 1.0,
    power: float = 0.02,
    axis_mm: float = 0.1,
    camera_deg: float = 0.2,
) -> RigConfig:
    """The rig as it is, if `config` is a calibration of it with errors of these sizes.

    led_direction_deg, axis_mm, camera_deg: root mean square over draws of how far each LED stands off
    its direction, the axis off its place, and the camera off its pose (turned about the origin).
    power: standard deviation of each LED's log power. Always the same for the same seed.
    """
    random = np.random.default_rng(seed)
    truth = config.geometry
    leds = tuple(
        led.model_copy(
            update={
                "position_mm": triple(_swung(np.array(led.position_mm), led_direction_deg, random)),
                "power": led.power * float(np.exp(power * random.standard_normal())),
            }
        )
        for led in truth.led
    )
    shift = random.normal(0, axis_mm / np.sqrt(2), 2) + truth.table.axis_mm
    table = truth.table.model_copy(update={"axis_mm": tuple(shift.tolist())})
    camera = _orbited(truth.camera, camera_deg, random)
    errors = {"led": leds, "table": table, "camera": camera}
    return config.calibrated(truth.model_copy(update=errors))


@dataclass(frozen=True)
class TrueRig:
    """A rig as it is. config: with its true geometry and lights as calibration; warmth: of every LED's
    spectrum, as `spectra.led` takes it.
    """

    config: RigConfig
    warmth: tuple[float, ...]


def as_built(config: RigConfig, seed: int | None) -> TrueRig:
    """A rig as a workshop would build it from `config`; exactly to it without a seed.

    Drawn: LEDs some degrees off, powers by 10 %, lobes and colours apart; camera off by degrees and
    mm, with a lens that distorts and darkens outward; the axis beside the platter's middle, the
    platter not square to it; markers printed to a wrong scale and glued on by hand; a dark level.
    """
    if seed is None:
        return TrueRig(config.calibrated(None), (0.0,) * config.led_count)
    random = np.random.default_rng(seed)
    nominal = config.calibrated(None).geometry
    warmth = tuple(np.clip(random.normal(0.25, 0.1, config.led_count), 0, 1).tolist())
    leds = zip(nominal.led, warmth, strict=True)
    truth = nominal.model_copy(
        update={
            "lens": _ground(nominal.lens, random),
            "camera": _mounted(nominal.camera, random),
            "table": _glued(nominal.table, random),
            "led": tuple(_soldered(led, warm, random) for led, warm in leds),
            "colour": _sighted(spectra.to_srgb(spectra.led(float(np.mean(warmth))))),
            "dark": Dark(level=triple(random.uniform(0.001, 0.004, 3))),
        }
    )
    return TrueRig(config.calibrated(truth), warmth)


def _ground(lens: Lens, random: np.random.Generator) -> Lens:
    focal = np.array(lens.focal_px) * (1 + random.normal(0, 0.015))
    centre = np.array(lens.centre_px) + random.normal(0, 0.006 * lens.width_px, 2)
    k1, k2 = random.normal(-0.12, 0.04), random.normal(0.03, 0.02)
    p1, p2 = random.normal(0, 4e-4, 2).tolist()
    return lens.model_copy(
        update={
            "focal_px": (float(focal[0]), float(focal[1] * (1 + random.normal(0, 5e-4)))),
            "centre_px": (float(centre[0]), float(centre[1])),
            "distortion": (k1, k2, p1, p2, 0.0),
            "vignetting": (random.normal(-0.2, 0.04), random.normal(-0.05, 0.02)),
        }
    )


def _mounted(camera: CameraPose, random: np.random.Generator) -> CameraPose:
    swung = _orbited(camera, 2.0, random)
    aside = _rotation(random.normal(0, np.radians(0.6), 3))
    axes = aside @ _rotation(np.radians(swung.rotation_deg))
    return CameraPose(
        position_mm=triple(np.array(swung.position_mm) + random.normal(0, 3.0, 3)),
        rotation_deg=triple(np.degrees(cv2.Rodrigues(axes)[0])),
    )


def _glued(table: Table, random: np.random.Generator) -> Table:
    corners = np.array(table.marker_corners_mm)
    moves = random.normal(0, 0.1, (len(corners), 2))
    centres = corners.mean(axis=1)
    around = np.stack([-centres[:, 1], centres[:, 0]], axis=1)
    moves -= moves.mean(axis=0)  # shift and turn of them all are the platter's, not the markers'
    moves -= around * (np.sum(around * moves) / np.sum(around**2))
    printed: Any = (corners * (1 + random.normal(0, 0.003)) + moves[:, None]).tolist()
    along_x, along_y = random.normal(0, 0.08, 2).tolist()
    x, y = random.normal(0, 0.4, 2).tolist()
    return Table(axis_mm=(x, y), tilt_deg=(along_x, along_y), marker_corners_mm=printed)


def _sighted(to_srgb: Vector) -> Colour:
    rows = triple(to_srgb[0]), triple(to_srgb[1]), triple(to_srgb[2])
    return Colour(matrix=rows, matrix_sigma=((0, 0, 0),) * 3, delta_e00_mean=0, delta_e00_max=0)


def _soldered(led: Led, warmth: float, random: np.random.Generator) -> Led:
    position = _swung(np.array(led.position_mm), 3.0, random) * (1 + random.normal(0, 0.015))
    aim_x, aim_y = random.normal(0, 12.0, 2).tolist()
    return Led(
        position_mm=triple(position),
        aim_mm=(aim_x, aim_y),
        exponent=float(np.exp(random.normal(0, 0.1))),
        power=led.power * float(np.exp(random.normal(0, 0.1))),
        colour=triple(spectra.white_reading(spectra.led(warmth))),
    )


def _swung(position: Vector, angle_deg: float, random: np.random.Generator) -> Vector:
    """A position turned about the origin, by angle_deg in the root mean square."""
    outward = position / np.linalg.norm(position)
    turn = random.normal(0, np.radians(angle_deg) / np.sqrt(2), 3)
    across = turn - outward * (turn @ outward)
    return _rotation(across) @ position


def _orbited(camera: CameraPose, angle_deg: float, random: np.random.Generator) -> CameraPose:
    """The camera and its axes turned about the origin, by angle_deg in the root mean square."""
    turn = _rotation(random.normal(0, np.radians(angle_deg) / np.sqrt(3), 3))
    axes = _rotation(np.radians(camera.rotation_deg)) @ turn.T
    return CameraPose(
        position_mm=triple(turn @ camera.position_mm),
        rotation_deg=triple(np.degrees(cv2.Rodrigues(axes)[0])),
    )


def _rotation(vector: Vector) -> Vector:
    return np.asarray(cv2.Rodrigues(vector)[0], dtype=float)
