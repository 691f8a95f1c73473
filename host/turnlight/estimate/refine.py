"""Calibrated refinement: the maps that explain all pictures of a session under their known lights.

Maximum a posteriori per pixel, in four steps: on a sample of pixels, competing hypotheses about the
kind of material; from them a prior for pixels of each colour; corrections of the lights; and then every
pixel, starting from and regularised toward what pixels like it have shown, and toward the network's maps.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from svbrdf.maps import Maps
from turnlight.estimate import pooled_prior, self_calibration
from turnlight.estimate.brdf_kernel import ROUGHNESS, from_maps, to_maps
from turnlight.estimate.observations import (
    Array,
    Observations,
    fit_pixels,
    observe,
    posterior_covariance,
)
from turnlight.estimate.pooled_prior import HYPOTHESES, Pool
from turnlight.estimate.self_calibration import Corrections
from turnlight.picture.picture import Picture

NOISE = 0.03
"""Of the logs of values: sensor, resampling, and what the BRDF model cannot say."""
SAMPLE = 3072
ROUNDS = 2
_QUICK, _THOROUGH = 12, 20


@dataclass(frozen=True)
class Refinement:
    """What the pictures say. covariance (H, W, 9, 9) is of brdf_kernel's parameters."""

    maps: Maps
    theta: Array
    corrections: Corrections
    pool: Pool


def refine(pictures: Sequence[Picture], network: Maps | None, resolution: int) -> Refinement:
    """Refine to resolution x resolution maps. network: maps to start at and be drawn to, any size."""
    seen = observe(pictures, resolution, NOISE)
    guess = None if network is None else _resized(from_maps(network), resolution)
    pool, corrections = learn(seen, guess)
    exact = self_calibration.corrected(seen, corrections)
    values = pooled_prior.features(exact)
    mean, precision = pool.prior(values, guess)
    theta = fit_from_two(exact, pool.start(values), mean, precision)
    theta = theta.reshape(resolution, resolution, -1)
    return Refinement(to_maps(theta), theta, corrections, pool)


def fit_from_two(seen: Observations, start: Array, mean: Array, precision: Array) -> Array:
    """The better of the fits from `start` and from its like with the prior's roughness and specular."""
    first, first_energy = fit_pixels(seen, start, mean, precision, _THOROUGH)
    start = first.copy()
    start[:, ROUGHNESS:] = mean[:, ROUGHNESS:]
    second, second_energy = fit_pixels(seen, start, mean, precision, _THOROUGH)
    return np.where((second_energy < first_energy)[:, None], second, first)


def learn(seen: Observations, guess: Array | None) -> tuple[Pool, Corrections]:
    """From a sample of the pixels: what their materials share, and how the lights are off."""
    chosen = np.sort(np.random.default_rng(0).permutation(seen.pixels)[:SAMPLE])
    nominal = seen.of_pixels(chosen)
    guess = None if guess is None else guess[chosen]
    values = pooled_prior.features(nominal)
    corrections = self_calibration.unknown_errors(len(seen.lights))
    theta, mean, precision = _compete(nominal, values, guess)
    for _ in range(ROUNDS):
        exact = self_calibration.corrected(nominal, corrections)
        covariance = posterior_covariance(exact, theta, mean, precision)
        variance = np.diagonal(covariance, axis1=1, axis2=2).astype(np.float32)
        pool = pooled_prior.learn(values, theta, mean, precision, variance)
        mean, precision = pool.prior(values, guess)
        theta, _ = fit_pixels(exact, theta, mean, precision, _QUICK)
        corrections = self_calibration.improve(nominal, corrections, theta, mean, precision)
    return pool, corrections


def _compete(seen: Observations, values: Array, guess: Array | None) -> tuple[Array, Array, Array]:
    """Each pixel's parameters under the hypothesis that its group prefers, and that one's prior."""
    tried = [h.start(seen, guess) for h in HYPOTHESES]
    fits = [fit_pixels(seen, start, mean, precision, _QUICK) for start, mean, precision in tried]
    best = pooled_prior.compete(np.stack([energy for _, energy in fits]), values)
    each = np.arange(seen.pixels)
    theta = np.stack([theta for theta, _ in fits])[best, each]
    mean = np.stack([mean for _, mean, _ in tried])[best, each]
    precision = np.stack([precision for _, _, precision in tried])[best, each]
    return theta, mean, precision


def _resized(theta: Array, resolution: int) -> Array:
    """(resolution^2, 9)."""
    method = cv2.INTER_AREA if theta.shape[0] > resolution else cv2.INTER_LINEAR
    planes = [
        cv2.resize(p, (resolution,) * 2, interpolation=method) for p in np.moveaxis(theta, -1, 0)
    ]
    return np.stack(planes, axis=-1).reshape(resolution**2, -1).astype(np.float32)
