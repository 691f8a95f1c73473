"""Small errors of the calibration, found from the photographs themselves.

Each light's power and direction get a correction with the calibration's own uncertainty as its prior.
All corrections and all materials of a sample of pixels are one least-squares problem; each pixel's nine
parameters are eliminated (Schur complement), as in bundle adjustment.
"""

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import numpy.typing as npt
from numba import njit

from turnlight.estimate.brdf_kernel import PARAMETERS
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
    return replace(seen, lights=moved.astype(np.float32), white=white.astype(np.float32))


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
    _accumulate(
        theta, mean, precision, seen.logs, seen.state, seen.floor, seen.sigma, seen.positions,
        seen.views, seen.lights, shifted, seen.shot_of, seen.white, matrix, slope,
    )  # fmt: skip
    return matrix, slope


def _prior(lights: int) -> npt.NDArray[np.float64]:
    return np.tile([POWER_SIGMA**-2, DIRECTION_SIGMA**-2, DIRECTION_SIGMA**-2], lights)


@njit(cache=True, nogil=True, fastmath=True)
def _accumulate(
    theta: Any, mean: Any, precision: Any, logs: Any, state: Any, floor: Any, sigma: Any,
    positions: Any, views: Any, lights: Any, shifted: Any, shot_of: Any, white: Any, matrix: Any,
    slope: Any,
) -> None:  # fmt: skip
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
            logs,
            state,
            floor,
            sigma,
            positions,
            views,
            lights,
            shifted,
            shot_of,
            white,
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
    theta: Any, pixel: int, mean: Any, precision: Any, logs: Any, state: Any, floor: Any, sigma: Any,
    positions: Any, views: Any, lights: Any, shifted: Any, shot_of: Any, white: Any, hessian: Any,
    gradient_theta: Any, coupling: Any, matrix: Any, slope: Any,
) -> None:  # fmt: skip
    """A pixel's Gauss-Newton matrix (9, 9) and gradient (9,), how the 3 M errors couple to it (3 M, 9),
    and its share of the errors' own matrix (3 M, 3 M) and gradient (3 M,), which is added."""
    shots, count = logs.shape[0], lights.shape[0]
    radiance, gradient = np.zeros((shots, 3)), np.zeros((shots, 3, BY_CHANNEL))
    paths = np.zeros((count, 10))
    trace_paths(pixel, positions, views, lights, shot_of, paths)
    predict(theta, pixel, paths, shot_of, white, radiance, gradient)
    normal_equations(
        theta,
        pixel,
        mean,
        precision,
        logs,
        state,
        floor,
        sigma,
        radiance,
        gradient,
        hessian,
        gradient_theta,
    )
    here, none = np.zeros((3, 1, 3)), np.zeros((1, 0, BY_CHANNEL))
    alone, only = np.zeros(1, np.int64), np.zeros((1, 10))
    derivative = np.zeros((count, 3, ERRORS))
    one_white = np.zeros((1, 1, 3), white.dtype)
    spot, one_light = positions[pixel : pixel + 1], np.zeros((1, 3), lights.dtype)
    for m in range(count):
        one_white[0, 0] = white[m, pixel]
        for variant in range(3):
            one_light[0] = lights[m] if variant == 0 else shifted[variant - 1, m]
            k = shot_of[m]
            trace_paths(0, spot, views[k : k + 1], one_light, alone, only)
            predict(theta, 0, only, alone, one_white, here[variant], none)
        for c in range(3):
            derivative[m, c, 0] = here[0, 0, c]
            derivative[m, c, 1] = (here[1, 0, c] - here[0, 0, c]) / STEP
            derivative[m, c, 2] = (here[2, 0, c] - here[0, 0, c]) / STEP
    coupling[:] = 0.0
    for m in range(count):
        k = shot_of[m]
        if state[k, pixel] == UNSEEN:
            continue
        inverse = 1.0 / (sigma[k] * sigma[k])
        for c in range(3):
            base = radiance[k, c] + floor[k]
            residual = math.log(base) - logs[k, pixel, c]
            grazing = radiance[k, c] < _DARK * floor[k]  # there the logs are far from linear
            if grazing or (state[k, pixel] == CLIPPED and residual > 0.0):
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
                    if shot_of[other] == k:
                        for f in range(ERRORS):
                            column = other * ERRORS + f
                            matrix[row, column] += weighted * derivative[other, c, f] / base
