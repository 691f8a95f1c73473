"""Maximum a posteriori material of each pixel under known lights, compiled.

Residuals are differences of logs, ln(model + floor) - ln(picture + floor), with the noise of a
Student t distribution: a shadow or a reflection that the model does not know counts little. A clipped
value only says that the model must be at least as bright. The prior is Gaussian per parameter.
Levenberg-Marquardt, each pixel on its own.
"""

import math
from typing import Any

import numpy as np
from numba import njit

from turnlight.estimate.brdf_kernel import LOWER, PARAMETERS, UPPER, shade

UNSEEN, SEEN, CLIPPED = 0, 1, 2
FREEDOM = 4.0
"""Of the Student t distribution."""
_FIRST_DAMPING, _WORST_DAMPING, _GOOD_ENOUGH = 1e-2, 1e6, 1e-5


@njit(cache=True, nogil=True)
def fit(
    theta: Any,
    mean: Any,
    precision: Any,
    logs: Any,
    state: Any,
    floor: Any,
    sigma: Any,
    positions: Any,
    views: Any,
    lights: Any,
    shot_of: Any,
    white: Any,
    iterations: int,
    energy: Any,
) -> None:
    """Improve theta (P, 9) in place; energy (P,) is minus the log posterior reached.

    mean, precision (P, 9): of the prior. logs (K, P, 3): ln(picture + floor). state (K, P): UNSEEN,
    SEEN or CLIPPED. floor, sigma (K,): of each shot. positions (P, 2), views (K, 3), lights (M, 3): in
    the sample's frame. shot_of (M,): which shot each light belongs to. white (M, P, 3).
    """
    shots = logs.shape[0]
    radiance, gradient = np.zeros((shots, 3)), np.zeros((shots, 3, PARAMETERS))
    nothing = np.zeros((shots, 0, PARAMETERS))
    step = np.zeros(PARAMETERS)
    trial = np.zeros(PARAMETERS)
    normal_matrix, damped = np.zeros((PARAMETERS, PARAMETERS)), np.zeros((PARAMETERS, PARAMETERS))
    slope = np.zeros(PARAMETERS)
    here = np.zeros(PARAMETERS)
    for pixel in range(theta.shape[0]):
        here[:] = theta[pixel]
        damping = _FIRST_DAMPING
        predict(here, pixel, positions, views, lights, shot_of, white, radiance, gradient)
        cost = _cost(here, pixel, mean, precision, logs, state, floor, sigma, radiance)
        for _ in range(iterations):
            normal_equations(
                here, pixel, mean, precision, logs, state, floor, sigma, radiance, gradient,
                normal_matrix, slope,
            )  # fmt: skip
            better = False
            while damping < _WORST_DAMPING:
                damped[:] = normal_matrix
                for i in range(PARAMETERS):
                    damped[i, i] += damping * (normal_matrix[i, i] + 1e-3)
                    step[i] = -slope[i]
                    held = here[i] <= LOWER[i] and slope[i] > 0 or here[i] >= UPPER[i] and slope[i] < 0
                    if held:
                        for j in range(PARAMETERS):
                            damped[i, j] = 0.0
                            damped[j, i] = 0.0
                        damped[i, i] = 1.0
                        step[i] = 0.0
                solve(damped, step)
                for i in range(PARAMETERS):
                    trial[i] = min(max(here[i] + step[i], LOWER[i]), UPPER[i])
                predict(trial, pixel, positions, views, lights, shot_of, white, radiance, nothing)
                new_cost = _cost(trial, pixel, mean, precision, logs, state, floor, sigma, radiance)
                if new_cost < cost:
                    better = True
                    break
                damping *= 8.0
            if not better:
                break
            here[:] = trial
            gain = cost - new_cost
            cost = new_cost
            damping = max(damping / 8.0, 1e-7)
            if gain < _GOOD_ENOUGH * (1.0 + cost):
                break
            predict(here, pixel, positions, views, lights, shot_of, white, radiance, gradient)
        theta[pixel] = here
        energy[pixel] = cost


@njit(cache=True, nogil=True)
def predict(
    theta: Any, pixel: int, positions: Any, views: Any, lights: Any, shot_of: Any, white: Any,
    radiance: Any, gradient: Any,
) -> None:  # fmt: skip
    """radiance (K, 3) of a pixel in each shot, and its gradient (K, 3, 9) unless that is empty."""
    radiance[:] = 0.0
    gradient[:] = 0.0
    x, y = positions[pixel, 0], positions[pixel, 1]
    to_light, to_view, irradiance = np.empty(3), np.empty(3), np.empty(3)
    for m in range(lights.shape[0]):
        k = shot_of[m]
        direction(views, k, x, y, to_view)
        direction(lights, m, x, y, to_light)
        for c in range(3):
            irradiance[c] = math.pi * white[m, pixel, c]
        shade(theta, to_light, to_view, irradiance, radiance[k], gradient[k])


@njit(cache=True, nogil=True)
def direction(points: Any, index: int, x: float, y: float, unit: Any) -> None:
    """The unit vector from (x, y, 0) to one of points (M, 3)."""
    dx, dy, dz = points[index, 0] - x, points[index, 1] - y, points[index, 2]
    scale = 1.0 / math.sqrt(dx * dx + dy * dy + dz * dz)
    unit[0], unit[1], unit[2] = dx * scale, dy * scale, dz * scale


@njit(cache=True, nogil=True)
def normal_equations(
    theta: Any, pixel: int, mean: Any, precision: Any, logs: Any, state: Any, floor: Any, sigma: Any,
    radiance: Any, gradient: Any, matrix: Any, slope: Any,
) -> None:  # fmt: skip
    """The energy's Gauss-Newton matrix (9, 9) and gradient (9,) at theta."""
    for i in range(PARAMETERS):
        slope[i] = precision[pixel, i] * (theta[i] - mean[pixel, i])
        for j in range(PARAMETERS):
            matrix[i, j] = 0.0
        matrix[i, i] = precision[pixel, i]
    row = np.empty(PARAMETERS)
    for k in range(logs.shape[0]):
        if state[k, pixel] == UNSEEN:
            continue
        inverse = 1.0 / (sigma[k] * sigma[k])
        for c in range(3):
            base = radiance[k, c] + floor[k]
            residual = math.log(base) - logs[k, pixel, c]
            if state[k, pixel] == CLIPPED and residual > 0.0:
                continue
            weight = (FREEDOM + 1.0) / (FREEDOM + residual * residual * inverse) * inverse
            for i in range(PARAMETERS):
                row[i] = gradient[k, c, i] / base
            for i in range(PARAMETERS):
                if row[i] == 0.0:
                    continue
                weighted = weight * row[i]
                slope[i] += weighted * residual
                for j in range(i + 1):
                    matrix[i, j] += weighted * row[j]
    for i in range(PARAMETERS):
        for j in range(i):
            matrix[j, i] = matrix[i, j]


@njit(cache=True, nogil=True)
def _cost(
    theta: Any, pixel: int, mean: Any, precision: Any, logs: Any, state: Any, floor: Any, sigma: Any,
    radiance: Any,
) -> float:  # fmt: skip
    total = 0.0
    for i in range(PARAMETERS):
        total += 0.5 * precision[pixel, i] * (theta[i] - mean[pixel, i]) ** 2
    for k in range(logs.shape[0]):
        if state[k, pixel] == UNSEEN:
            continue
        inverse = 1.0 / (sigma[k] * sigma[k])
        for c in range(3):
            residual = math.log(radiance[k, c] + floor[k]) - logs[k, pixel, c]
            if state[k, pixel] == CLIPPED and residual > 0.0:
                continue
            squared = residual * residual * inverse
            total += 0.5 * (FREEDOM + 1.0) * math.log1p(squared / FREEDOM)
    return total


@njit(cache=True, nogil=True)
def solve(matrix: Any, vector: Any) -> None:
    """Replace vector by matrix^-1 vector; the positive definite matrix becomes its Cholesky factor."""
    n = vector.shape[0]
    for j in range(n):
        for k in range(j):
            matrix[j, j] -= matrix[j, k] * matrix[j, k]
        matrix[j, j] = math.sqrt(max(matrix[j, j], 1e-12))
        for i in range(j + 1, n):
            for k in range(j):
                matrix[i, j] -= matrix[i, k] * matrix[j, k]
            matrix[i, j] /= matrix[j, j]
    for i in range(n):
        for k in range(i):
            vector[i] -= matrix[i, k] * vector[k]
        vector[i] /= matrix[i, i]
    for i in range(n - 1, -1, -1):
        for k in range(i + 1, n):
            vector[i] -= matrix[k, i] * vector[k]
        vector[i] /= matrix[i, i]
