"""Small errors of the calibration, found from the photographs themselves.

Each light's power and direction get a correction with the calibration's own uncertainty as its prior.
All corrections and all materials of a sample of pixels are one least-squares problem; each pixel's nine
parameters are eliminated (Schur complement), as in bundle adjustment.
"""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
from numba import njit

from turnlight.estimate.brdf_kernel import PARAMETERS, colours, geometry, shade
from turnlight.estimate.map_kernel import (
    BY_CHANNEL,
    CLIPPED,
    FREEDOM,
    UNSEEN,
    normal_equations,
    predict,
    solve,
    trace_paths,
)
from turnlight.estimate.observations import Array, Observations

POWER_SIGMA = 0.02
DIRECTION_SIGMA = math.radians(1.0) / math.sqrt(2)
"""Of the calibration: of ln(power), and of each of a direction's two angles."""
ERRORS = 3
"""Per light: ln(power), and the light's angle along its two tangents."""
_CORRELATED = 30.0
"""Neighbouring pixels err alike (misalignment, filtering): as many of them count as one."""
STEP = 1e-3
"""Of a light's angle, for finite differences."""
_DARK = 4.0


@dataclass(frozen=True)
class Corrections:
    """values (M, 3): power_log and angles in radians to add, per light; covariance (3 M, 3 M)."""

    values: Array
    covariance: npt.NDArray[np.float64]


def unknown_errors(lights: int) -> Corrections:
    """No corrections, and the calibration's own uncertainty."""
    return Corrections(np.zeros((lights, ERRORS), np.float32), np.diag(1 / _prior(lights)))


def corrected(seen: Observations, corrections: Corrections) -> Observations:
    """The observations with every light's power and direction corrected."""
    values = corrections.values
    first, second = tangents(seen.lights)
    moved = seen.lights + values[:, 1:2] * first + values[:, 2:3] * second
    length = np.linalg.norm(seen.lights, axis=-1, keepdims=True)
    moved *= length / np.linalg.norm(moved, axis=-1, keepdims=True)
    white = seen.white * np.exp(values[:, 0])[:, None, None]
    return seen._replace(lights=moved.astype(np.float32), white=white.astype(np.float32))


def improve(
    nominal: Observations, corrections: Corrections, theta: Array, mean: Array, precision: Array
) -> Corrections:
    """One Gauss-Newton step of the corrections, from the maximum a posteriori theta (P, 9)."""
    seen = corrected(nominal, corrections)
    matrix, slope = reduced_equations(seen, theta, mean, precision)
    prior = _prior(len(seen.lights))
    matrix = matrix / _CORRELATED + np.diag(prior)
    slope = slope / _CORRELATED + prior * corrections.values.ravel()
    covariance = np.asarray(np.linalg.inv(matrix), np.float64)
    step = -(covariance @ slope).reshape(-1, ERRORS)
    limit = 2 / np.sqrt(prior).reshape(-1, ERRORS)
    return Corrections(
        (corrections.values + np.clip(step, -limit, limit)).astype(np.float32), covariance
    )


def tangents(lights: Array) -> tuple[Array, Array]:
    """(M, 3) each: what a radian along either angle moves the lights by."""
    up = np.array([0.0, 0.0, 1.0])
    first = np.cross(up, lights)
    short = np.linalg.norm(first, axis=-1, keepdims=True) < 1e-6
    first = np.where(short, np.array([1.0, 0.0, 0.0]), first)
    length = np.linalg.norm(lights, axis=-1, keepdims=True)
    first = first / np.linalg.norm(first, axis=-1, keepdims=True) * length
    second = np.cross(lights / length, first)
    return first.astype(np.float32), second.astype(np.float32)


def reduced_equations(
    seen: Observations, theta: Array, mean: Array, precision: Array
) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]:
    """The Gauss-Newton matrix (3 M, 3 M) and gradient (3 M,) of the errors, materials eliminated."""
    count = ERRORS * len(seen.lights)
    matrix, slope = np.zeros((count, count)), np.zeros(count)
    first, second = tangents(seen.lights)
    shifted = np.stack([seen.lights + STEP * first, seen.lights + STEP * second])
    _accumulate(theta, mean, precision, seen, shifted, matrix, slope)
    return matrix, slope


def _prior(lights: int) -> npt.NDArray[np.float64]:
    return np.tile([POWER_SIGMA**-2, DIRECTION_SIGMA**-2, DIRECTION_SIGMA**-2], lights)


@njit(cache=True, nogil=True, fastmath=True)
def _accumulate(
    theta: Any, mean: Any, precision: Any, seen: Any, shifted: Any, matrix: Any, slope: Any
) -> None:
    count = matrix.shape[0]
    coupling, solved = np.zeros((count, PARAMETERS)), np.zeros(PARAMETERS)
    hessian, gradient_theta = np.zeros((PARAMETERS, PARAMETERS)), np.zeros(PARAMETERS)
    factor = np.zeros((PARAMETERS, PARAMETERS))
    for pixel in range(theta.shape[0]):
        couple(
            theta[pixel],
            pixel,
            mean,
            precision,
            seen,
            shifted,
            hessian,
            gradient_theta,
            coupling,
            matrix,
            slope,
        )
        for i in range(count):
            factor[:] = hessian
            solved[:] = coupling[i]
            solve(factor, solved)
            for p in range(PARAMETERS):
                slope[i] -= solved[p] * gradient_theta[p]
            for j in range(count):
                for p in range(PARAMETERS):
                    matrix[i, j] -= solved[p] * coupling[j, p]


@njit(cache=True, nogil=True, fastmath=True)
def couple(  # noqa: PLR0912
    theta: Any, pixel: int, mean: Any, precision: Any, seen: Any, shifted: Any, hessian: Any,
    gradient_theta: Any, coupling: Any, matrix: Any, slope: Any,
) -> None:  # fmt: skip
    """A pixel's Gauss-Newton matrix (9, 9) and gradient (9,), how the 3 M errors couple to it (3 M, 9),
    and its share of the errors' own matrix (3 M, 3 M) and gradient (3 M,), which is added."""
    shots, count = seen.logs.shape[0], seen.lights.shape[0]
    radiance, gradient = np.zeros((shots, 3)), np.zeros((shots, 3, BY_CHANNEL))
    paths = np.zeros((count, 10))
    trace_paths(pixel, seen, paths)
    predict(theta, pixel, paths, seen, radiance, gradient)
    normal_equations(
        theta, pixel, mean, precision, seen, radiance, gradient, hessian, gradient_theta
    )
    here, none = np.zeros((3, 3)), np.zeros((0, BY_CHANNEL))
    path, albedo, irradiance = np.empty(10), np.empty(6), np.empty(3)
    derivative = np.zeros((count, 3, ERRORS))
    colours(theta, albedo)
    for m in range(count):
        for c in range(3):
            irradiance[c] = math.pi * seen.white[m, pixel, c]
        for variant in range(3):
            light = seen.lights[m] if variant == 0 else shifted[variant - 1, m]
            geometry(seen.positions[pixel], light, seen.views[seen.shot_of[m]], path)
            here[variant] = 0.0
            shade(theta, albedo, path, irradiance, here[variant], none)
        for c in range(3):
            derivative[m, c, 0] = here[0, c]
            derivative[m, c, 1] = (here[1, c] - here[0, c]) / STEP
            derivative[m, c, 2] = (here[2, c] - here[0, c]) / STEP
    coupling[:] = 0.0
    for m in range(count):
        k = seen.shot_of[m]
        if seen.state[k, pixel] == UNSEEN:
            continue
        inverse = 1.0 / (seen.sigma[k, pixel] * seen.sigma[k, pixel])
        for c in range(3):
            base = radiance[k, c] + seen.floor[k]
            residual = math.log(base) - seen.logs[k, pixel, c]
            grazing = radiance[k, c] < _DARK * seen.floor[k]  # there the logs are far from linear
            if grazing or (seen.state[k, pixel] == CLIPPED and residual > 0.0):
                continue
            weight = (FREEDOM + 1.0) / (FREEDOM + residual * residual * inverse) * inverse
            for e in range(ERRORS):
                row = m * ERRORS + e
                weighted = weight * derivative[m, c, e] / base
                slope[row] += weighted * residual
                coupling[row, 0] += weighted * gradient[k, c, 0] / base
                coupling[row, 1] += weighted * gradient[k, c, 1] / base
                coupling[row, 2 + c] += weighted * gradient[k, c, 2] / base
                coupling[row, 5] += weighted * gradient[k, c, 3] / base
                coupling[row, 6] += weighted * gradient[k, c, 4] / base
                if c == 0:
                    coupling[row, 7] += weighted * gradient[k, c, 4] / base
                elif c == 2:
                    coupling[row, 8] += weighted * gradient[k, c, 4] / base
                for other in range(count):
                    if seen.shot_of[other] == k:
                        for f in range(ERRORS):
                            column = other * ERRORS + f
                            matrix[row, column] += weighted * derivative[other, c, f] / base
