"""The lighting of a shot agrees with the simulated optics, which were written apart from it."""

import numpy as np
import pytest

from svbrdf import maps, renderer
from turnlight.app import DEFAULT_RIG
from turnlight.config import RigConfig
from turnlight.frame import Exposure
from turnlight.picture.lighting import lighting
from turnlight.simulation import optics
from turnlight.simulation.light import stage_of
from turnlight.simulation.sample import FlatSample

RESOLUTION = 32


@pytest.mark.parametrize("thickness_mm", [2.0, 7.0])
def test_rendering_under_the_lighting_is_what_the_sensor_gets(thickness_mm: float) -> None:
    config = RigConfig.load(DEFAULT_RIG)
    flat = maps.flat(RESOLUTION, RESOLUTION)
    scene = optics.scene(config, flat, thickness_mm, ambient=0.0)
    leds = (5, 30)
    levels = [255 if led in leds else 0 for led in range(config.led_count)]
    assert isinstance(scene.subject, FlatSample)
    seen = scene.subject.radiance(stage_of(config, 40.0, levels, 0.0))
    known = lighting(config, leds, 40.0, Exposure(10_000, 1.0), thickness_mm, RESOLUTION)
    rendered = sum(
        renderer.render(flat, light.position, known.view, np.float32(np.pi) * light.white)
        for light in known.lights
    )
    np.testing.assert_allclose(rendered, seen, rtol=1e-4, atol=1e-5)


def test_white_grows_with_exposure_and_gain() -> None:
    config = RigConfig.load(DEFAULT_RIG)
    base, more = (
        lighting(config, (3,), 0.0, Exposure(us, gain), 2.0, 8).lights[0].white
        for us, gain in ((10_000, 1.0), (20_000, 1.5))
    )
    np.testing.assert_allclose(more, 3 * base, rtol=1e-6)
