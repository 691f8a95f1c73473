"""The lighting of a shot, from the rig's geometry."""

from collections.abc import Sequence

import numpy as np

from svbrdf.lighting import Array, Light, Lighting
from svbrdf.renderer import pixel_positions
from turnlight.config import RigConfig
from turnlight.frame import Exposure
from turnlight.picture.radiometry import colour_corrected

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

    leds: numbers of the LEDs that are lit, at full power. Inverse square and each LED's own lobe; white
    is colour-corrected as the picture is, hence grey where a single LED is lit.
    """
    positions = config.to_sample_frame(config.led_positions_mm(thickness_mm), angle_deg)
    aims = config.to_sample_frame(config.led_aims_mm(thickness_mm), angle_deg).astype(np.float32)
    origin = config.to_sample_frame(-config.lift_mm(thickness_mm), angle_deg).astype(np.float32)
    readings = exposure.exposure_us / REFERENCE_EXPOSURE_US * exposure.gain
    colours = (config.led_powers()[:, None] * config.led_colours() * readings).astype(np.float32)
    points = pixel_positions(np, resolution, resolution, dtype=np.float32)
    lights = []
    for led in leds:
        position = positions[led].astype(np.float32)
        exponent = float(config.led_exponents()[led])
        falloff = _irradiance(position, aims[led], exponent, points)
        falloff /= _irradiance(position, aims[led], exponent, origin)
        lights.append(Light(position, colour_corrected(colours[led], config, leds) * falloff))
    view = config.to_sample_frame(config.camera_position_mm(thickness_mm), angle_deg)
    return Lighting(view.astype(np.float32), tuple(lights))


def _irradiance(position: Array, aim: Array, exponent: float, points: Array) -> Array:
    """(..., 1) on a patch that faces the LED, up to a factor."""
    axis, offset = position - aim, position - points
    distance = np.sqrt(np.sum(offset * offset, axis=-1, keepdims=True))
    cosine = np.maximum(offset @ axis / (distance[..., 0] * np.sqrt(axis @ axis)), 0)[..., None]
    result: Array = cosine ** np.float32(exponent) / distance**2
    return result
