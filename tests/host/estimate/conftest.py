"""Pictures of a known material under the reference rig's plan, without optics and camera."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from svbrdf import procedural
from svbrdf.renderer import pixel_positions, shade
from turnlight.capture.plan import plan
from turnlight.config import RigConfig
from turnlight.frame import Exposure
from turnlight.picture.lighting import lighting
from turnlight.picture.picture import Picture

SIDE = 32
CONFIG = RigConfig.load(Path(__file__).parents[3] / "rig_config/simulated.toml")


def unit(vector):
    return vector / np.linalg.norm(vector, axis=-1, keepdims=True)


def photograph(material, lit):
    """(n, n, 3) what the renderer says of maps under a Lighting."""
    places = pixel_positions(np, *material.resolution, dtype=np.float32)
    image = np.zeros((*material.resolution, 3), np.float32)
    for light in lit.lights:
        to_light, to_view = unit(light.position - places), unit(lit.view - places)
        image += shade(material, to_light, to_view, np.float32(np.pi)) * light.white
    return image


def pictures_of(material, count, clip=1.0, noise=0.003):
    rng = np.random.default_rng(0)
    taken = []
    for shot in plan(CONFIG, count, 2.0):
        exposure = Exposure(shot.exposure_us, shot.gain)
        lit = lighting(CONFIG, shot.leds, shot.angle_deg, exposure, 2.0, len(material.normal))
        image = photograph(material, lit)
        image = (image * (1 + noise * rng.standard_normal(image.shape))).astype(np.float32)
        clipped = (image >= clip).any(axis=-1)
        valid = np.ones(clipped.shape, bool)
        taken.append(Picture(np.clip(image, 0, clip), 1.0, valid, clipped, lit))
    return taken


@pytest.fixture(scope="session")
def material():
    return procedural.material(5, SIDE)


@pytest.fixture(scope="session")
def pictures(material):
    return pictures_of(material, 8)


def darkened(picture, factor):
    return replace(picture, image=(picture.image * factor).astype(np.float32))
