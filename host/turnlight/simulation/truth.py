"""A simulated rig whose truth differs from its configuration: what the simulation images, while the
software knows only the configuration or a calibration.
"""

import cv2
import numpy as np

from turnlight.calibration import CameraPose, triple
from turnlight.config import RigConfig, Vector


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
