"""Which shot would tell most: the expected fall of the posterior variance of the maps.

Linearised about what is known so far, averaged over a sample of pixels and over materials drawn from
each one's posterior, because a highlight that has not been seen may lie anywhere the posterior allows.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
from numba import njit

from svbrdf.lighting import Lighting
from turnlight.estimate.brdf_kernel import (
    DIFFUSE,
    LOWER,
    PARAMETERS,
    ROUGHNESS,
    SLOPE,
    SPECULAR,
    UPPER,
)
from turnlight.estimate.learning import Learned
from turnlight.estimate.map_kernel import BY_CHANNEL, SEEN, predict, trace_paths
from turnlight.estimate.noise import EVERYWHERE
from turnlight.estimate.observations import (
    DARKNESS,
    Array,
    Observations,
    posterior_covariance,
)

SLOPE_SCALE, ROUGHNESS_SCALE, ALBEDO_SCALE = 0.05, 0.06, 0.2
"""What counts as much: half of an error of 3 degrees, the bar on roughness, and a fifth of an albedo."""
PIXELS, DRAWS = 200, 3
SHINY_ROUGHNESS, SHINY_SHARE = 0.3, 0.2
REACH = 2.0
"""A highlight tells its shape within this many of its half widths."""


@dataclass(frozen=True)
class Candidate:
    """A shot that could be taken. lighting: with white at 1 x 1. cost_s: of taking it next."""

    lighting: Lighting
    cost_s: float


def best(learned: Learned, candidates: Sequence[Candidate]) -> int:
    """The candidate with the greatest gain per second."""
    return int(np.argmax(gains(learned, candidates) / [c.cost_s for c in candidates]))


def gains(learned: Learned, candidates: Sequence[Candidate]) -> npt.NDArray[np.float64]:
    """By how much each candidate is expected to reduce a pixel's variances, summed in their own scales."""
    chosen = np.linspace(0, learned.seen.pixels - 1, min(PIXELS, learned.seen.pixels)).astype(int)
    seen = learned.seen.of_pixels(chosen)
    covariance = posterior_covariance(
        seen, learned.theta[chosen], learned.mean[chosen], learned.precision[chosen]
    )
    rng = np.random.default_rng(0)
    noise = rng.standard_normal((DRAWS, len(chosen), PARAMETERS))
    spread = np.einsum("pij,dpj->dpi", np.linalg.cholesky(covariance), noise)
    drawn = np.clip(learned.theta[chosen] + spread, LOWER, UPPER).astype(np.float32)
    weights = np.zeros(PARAMETERS)
    weights[SLOPE], weights[ROUGHNESS] = SLOPE_SCALE**-2, ROUGHNESS_SCALE**-2
    weights[DIFFUSE], weights[SPECULAR] = ALBEDO_SCALE**-2 / 3, ALBEDO_SCALE**-2
    result = np.zeros(len(candidates))
    for index, candidate in enumerate(candidates):
        expected = _expected(candidate.lighting, seen.positions)
        _gain(drawn, covariance, weights, expected, result[index : index + 1])
    return result


def shiny(learned: Learned) -> bool:
    """Is much of the sample so glossy that lights set apart leave its highlights unseen?"""
    return bool(np.mean(learned.theta[:, ROUGHNESS] < SHINY_ROUGHNESS) > SHINY_SHARE)


def reachable_share(learned: Learned, lightings: Sequence[Lighting]) -> float:
    """The share of the sample for which some of these lightings lies within reach of the highlight."""
    theta, places = learned.theta, np.pad(learned.seen.positions, ((0, 0), (0, 1)))
    normal = _unit(np.concatenate([theta[:, :2], np.ones((len(theta), 1), np.float32)], axis=1))
    half_width = (
        0.64 * np.clip(theta[:, ROUGHNESS], 0.03, 1.0) ** 2
    )  # tan of where D is half its peak
    reached = np.zeros(len(theta), bool)
    for lighting in lightings:
        to_view = _unit(lighting.view - places)
        for light in lighting.lights:
            half = _unit(to_view + _unit(light.position - places))
            cosine = np.clip((half * normal).sum(axis=1), -1, 1)
            reached |= np.arccos(cosine) <= REACH * np.arctan(half_width)
    return float(reached.mean())


def _expected(lighting: Lighting, positions: Array) -> Observations:
    """One shot, of which only the light is known."""
    count, pixels = len(lighting.lights), len(positions)
    white = [np.broadcast_to(t.white.mean(axis=(0, 1)), (pixels, 3)) for t in lighting.lights]
    return Observations(
        logs=np.zeros((1, pixels, 3), np.float32),
        state=np.full((1, pixels), SEEN, np.uint8),
        floor=np.array([DARKNESS * sum(float(w[0].mean()) for w in white)], np.float32),
        sigma=np.full((1, pixels), EVERYWHERE, np.float32),
        positions=positions,
        views=lighting.view[None].astype(np.float32),
        lights=np.stack([light.position for light in lighting.lights]).astype(np.float32),
        shot_of=np.zeros(count, np.int64),
        white=np.stack(white).astype(np.float32),
    )


def _unit(vector: Array) -> Array:
    return np.asarray(vector / np.linalg.norm(vector, axis=-1, keepdims=True), np.float32)


@njit(cache=True, nogil=True, fastmath=True)
def _gain(drawn: Any, covariance: Any, weights: Any, seen: Any, result: Any) -> None:
    """Add the mean over draws and pixels of the weighted fall of variances, channel after channel."""
    paths = np.zeros((seen.lights.shape[0], 10))
    radiance, gradient = np.zeros((1, 3)), np.zeros((1, 3, BY_CHANNEL))
    row, moved = np.zeros(PARAMETERS), np.zeros(PARAMETERS)
    now = np.zeros((PARAMETERS, PARAMETERS))
    total = 0.0
    for pixel in range(seen.positions.shape[0]):
        trace_paths(pixel, seen, paths)
        for draw in range(drawn.shape[0]):
            predict(drawn[draw, pixel], pixel, paths, seen, radiance, gradient)
            now[:] = covariance[pixel]
            for c in range(3):
                base = radiance[0, c] + seen.floor[0]
                row[:] = 0.0
                row[0], row[1] = gradient[0, c, 0] / base, gradient[0, c, 1] / base
                row[2 + c], row[5] = gradient[0, c, 2] / base, gradient[0, c, 3] / base
                row[6] = gradient[0, c, 4] / base
                if c != 1:
                    row[7 if c == 0 else 8] = row[6]
                variance = seen.sigma[0, pixel] * seen.sigma[0, pixel]
                for i in range(PARAMETERS):
                    moved[i] = 0.0
                    for j in range(PARAMETERS):
                        moved[i] += now[i, j] * row[j]
                    variance += moved[i] * row[i]
                for i in range(PARAMETERS):
                    total += weights[i] * moved[i] * moved[i] / variance
                    for j in range(PARAMETERS):
                        now[i, j] -= moved[i] * moved[j] / variance
    result[0] += total / (drawn.shape[0] * seen.positions.shape[0])
