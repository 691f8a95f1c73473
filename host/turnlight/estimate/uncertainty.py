"""How far the refined maps may be off, per pixel and parameter.

The Laplace approximation of each pixel's posterior, and on top what the lights' remaining errors do to
it (Schur complement of self_calibration). That leaves out what most errors come from, resampling and
misalignment, of which a session's own relighting error tells. What all pixels of a group have in common may be
off as well, most of all the specular albedo they are drawn to, and roughness with it. `half_width` turns the
result into intervals that held half and 95 % of the true errors on materials of the training and validation
splits.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
from numba import njit

from turnlight.estimate.brdf_kernel import PARAMETERS, ROUGHNESS
from turnlight.estimate.map_kernel import solve
from turnlight.estimate.observations import CHUNK, Array, Observations, in_chunks
from turnlight.estimate.pooled_prior import GLOSS
from turnlight.estimate.self_calibration import ERRORS, STEP, Corrections, couple, tangents

Fifths = tuple[float, float, float, float, float]


@dataclass(frozen=True)
class Uncertainty:
    """Standard deviations in the maps' units; `half_width` says what they hold.

    slopes (H, W, 3): variances of nx/nz and ny/nz and their covariance. diffuse (H, W, 3), roughness
    (H, W, 1), specular (H, W, 3): standard deviations.
    """

    slopes: Array
    diffuse: Array
    roughness: Array
    specular: Array


USUAL_ERROR, LEAST_ERROR = 0.004, 0.0005
"""Relighting errors of a session: the usual one, and the least that is believed."""
INTERVALS: dict[str, tuple[Fifths, dict[int, Fifths]]] = {
    "normal": (
        (0.00135, 0.00261, 0.00454, 0.00674, 0.0137),
        {
            50: (0.00268, 0.00714, 0.00847, 0.0132, 0.0247),
            95: (0.0112, 0.0205, 0.0289, 0.0674, 0.143),
        },
    ),
    "diffuse": (
        (0.00111, 0.00173, 0.00258, 0.00379, 0.00977),
        {
            50: (0.00141, 0.00226, 0.00349, 0.00615, 0.00636),
            95: (0.00687, 0.0115, 0.0115, 0.0309, 0.0642),
        },
    ),
    "roughness": (
        (0.00642, 0.0112, 0.0155, 0.0205, 0.0313),
        {
            50: (0.0109, 0.0132, 0.0141, 0.021, 0.041),
            95: (0.0821, 0.1, 0.128, 0.159, 0.419),
        },
    ),
    "specular": (
        (0.0011, 0.0012, 0.00125, 0.0013, 0.00789),
        {
            50: (0.0014, 0.0014, 0.0014, 0.00193, 0.0464),
            95: (0.02, 0.02, 0.02, 0.02, 0.394),
        },
    ),
}
"""Medians of the fifths of stated deviations, and half of the intervals that hold 50 and 95 % of errors
there on materials left out in turn (of specular albedo, on all): 24 training and validation materials, eleven
of them procedural, through the simulated rig, ten shots, one draw of calibration errors
(`turnlight.study_uncertainty --fit --draws 1`). Of a normal: `radius` of its ellipse."""
SHARES = (50, 95)


def radius(slopes: Array) -> Array:
    """(..., 1) geometric mean of the axes of ellipses in slope space, from `Uncertainty.slopes`."""
    p, q, both = slopes[..., :1], slopes[..., 1:2], slopes[..., 2:]
    return np.asarray(np.maximum(p * q - both**2, 1e-20) ** 0.25, np.float32)


def proportion_of(relighting_error: float | None) -> float:
    """Of a session's deviations to the usual ones, by how far its left-out shots are from their predictions;
    None if that is not known."""
    known = USUAL_ERROR if relighting_error is None else relighting_error
    return max(known, LEAST_ERROR) / USUAL_ERROR


def half_width(stated: Array, name: str, share: int) -> Array:
    """Half of the interval that holds `share` (50 or 95) % of errors where the fit states a deviation.

    name: of the map; for "normal", stated is the ellipse's `radius`.
    """
    widths, halves = INTERVALS[name]
    return between(stated, widths, halves[share])


def between(stated: Array, widths: Sequence[float], halves: Sequence[float]) -> Array:
    """halves at the stated deviations, interpolated in logs from those at `widths`."""
    logs = np.log(np.maximum(stated, 1e-9))
    result = np.exp(np.interp(logs, np.log(widths), np.log(halves)))
    return np.asarray(result, np.float32)


def uncertainty(
    exact: Observations,
    theta: Array,
    mean: Array,
    precision: Array,
    corrections: Corrections,
    doubts: Array,
    proportion: float,
    resolution: tuple[int, int],
) -> Uncertainty:
    """Of the fit theta (P, 9) of corrected observations, under the prior of mean and precision (P, 9).

    doubts (P, 2, 2): how far the prior's mean of roughness and specular albedo may be off. proportion: to
    other sessions' deviations. Neither is for the specular map, whose errors come from what no shot shows
    and whose intervals have room for all of nature's dielectrics.
    """
    alone = posterior(exact, theta, mean, precision, corrections)
    drawn = alone[:, :, GLOSS] * precision[:, None, GLOSS]
    shared = np.einsum("pik,pkl,pjl->pij", drawn, doubts, drawn, optimize=True)
    covariance = np.float32(proportion**2) * alone + shared
    diffuse = np.minimum(np.exp(theta[:, 2:5]), 1)
    shown = np.exp(theta[:, 6:7] + np.stack([theta[:, 7], 0 * theta[:, 7], theta[:, 8]], axis=-1))
    deviation = np.sqrt(np.maximum(np.diagonal(covariance, axis1=1, axis2=2), 0))
    slopes = np.stack([covariance[:, 0, 0], covariance[:, 1, 1], covariance[:, 0, 1]], axis=-1)
    parts = (
        slopes,
        diffuse * deviation[:, 2:5],
        deviation[:, ROUGHNESS, None],
        np.minimum(shown, 1) * np.sqrt(_specular_variance(alone)),
    )
    return Uncertainty(*(np.asarray(p, np.float32).reshape(*resolution, -1) for p in parts))


def posterior(
    exact: Observations, theta: Array, mean: Array, precision: Array, corrections: Corrections
) -> npt.NDArray[np.float32]:
    """(P, 9, 9) covariance of each pixel's parameters."""
    first, second = tangents(exact.lights)
    shifted = np.stack([exact.lights + STEP * first, exact.lights + STEP * second])
    result = np.zeros((len(theta), PARAMETERS, PARAMETERS), np.float32)

    def one(part: slice) -> None:
        here = exact.of_pixels(part)
        _covariances(
            theta[part],
            mean[part],
            precision[part],
            here,
            shifted,
            corrections.covariance,
            result[part],
        )

    in_chunks(one, len(theta), CHUNK)
    return result


def _specular_variance(covariance: npt.NDArray[np.float32]) -> npt.NDArray[np.float32]:
    """(P, 3) variances of the logs of red, green and blue specular albedo."""
    green = covariance[:, 6, 6]
    red = green + covariance[:, 7, 7] + 2 * covariance[:, 6, 7]
    blue = green + covariance[:, 8, 8] + 2 * covariance[:, 6, 8]
    return np.maximum(np.stack([red, green, blue], axis=-1), 0)


@njit(cache=True, nogil=True, fastmath=True)
def _covariances(
    theta: Any,
    mean: Any,
    precision: Any,
    seen: Any,
    shifted: Any,
    lights_covariance: Any,
    result: Any,
) -> None:
    count = ERRORS * seen.lights.shape[0]
    matrix, slope = np.zeros((count, count)), np.zeros(count)
    coupling, gain = np.zeros((count, PARAMETERS)), np.zeros((count, PARAMETERS))
    hessian, gradient = np.zeros((PARAMETERS, PARAMETERS)), np.zeros(PARAMETERS)
    factor, column = np.zeros((PARAMETERS, PARAMETERS)), np.zeros(PARAMETERS)
    inverse, spread = np.zeros((PARAMETERS, PARAMETERS)), np.zeros((count, PARAMETERS))
    for pixel in range(theta.shape[0]):
        couple(
            theta[pixel],
            pixel,
            mean,
            precision,
            seen,
            shifted,
            hessian,
            gradient,
            coupling,
            matrix,
            slope,
        )
        for i in range(PARAMETERS):
            factor[:] = hessian
            column[:] = 0.0
            column[i] = 1.0
            solve(factor, column)
            inverse[i] = column
        _product(coupling, inverse, gain)
        _product(lights_covariance, gain, spread)
        for i in range(PARAMETERS):
            for j in range(PARAMETERS):
                total = inverse[i, j]
                for k in range(count):
                    total += gain[k, i] * spread[k, j]
                result[pixel, i, j] = total


@njit(cache=True, nogil=True, fastmath=True)
def _product(a: Any, b: Any, result: Any) -> None:
    for i in range(a.shape[0]):
        for j in range(b.shape[1]):
            result[i, j] = 0.0
            for k in range(b.shape[0]):
                result[i, j] += a[i, k] * b[k, j]
