"""What is too dark for the sensor says nothing, and makes no shot look bad."""

from dataclasses import replace

import numpy as np

from turnlight.estimate.brdf_kernel import from_maps, to_maps
from turnlight.estimate.learning import learn
from turnlight.estimate.noise import noise_of
from turnlight.estimate.observations import SENSOR_DARKNESS, observe

from .conftest import SIDE


def black(picture):
    noisy = np.abs(1e-4 * np.random.default_rng(0).standard_normal(picture.image.shape))
    return replace(picture, image=noisy.astype(np.float32))


def test_a_shot_that_shows_nothing_but_noise_cannot_be_judged(pictures):
    dark = [black(picture) for picture in pictures]
    learned = learn(dark, noise_of(dark), None)
    assert np.isnan(learned.residuals).all()
    assert learned.bad == ()


def test_the_floor_of_a_short_exposure_is_the_sensors_noise(pictures):
    lit = pictures[0].lighting
    lights = tuple(replace(light, white=light.white * np.float32(0.01)) for light in lit.lights)
    short = replace(black(pictures[0]), lighting=replace(lit, lights=lights))
    seen = observe([short], noise_of([short]), slice(0, SIDE))
    assert seen.floor[0] == np.float32(SENSOR_DARKNESS)


def test_a_metal_may_be_as_black_as_it_is(material):
    metal = replace(material, diffuse=np.zeros_like(material.diffuse))
    assert to_maps(from_maps(metal)).diffuse.max() < 1e-4


def test_black_within_the_sensors_noise_is_found_black(pictures):
    """Half of the noise lies below zero; what cuts that off finds light where there is none."""
    random = np.random.default_rng(1)
    noisy = [
        replace(p, image=random.normal(0, 3e-4, p.image.shape).astype(np.float32)) for p in pictures
    ]
    seen = observe(noisy, noise_of(noisy), slice(None))
    assert abs(float(np.mean(np.exp(seen.logs) - seen.floor[:, None, None]))) < 1e-5
    assert np.exp(seen.logs).min() > 0
