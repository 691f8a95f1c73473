"""How much a picture's pixels are believed, and that relief stays as steep as it is."""

import numpy as np
import pytest

from svbrdf import procedural
from svbrdf.maps import Maps
from turnlight.estimate.brdf_kernel import from_maps
from turnlight.estimate.noise import noise_of
from turnlight.estimate.refine import refine

from .conftest import SIDE, darkened, pictures_of


@pytest.fixture(scope="module")
def chalk():
    plane = np.ones((SIDE, SIDE, 1), np.float32)
    flat = np.concatenate([0 * plane, 0 * plane, plane], axis=-1)
    colour = np.repeat(plane, 3, axis=-1)
    return pictures_of(Maps(flat, 0.5 * colour, 0.9 * plane, 0.04 * colour), 8)


def test_a_picture_darker_than_the_pixels_others_is_believed_less(chalk):
    noises = noise_of([darkened(chalk[0], 0.25), *chalk[1:]])
    assert np.median(noises[0]) > 2 * np.median(noises[1])


def test_a_highlight_is_not_believed_more(chalk):
    noises = noise_of([darkened(chalk[0], 4), *chalk[1:]])
    assert np.median(noises[0]) > 0.9 * np.median(noises[1])


@pytest.mark.parametrize("seed", [5, 29])
def test_four_shots_do_not_flatten_relief(seed):
    """A prior whose spread shrinks with what it has flattened left a third of these slopes out."""
    material = procedural.material(seed, SIDE)
    found = from_maps(refine(pictures_of(material, 4), None, SIDE).maps)[..., :2]
    true = from_maps(material)[..., :2]
    assert 0.9 < (found * true).sum() / (true * true).sum() < 1.05
