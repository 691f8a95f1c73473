"""What a sample's pixels tell about each other."""

import numpy as np

from turnlight.estimate.brdf_kernel import ROUGHNESS
from turnlight.estimate.pooled_prior import HYPOTHESES, compete, learn

GLOSSY, ROUGH = 1, 2


def test_few_pixels_that_saw_a_highlight_speak_for_the_many_that_hardly_care():
    pixels = 1000
    rng = np.random.default_rng(0)
    values = rng.normal(0, 0.5, (pixels, 6)).astype(np.float32)
    energies = np.full((len(HYPOTHESES), pixels), 100.0)
    energies[GLOSSY] = 22.0
    energies[ROUGH] = 21 + rng.uniform(-0.5, 0.5, pixels)
    energies[ROUGH, :8] = 45.0
    assert (compete(energies, values) == GLOSSY).mean() > 0.95


def test_two_materials_side_by_side_each_keep_their_own_kind():
    pixels, metal = 1000, 3
    values = np.zeros((pixels, 6), np.float32)
    values[pixels // 2 :, :3] = 2.0
    energies = np.full((len(HYPOTHESES), pixels), 60.0)
    energies[ROUGH, : pixels // 2] = 20.0
    energies[metal, pixels // 2 :] = 20.0
    best = compete(energies, values)
    assert (best[: pixels // 2] == ROUGH).all()
    assert (best[pixels // 2 :] == metal).all()


def test_few_certain_pixels_outweigh_many_that_lean_on_small_differences():
    pixels, certain = 1000, slice(0, 20)
    theta = np.tile(HYPOTHESES[GLOSSY].mean, (pixels, 1))
    theta[:, ROUGHNESS], theta[certain, ROUGHNESS] = 0.9, 0.06
    mean = np.tile(HYPOTHESES[GLOSSY].mean, (pixels, 1))
    precision = np.tile(np.float32(1) / HYPOTHESES[GLOSSY].sigma ** 2, (pixels, 1))
    information = precision.astype(np.float64) + 400
    information[:, ROUGHNESS] = precision[:, ROUGHNESS] + 20
    information[certain, ROUGHNESS] += 1e6
    covariance = information[:, :, None] ** -1.0 * np.eye(information.shape[1])
    values = np.zeros((pixels, 6), np.float32)
    pool = learn(values, theta, mean, precision, covariance, (mean, precision))
    assert (pool.mean[:, ROUGHNESS] < 0.3).all()
