"""The compiled BRDF against the vectors that every renderer reads, and its derivatives."""

import json
from pathlib import Path

import numpy as np
import pytest

from svbrdf import maps as svbrdf_maps
from svbrdf import procedural
from turnlight.estimate.brdf_kernel import colours, from_maps, geometry, shade, to_maps

VECTORS = json.loads((Path(__file__).parents[2] / "model/brdf_vectors.json").read_text())
ABOVE = [v for v in VECTORS if v["normal"][2] > 0.05]
PATHS = np.array([[0.3, -0.5, 2.0], [-1.0, 0.4, 1.5]])


def shaded(theta, albedo, directions):
    radiance, gradient = np.zeros(3), np.zeros((3, 5))
    shade(theta, albedo, directions, np.ones(3), radiance, gradient)
    return radiance, gradient


def test_most_vectors_have_a_normal_that_the_kernel_can_say():
    assert len(ABOVE) > 0.8 * len(VECTORS)


@pytest.mark.parametrize("vector", ABOVE)
def test_radiance_is_that_of_the_vectors(vector):
    normal = np.array(vector["normal"])
    theta = np.array([*(normal[:2] / normal[2]), 0, 0, 0, vector["roughness"], 0, 0, 0])
    albedo = np.array([*(np.array(vector["diffuse"]) / np.pi), *vector["specular"]])
    light, view = np.array(vector["to_light"]), np.array(vector["to_view"])
    directions = np.zeros(10)
    geometry(np.zeros(2), light, view, directions)
    radiance, _ = shaded(theta, albedo, directions)
    np.testing.assert_allclose(radiance, vector["radiance"], rtol=1e-5, atol=1e-9)


def test_derivatives_are_those_of_finite_differences():
    theta = np.array([0.2, -0.1, -1.0, -2.0, -0.5, 0.35, -1.2, 0.2, -0.1])
    directions = np.zeros(10)
    geometry(np.array([0.1, 0.2]), *PATHS, directions)
    step, columns = 1e-6, {0: 0, 1: 1, 3: 2, 5: 3, 6: 4}
    albedo = np.zeros(6)
    colours(theta, albedo)
    _, gradient = shaded(theta, albedo, directions)
    for parameter, column in columns.items():
        ends = []
        for sign in (-1, 1):
            moved = theta + sign * step * (np.arange(9) == parameter)
            colours(moved, albedo)
            ends.append(shaded(moved, albedo, directions)[0])
        numeric = (ends[1] - ends[0]) / (2 * step)
        np.testing.assert_allclose(gradient[1, column], numeric[1], rtol=1e-5, atol=1e-9)


def test_maps_survive_being_parameters():
    sample = procedural.material(3, 16)
    again = to_maps(from_maps(sample))
    for field in ("normal", "diffuse", "roughness", "specular"):
        np.testing.assert_allclose(getattr(again, field), getattr(sample, field), atol=2e-3)


def test_a_flat_sample_is_nine_plain_numbers():
    theta = from_maps(svbrdf_maps.flat(1, 1))[0, 0]
    np.testing.assert_allclose(
        theta, [0, 0, *[np.log(0.5)] * 3, 0.5, np.log(0.04), 0, 0], atol=1e-6
    )
