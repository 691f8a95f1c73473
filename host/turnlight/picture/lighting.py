"""The lighting of a shot, from the rig's geometry."""

from collections.abc import Sequence

import numpy as np

from svbrdf.lighting import Array, Light, Lighting
from svbrdf.renderer import pixel_positions
from turnlight.config import RigConfig
from turnlight.frame import Exposure

REFERENCE_EXPOSURE_US = 10_000
"""For which the powers of LEDs are given, at gain 1."""


def lighting(
    config: RigConfig,
    leds: Sequence[int],
    angle_deg: float,
    exposure: Exposure,
    thickness_mm: float,
    resolution: int,
) -> Lighting:
    """Camera and lit LEDs in the frame of the sample turned by angle_deg; white is (n, n, 3).

    leds: numbers of the LEDs that are lit, at full power. Inverse square and a Lambertian lobe toward
    the origin of the reference sample.
    """
    positions_mm = config.led_positions_mm(thickness_mm)
    powers = config.led_powers()
    readings = exposure.exposure_us / REFERENCE_EXPOSURE_US * exposure.gain
    half_side = config.sample.side_mm / 2
    aim = (-config.lift_mm(thickness_mm) / half_side).astype(np.float32)
    points = pixel_positions(np, resolution, resolution, dtype=np.float32)
    lights = []
    for led in leds:
        position = config.to_sample_frame(positions_mm[led], angle_deg).astype(np.float32)
        white = np.float32(powers[led] * readings) * _falloff(position, aim, points)
        lights.append(Light(position, np.repeat(white, 3, axis=-1)))
    view = config.to_sample_frame(config.camera_position_mm(thickness_mm), angle_deg)
    return Lighting(view.astype(np.float32), tuple(lights))


def _falloff(position: Array, aim: Array, points: Array) -> Array:
    """(n, n, 1): 1 at the point aimed at."""
    axis, offset = position - aim, position - points
    reach = np.sqrt(np.sum(axis * axis))
    distance = np.sqrt(np.sum(offset * offset, axis=-1, keepdims=True))
    lobe = np.maximum(offset @ axis / (distance[..., 0] * reach), 0)[..., None]
    result: Array = lobe * (reach / distance) ** 2
    return result
