import numpy as np
import pytest

from svbrdf import procedural
from svbrdf.maps import Maps
from svbrdf.scores import no_model, normal_error_deg, score, ssim


def test_the_truth_scores_perfectly():
    sample = procedural.material(4, 64)
    result = score(sample, sample)
    assert result.ssim == pytest.approx(1, abs=1e-5)
    assert result.ssim_fitted == pytest.approx(1, abs=1e-5)
    assert result.normal_deg < 0.1


def test_exposure_fit_undoes_a_scale_of_diffuse():
    sample = procedural.material(2_000_003, 64)
    matte = Maps(
        sample.normal, sample.diffuse * 0.5, np.ones_like(sample.roughness), 0 * sample.specular
    )
    dark = Maps(matte.normal, matte.diffuse * 0.6, matte.roughness, matte.specular)
    result = score(dark, matte)
    assert result.ssim_fitted > result.ssim
    assert result.ssim_fitted > 0.98


def test_ssim_matches_its_definition_on_flat_images():
    a, b = np.full((32, 32, 3), 0.4, np.float32), np.full((32, 32, 3), 0.5, np.float32)
    expected = (2 * 0.4 * 0.5 + 1e-4) / (0.4**2 + 0.5**2 + 1e-4)
    assert ssim(a, b) == pytest.approx(expected, abs=1e-3)


def test_normal_error_in_degrees():
    up = np.zeros((2, 2, 3), np.float32)
    up[..., 2] = 1
    tilted = np.zeros_like(up)
    tilted[..., 0], tilted[..., 2] = np.sin(0.2), np.cos(0.2)
    assert normal_error_deg(tilted, up) == pytest.approx(np.degrees(0.2), rel=1e-3)


def test_no_model_is_the_mean_on_a_flat_dielectric():
    guess = no_model([np.full((4, 4, 3), v, np.float32) for v in (0.2, 0.4)])
    np.testing.assert_allclose(guess.diffuse, 0.3, rtol=1e-6)
    assert guess.specular.max() == np.float32(0.04)
