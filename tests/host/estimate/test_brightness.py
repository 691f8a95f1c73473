import random
from dataclasses import replace

import numpy as np
import pytest

from svbrdf.maps import flat
from turnlight.estimate.brightness import Brightness
from turnlight.estimate.estimator import Estimator

from .conftest import SIDE, pictures_of


@pytest.fixture(scope="module")
def material():
    """Of which most is matte."""
    grain = np.random.default_rng(0).uniform(0.2, 0.5, (SIDE, SIDE, 3)).astype(np.float32)
    return replace(flat(SIDE, SIDE, roughness=0.7), diffuse=grain)


@pytest.fixture(scope="module")
def pictures(material):
    return pictures_of(material, 8)


def balanced(maps, pictures):
    brightness = Brightness()
    for picture in pictures:
        brightness.add(picture)
    return brightness.balanced(maps)


def darker(maps):
    return replace(maps, diffuse=maps.diffuse * np.float32(0.8))


def test_maps_are_made_as_bright_as_the_pictures(material, pictures):
    maps = balanced(darker(material), pictures)
    assert maps.diffuse == pytest.approx(material.diffuse, rel=0.02)
    assert maps.normal is material.normal and maps.specular is material.specular


def test_maps_that_are_right_stay_so(material, pictures):
    assert balanced(material, pictures).diffuse == pytest.approx(material.diffuse, rel=0.005)


def test_a_dead_light_and_clipping_are_not_believed(material, pictures):
    dead = replace(pictures[0], image=np.zeros_like(pictures[0].image))
    full = np.quantile(pictures[1].image, 0.9)
    clipped = replace(
        pictures[1],
        image=np.minimum(pictures[1].image, full),
        clipped=(pictures[1].image >= full).any(axis=-1),
    )
    maps = balanced(darker(material), [dead, clipped, *pictures[2:]])
    assert maps.diffuse == pytest.approx(material.diffuse, rel=0.02)


@pytest.mark.parametrize("known", [0, 1])
def test_nothing_is_said_of_one_picture_or_of_unknown_light(material, pictures, known):
    unknown = [replace(picture, lighting=None) for picture in pictures[1:]]
    maps = darker(material)
    for some in (pictures[:1], unknown, [*pictures[:known], *unknown]):
        assert balanced(maps, some) is maps


def test_the_order_of_pictures_makes_no_difference(pictures):
    maps = []
    for seed in range(2):
        estimator = Estimator()
        for picture in random.Random(seed).sample(pictures, len(pictures)):
            estimator.add(picture)
        maps.append(estimator.maps())
    first, second = maps
    assert (first.diffuse == second.diffuse).all() and (first.normal == second.normal).all()


def test_forgetting_forgets_how_bright_pictures_were(pictures):
    estimator = Estimator()
    for picture in pictures[:3]:
        estimator.add(replace(picture, image=picture.image * np.float32(0.5)))
    estimator.reset()
    again = [estimator.add(picture) for picture in pictures[:3]][-1]
    fresh = Estimator()
    expected = [fresh.add(picture) for picture in pictures[:3]][-1]
    assert (again.diffuse == expected.diffuse).all()


def test_a_black_metal_is_left_black(material, pictures):
    """What little of it reads as matte says nothing of its diffuse map."""
    black = np.full_like(material.diffuse, 1e-4)
    black[0, :4] = 0.2
    metal = replace(material, diffuse=black, specular=np.full_like(material.specular, 0.9))
    assert balanced(metal, pictures) is metal
