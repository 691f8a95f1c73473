"""Refinement of pictures whose material and lights are known."""

from dataclasses import replace

import cv2
import numpy as np
import pytest

from svbrdf import maps as svbrdf_maps
from svbrdf import procedural
from svbrdf.lighting import Light, Lighting
from svbrdf.scores import no_model, normal_error_deg, renderings
from turnlight.estimate import refine as module
from turnlight.estimate.classical import optimise
from turnlight.estimate.refine import refine

from .conftest import SIDE, darkened, pictures_of


@pytest.fixture(scope="module")
def refined(pictures):
    return refine(pictures, None, SIDE)


def test_eight_shots_tell_the_material(refined, material):
    assert normal_error_deg(refined.maps.normal, material.normal) < 1.5
    np.testing.assert_allclose(refined.maps.diffuse, material.diffuse, atol=0.06)
    assert np.sqrt(np.mean((refined.maps.roughness - material.roughness) ** 2)) < 0.06


def test_every_shot_is_predicted_by_the_others(refined):
    assert refined.quality.bad == ()
    assert len(refined.quality.by_shot) == 8
    assert 0 < refined.quality.relighting_error < 0.03


def test_uncertainty_is_of_the_size_of_the_errors(refined, material):
    error = np.abs(refined.maps.roughness - material.roughness)
    stated = refined.uncertainty.roughness
    assert stated.shape == (SIDE, SIDE, 1)
    assert (stated > 0).all()
    assert 0.2 * np.median(stated) < np.median(error) + 1e-3
    variances, covariances = refined.uncertainty.slopes[..., :2], refined.uncertainty.slopes[..., 2]
    assert (variances.prod(axis=-1) > covariances**2).all()


@pytest.mark.parametrize("factor", [0.0, 0.4])
def test_a_dead_or_shaded_shot_is_named_and_does_no_harm(pictures, material, factor):
    spoilt = [darkened(p, factor) if i == 4 else p for i, p in enumerate(pictures)]
    result = refine(spoilt, None, SIDE)
    assert result.quality.bad == (4,)
    assert result.quality.by_shot[4] is None
    assert normal_error_deg(result.maps.normal, material.normal) < 1.5


def test_a_shadow_on_a_third_of_the_sample_is_named_and_so_is_a_blurred_shot_beside_it(pictures):
    shaded = pictures[2].image.copy()
    shaded[: SIDE // 3] *= 0.4
    spoilt = [*pictures[:2], replace(pictures[2], image=shaded), *pictures[3:]]
    spoilt[4] = soft(spoilt[4])
    assert refine(spoilt, None, SIDE).quality.bad == (2, 4)


def test_a_blurred_shot_is_named_and_does_no_harm(pictures, material):
    blurred = [soft(p) if i == 4 else p for i, p in enumerate(pictures)]
    result = refine(blurred, None, SIDE)
    assert result.quality.bad == (4,)
    assert normal_error_deg(result.maps.normal, material.normal) < 1.5


def test_a_mirror_is_told_by_the_shots_that_are_exposed_for_its_highlight():
    mirror = flat_with(roughness=0.12, diffuse=0.0, specular=0.6)
    result = refine(exposed(pictures_of(mirror, 8, clip=np.inf)), None, SIDE)
    assert result.quality.bad == ()
    assert (result.maps.diffuse[..., 1] < 2e-3).mean() > 0.9
    assert np.median(np.abs(result.maps.roughness - 0.12)) < 0.03


def test_a_polish_that_few_pixels_saw_is_that_of_all():
    stone = flat_with(roughness=0.06, diffuse=0.8, specular=0.04)
    result = refine(exposed(pictures_of(stone, 8, clip=np.inf)), None, SIDE)
    assert np.sqrt(np.mean((result.maps.roughness - 0.06) ** 2)) < 0.06


def test_clipped_highlights_do_no_harm(material):
    result = refine(pictures_of(material, 8, clip=0.25), None, SIDE)
    assert normal_error_deg(result.maps.normal, material.normal) < 3


def test_pixels_that_no_shot_saw_still_get_maps(pictures):
    hidden = [replace(p, valid=p.valid & (np.arange(SIDE) > 4)) for p in pictures]
    result = refine(hidden, None, SIDE)
    assert all(np.isfinite(a).all() for a in vars(result.maps).values())


def test_one_picture_gives_maps_and_no_quality(pictures):
    result = refine(pictures[:1], svbrdf_maps.flat(8, 8), SIDE)
    assert result.quality.relighting_error is None
    assert result.maps.resolution == (SIDE, SIDE)


def test_bands_change_nothing(pictures, refined, monkeypatch):
    monkeypatch.setattr(module, "BAND_PIXELS", 3 * SIDE)
    again = refine(pictures, None, SIDE)
    np.testing.assert_allclose(again.maps.roughness, refined.maps.roughness, atol=1e-4)


def test_the_classical_optimisation_gets_nearer(monkeypatch):
    monkeypatch.setattr("turnlight.estimate.classical.STEPS", ((1, 150),))
    stone = procedural.material(1_000_005, 16)
    pictures = pictures_of(stone, 6)
    guess = no_model([p.image for p in pictures])
    assert nearness(optimise(pictures, 16), stone) > nearness(guess, stone)


def flat_with(roughness, diffuse, specular):
    plain = svbrdf_maps.flat(SIDE, SIDE)
    return replace(
        plain,
        diffuse=np.full_like(plain.diffuse, diffuse),
        roughness=np.full_like(plain.roughness, roughness),
        specular=np.full_like(plain.specular, specular),
    )


def soft(picture):
    return replace(picture, image=cv2.GaussianBlur(picture.image, (0, 0), 1.5))


def exposed(pictures):
    """As a camera with noise and full scale exposes each: its brightest just below full scale."""
    rng = np.random.default_rng(0)
    return [_exposed(picture, rng) for picture in pictures]


def _exposed(picture, rng):
    factor = np.float32(min(0.9 / np.quantile(picture.image, 0.995), 4))
    image = picture.image * factor + 1e-4 * rng.standard_normal(picture.image.shape)
    lights = [Light(light.position, light.white * factor) for light in picture.lighting.lights]
    return replace(
        picture,
        image=np.clip(image, 0, 1).astype(np.float32),
        clipped=(image >= 1).any(axis=-1),
        lighting=Lighting(picture.lighting.view, tuple(lights)),
    )


def nearness(maps, truth):
    return np.mean(
        [-np.abs(a - b).mean() for a, b in zip(renderings(maps), renderings(truth), strict=True)]
    )
