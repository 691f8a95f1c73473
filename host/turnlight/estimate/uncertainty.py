"""How far the refined maps may be off, per pixel and parameter.

The Laplace approximation of each pixel's posterior, and on top what the lights' remaining errors do to
it (Schur complement of self_calibration). That leaves out what most errors come from, resampling and
misalignment, so `half_width` turns it into intervals that held half and 95 % of the true errors on
materials of the training and validation splits.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
from numba import njit

from turnlight.estimate.brdf_kernel import PARAMETERS, ROUGHNESS
from turnlight.estimate.map_kernel import solve
from turnlight.estimate.observations import CHUNK, Array, Observations, in_chunks
from turnlight.estimate.self_calibration import ERRORS, STEP, Corrections, couple, tangents

Fifths = tuple[float, float, float, float, float]


@dataclass(frozen=True)
class Uncertainty:
    """Standard deviations as the fit sees them, in the maps' units; `half_width` says what they hold.

    slopes (H, W, 3): variances of nx/nz and ny/nz and their covariance. diffuse (H, W, 3), roughness
    (H, W, 1), specular (H, W, 3): standard deviations.
    """

    slopes: Array
    diffuse: Array
    roughness: Array
    specular: Array


INTERVALS: dict[str, tuple[Fifths, dict[int, Fifths]]] = {
    "normal": (
        (0.00377, 0.00454, 0.00533, 0.00706, 0.00926),
        {
            50: (0.00715, 0.00715, 0.00872, 0.0137, 0.0289),
            95: (0.0195, 0.0195, 0.0338, 0.0823, 0.161),
        },
    ),
    "diffuse": (
        (0.000907, 0.00183, 0.00291, 0.0046, 0.00949),
        {
            50: (0.00247, 0.00267, 0.00267, 0.00607, 0.0124),
            95: (0.00514, 0.00878, 0.0108, 0.0321, 0.0347),
        },
    ),
    "roughness": (
        (0.00585, 0.0103, 0.0176, 0.0262, 0.0414),
        {50: (0.0226, 0.0226, 0.0372, 0.0389, 0.0683), 95: (0.0429, 0.0928, 0.126, 0.152, 0.425)},
    ),
    "specular": (
        (0.00122, 0.00133, 0.00228, 0.00404, 0.0312),
        {
            50: (0.000555, 0.000983, 0.00375, 0.00558, 0.0741),
            95: (0.0422, 0.0422, 0.0422, 0.0422, 0.319),
        },
    ),
}
"""Medians of the fifths of stated deviations, and half of the intervals that held 50 and 95 % of errors
there: 13 training and validation materials through the simulated rig, ten shots, calibration off by its
tolerances (`turnlight.study_uncertainty --fit`). Of a normal: `radius` of its ellipse."""
SHARES = (50, 95)


def radius(slopes: Array) -> Array:
    """(..., 1) geometric mean of the axes of ellipses in slope space, from `Uncertainty.slopes`."""
    p, q, both = slopes[..., :1], slopes[..., 1:2], slopes[..., 2:]
    return np.asarray(np.maximum(p * q - both**2, 1e-20) ** 0.25, np.float32)


def half_width(stated: Array, name: str, share: int) -> Array:
    """Half of the interval that holds `share` (50 or 95) % of errors where the fit states a deviation.

    name: of the map; for "normal", stated is the ellipse's `radius`.
    """
    widths, halves = INTERVALS[name]
    logs = np.log(np.maximum(stated, 1e-9))
    result = np.exp(np.interp(logs, np.log(widths), np.log(halves[share])))
    return np.asarray(result, np.float32)


def uncertainty(
    exact: Observations,
    theta: Array,
    mean: Array,
    precision: Array,
    corrections: Corrections,
    resolution: tuple[int, int],
) -> Uncertainty:
    """Of the fit theta (P, 9) of corrected observations, under the prior of mean and precision (P, 9)."""
    covariance = posterior(exact, theta, mean, precision, corrections)
    diffuse = np.minimum(np.exp(theta[:, 2:5]), 1)
    shown = np.exp(theta[:, 6:7] + np.stack([theta[:, 7], 0 * theta[:, 7], theta[:, 8]], axis=-1))
    deviation = np.sqrt(np.maximum(np.diagonal(covariance, axis1=1, axis2=2), 0))
    slopes = np.stack([covariance[:, 0, 0], covariance[:, 1, 1], covariance[:, 0, 1]], axis=-1)
    parts = (
        slopes,
        diffuse * deviation[:, 2:5],
        deviation[:, ROUGHNESS, None],
        np.minimum(shown, 1) * np.sqrt(_specular_variance(covariance)),
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
