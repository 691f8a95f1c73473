"""Intervals fitted on some materials, for others."""

import ast

import numpy as np
import pytest

from turnlight import study_uncertainty
from turnlight.estimate.uncertainty import INTERVALS, between


def material(seed: int) -> study_uncertainty.Sample:
    """Its errors are those that are stated, times a factor of its own."""
    rng = np.random.default_rng(seed)
    stated = np.exp(rng.normal(-4, 0.5, 500))
    error = np.abs(rng.normal(0, stated)) * np.exp(rng.normal(0, 0.7))
    return dict.fromkeys(INTERVALS, np.stack([stated, error], axis=-1).astype(np.float32))


@pytest.mark.parametrize("share", [50, 95])
def test_intervals_hold_on_materials_that_the_fit_has_not_seen(share: int) -> None:
    fitted = study_uncertainty.fitted([material(seed) for seed in range(20)])
    widths, halves = ast.literal_eval("{" + fitted + "}")["roughness"]
    others = np.concatenate([material(seed)["roughness"] for seed in range(100, 200)])
    held = others[:, 1] <= between(others[:, 0], widths, halves[share])
    assert held.mean() == pytest.approx(share / 100, abs=0.05)


def test_check_says_what_the_intervals_hold() -> None:
    sample = {name: np.full((10, 2), 1e-9, np.float32) for name in INTERVALS}
    assert study_uncertainty.coverage([sample]).count("1.000") == 7 * len(INTERVALS)
