import math

import numpy as np
import pytest

from svbrdf import maps, procedural
from svbrdf.maps import Maps
from svbrdf.renderer import pixel_positions, render, shade

torch = pytest.importorskip("torch")


def test_pixel_grid_has_its_first_row_on_top():
    positions = pixel_positions(np, 4, 2)
    assert positions[0, 0].tolist() == [-0.5, 0.75, 0.0]
    assert positions[3, 1].tolist() == [0.5, -0.75, 0.0]


def test_a_white_lambertian_patch_reflects_its_irradiance():
    white = maps.flat(1, 1, albedo=1.0, roughness=1.0)
    white = Maps(white.normal, white.diffuse, white.roughness, np.zeros_like(white.specular))
    up = np.float32([0, 0, 1])
    slanted = np.float32([math.sin(1.0), 0, math.cos(1.0)])
    radiance = shade(white, up, slanted, math.pi)[0, 0]
    specular = shade(
        Maps(white.normal, 0 * white.diffuse, white.roughness, white.specular), up, slanted, math.pi
    )[0, 0]
    np.testing.assert_allclose(radiance - specular, 1.0, atol=1e-6)


def test_values_computed_by_hand():
    """One pixel, worked from the formulas with plain floats."""
    normal = np.array([0.1, -0.2, 1.0])
    normal /= np.linalg.norm(normal)
    light, view = np.array([0.3, 0.4, 0.8]), np.array([-0.2, 0.5, 0.9])
    light, view = light / np.linalg.norm(light), view / np.linalg.norm(view)
    half = (light + view) / np.linalg.norm(light + view)
    rough, f0, albedo = 0.4, 0.2, 0.6
    alpha = rough**2
    n_h, n_l, n_v, v_h = (
        float(a @ b) for a, b in [(normal, half), (normal, light), (normal, view), (view, half)]
    )
    d = alpha**2 / (math.pi * (n_h**2 * (alpha**2 - 1) + 1) ** 2)
    f = f0 + (1 - f0) * 2 ** ((-5.55473 * v_h - 6.98316) * v_h)
    k = alpha / 2
    v = 1 / ((n_l * (1 - k) + k) * (n_v * (1 - k) + k))
    expected = (albedo * (1 - f0) / math.pi + f * d * v / 4) * n_l * 2.0
    pixel = Maps(
        *(np.array(a).reshape(1, 1, -1) for a in (normal, [albedo] * 3, [rough], [f0] * 3))
    )
    np.testing.assert_allclose(shade(pixel, light, view, 2.0)[0, 0], expected, rtol=1e-12)


def test_reciprocity():
    sample = procedural.material(3, 16)
    a, b = np.float32([0.6, 0, 0.8]), np.float32([0, -0.28, 0.96])
    forth = shade(sample, a, b, 1.0) * (sample.normal @ b)[..., None]
    back = shade(sample, b, a, 1.0) * (sample.normal @ a)[..., None]
    np.testing.assert_allclose(forth, back, rtol=1e-3, atol=1e-5)


def test_numpy_and_torch_agree():
    sample = procedural.material(11, 64)
    light, view = np.float32([0.5, 1.0, 2.0]), np.float32([-0.4, -1.1, 2.2])
    ours = render(sample, light, view, np.float32(math.pi))
    theirs = render(
        sample.map(torch.from_numpy), torch.from_numpy(light), torch.from_numpy(view), math.pi
    )
    np.testing.assert_allclose(theirs.numpy(), ours, rtol=2e-3, atol=1e-5)


def test_a_mirror_highlight_sits_at_the_mirror_point():
    glossy = maps.flat(65, 65, albedo=0.0, roughness=0.1)
    image = render(glossy, np.float32([1.0, 0, 2.0]), np.float32([-0.5, 0, 2.0]), np.float32(1))
    row, column = np.unravel_index(image[..., 0].argmax(), image.shape[:2])
    x = (column + 0.5) / 65 * 2 - 1
    assert row == 32
    assert x == pytest.approx(0.25, abs=0.04)
