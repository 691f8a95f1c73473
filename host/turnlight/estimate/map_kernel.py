"""Maximum a posteriori material of each pixel under known lights, compiled.

Residuals are differences of logs, ln(model + floor) - ln(picture + floor), with the noise of a
Student t distribution: a shadow or a reflection that the model does not know counts little. A clipped
value only says that the model must be at least as bright. The prior is Gaussian per parameter, but Cauchy
for the slopes. Levenberg-Marquardt, each pixel on its own.
"""

import math
from typing import Any

import numpy as np
from numba import njit

from turnlight.estimate.brdf_kernel import LOWER, PARAMETERS, SLOPE, UPPER, colours, geometry, shade

UNSEEN, SEEN, CLIPPED = 0, 1, 2
FREEDOM = 4.0
"""Of the Student t distribution."""
SLOPES, RELIEF_FREEDOM = SLOPE.stop, 1.0
"""The first parameters, and the freedom of their prior: most pixels are flat, but some are steep."""
BY_CHANNEL = 5
"""Parameters that one channel depends on, in the order of brdf_kernel.shade; its tint is one with its
specular albedo."""
_FIRST_DAMPING, _WORST_DAMPING, _GOOD_ENOUGH = 1e-2, 1e6, 1e-5


@njit(cache=True, nogil=True, fastmath=True)
def fit(theta: Any, mean: Any, precision: Any, seen: Any, iterations: int, energy: Any) -> None:
    """Improve theta (P, 9) in place; energy (P,) is minus the log posterior reached.

    mean, precision (P, 9): of the prior. seen: `Observations`, as in all kernels.
    """
    shots = seen.logs.shape[0]
    radiance, gradient = np.zeros((shots, 3)), np.zeros((shots, 3, BY_CHANNEL))
    no_gradient = np.zeros((shots, 0, BY_CHANNEL))
    paths = np.zeros((seen.lights.shape[0], 10))
    matrix, damped = np.zeros((PARAMETERS, PARAMETERS)), np.zeros((PARAMETERS, PARAMETERS))
    slope, step = np.zeros(PARAMETERS), np.zeros(PARAMETERS)
    here, trial = np.zeros(PARAMETERS), np.zeros(PARAMETERS)
    for pixel in range(theta.shape[0]):
        here[:] = theta[pixel]
        trace_paths(pixel, seen, paths)
        predict(here, pixel, paths, seen, radiance, gradient)
        cost = _cost(here, pixel, mean, precision, seen, radiance)
        damping = _FIRST_DAMPING
        for _ in range(iterations):
            normal_equations(here, pixel, mean, precision, seen, radiance, gradient, matrix, slope)
            before = cost
            while damping < _WORST_DAMPING:
                _damped_step(here, matrix, slope, damping, damped, step)
                for i in range(PARAMETERS):
                    trial[i] = min(max(here[i] + step[i], LOWER[i]), UPPER[i])
                predict(trial, pixel, paths, seen, radiance, no_gradient)
                after = _cost(trial, pixel, mean, precision, seen, radiance)
                if after < cost:
                    here[:], cost = trial, after
                    damping = max(damping / 8.0, 1e-7)
                    break
                damping *= 8.0
            if before - cost < _GOOD_ENOUGH * (1.0 + cost):
                break
            predict(here, pixel, paths, seen, radiance, gradient)
        theta[pixel] = here
        energy[pixel] = cost


@njit(cache=True, nogil=True, fastmath=True)
def trace_paths(pixel: int, seen: Any, paths: Any) -> None:
    """paths (M, 10): `brdf_kernel.geometry` of every light at a pixel."""
    for m in range(seen.lights.shape[0]):
        geometry(seen.positions[pixel], seen.lights[m], seen.views[seen.shot_of[m]], paths[m])


@njit(cache=True, nogil=True, fastmath=True)
def predict(theta: Any, pixel: int, paths: Any, seen: Any, radiance: Any, gradient: Any) -> None:
    """radiance (K, 3) of a pixel in each shot, and its gradient (K, 3, 5) unless that is empty."""
    radiance[:] = 0.0
    gradient[:] = 0.0
    albedo, irradiance = np.empty(6), np.empty(3)
    colours(theta, albedo)
    for m in range(seen.shot_of.shape[0]):
        k = seen.shot_of[m]
        for c in range(3):
            irradiance[c] = math.pi * seen.white[m, pixel, c]
        shade(theta, albedo, paths[m], irradiance, radiance[k], gradient[k])


@njit(cache=True, nogil=True, fastmath=True)
def normal_equations(
    theta: Any, pixel: int, mean: Any, precision: Any, seen: Any, radiance: Any, gradient: Any, matrix: Any,
    slope: Any,
) -> None:  # fmt: skip
    """The energy's Gauss-Newton matrix (9, 9) and gradient (9,) at theta."""
    matrix[:] = 0.0
    for i in range(PARAMETERS):
        off, weight = theta[i] - mean[pixel, i], precision[pixel, i]
        if i < SLOPES:
            weight *= (RELIEF_FREEDOM + 1.0) / (RELIEF_FREEDOM + precision[pixel, i] * off * off)
        slope[i], matrix[i, i] = weight * off, weight
    row, place = np.empty(6), np.array([0, 1, 0, 5, 6, 0])
    for k in range(seen.logs.shape[0]):
        if seen.state[k, pixel] == UNSEEN:
            continue
        inverse = 1.0 / (seen.sigma[k, pixel] * seen.sigma[k, pixel])
        for c in range(3):
            base = radiance[k, c] + seen.floor[k]
            residual = math.log(base) - seen.logs[k, pixel, c]
            if seen.state[k, pixel] == CLIPPED and residual > 0.0:
                continue
            weight = (FREEDOM + 1.0) / (FREEDOM + residual * residual * inverse) * inverse
            place[2], place[5] = 2 + c, 7 if c == 0 else 8
            size = 5 if c == 1 else 6
            for i in range(5):
                row[i] = gradient[k, c, i] / base
            row[5] = row[4]
            for i in range(size):
                weighted = weight * row[i]
                slope[place[i]] += weighted * residual
                for j in range(i + 1):
                    matrix[place[i], place[j]] += weighted * row[j]
    for i in range(PARAMETERS):
        for j in range(i):
            matrix[j, i] = matrix[i, j]


@njit(cache=True, nogil=True, fastmath=True)
def _damped_step(
    here: Any, matrix: Any, slope: Any, damping: float, damped: Any, step: Any
) -> None:
    """Levenberg's step; parameters that press against their range stay."""
    for i in range(PARAMETERS):
        for j in range(PARAMETERS):
            damped[i, j] = matrix[i, j]
        damped[i, i] += damping * (matrix[i, i] + 1e-3)
        step[i] = -slope[i]
    for i in range(PARAMETERS):
        low, high = here[i] <= LOWER[i], here[i] >= UPPER[i]
        if (low and slope[i] > 0.0) or (high and slope[i] < 0.0):
            damped[i, :] = 0.0
            damped[:, i] = 0.0
            damped[i, i] = 1.0
            step[i] = 0.0
    solve(damped, step)


@njit(cache=True, nogil=True, fastmath=True)
def _cost(theta: Any, pixel: int, mean: Any, precision: Any, seen: Any, radiance: Any) -> float:
    total = 0.0
    for i in range(PARAMETERS):
        square = precision[pixel, i] * (theta[i] - mean[pixel, i]) ** 2
        if i < SLOPES:
            square = (RELIEF_FREEDOM + 1.0) * math.log(1.0 + square / RELIEF_FREEDOM)
        total += 0.5 * square
    for k in range(seen.logs.shape[0]):
        if seen.state[k, pixel] == UNSEEN:
            continue
        inverse = 1.0 / (seen.sigma[k, pixel] * seen.sigma[k, pixel] * FREEDOM)
        product = 1.0
        for c in range(3):
            residual = math.log(radiance[k, c] + seen.floor[k]) - seen.logs[k, pixel, c]
            if seen.state[k, pixel] != CLIPPED or residual < 0.0:
                product *= 1.0 + residual * residual * inverse
        total += 0.5 * (FREEDOM + 1.0) * math.log(product)
    return total


@njit(cache=True, nogil=True, fastmath=True)
def solve(matrix: Any, vector: Any) -> None:
    """Replace vector by matrix^-1 vector; the positive definite matrix becomes its Cholesky factor."""
    n = vector.shape[0]
    for j in range(n):
        for i in range(j, n):
            total = matrix[i, j]
            for k in range(j):
                total -= matrix[i, k] * matrix[j, k]
            if i == j:
                matrix[j, j] = math.sqrt(max(total, 1e-12))
            else:
                matrix[i, j] = total / matrix[j, j]
    for i in range(n):
        total = vector[i]
        for k in range(i):
            total -= matrix[i, k] * vector[k]
        vector[i] = total / matrix[i, i]
    for i in range(n - 1, -1, -1):
        total = vector[i]
        for k in range(i + 1, n):
            total -= matrix[k, i] * vector[k]
        vector[i] = total / matrix[i, i]


@njit(cache=True, nogil=True, fastmath=True)
def precisions(theta: Any, mean: Any, precision: Any, seen: Any, result: Any) -> None:
    """result (P, 9, 9): the posterior's Gauss-Newton matrix at theta, prior included."""
    shots = seen.logs.shape[0]
    radiance, gradient = np.zeros((shots, 3)), np.zeros((shots, 3, BY_CHANNEL))
    paths, slope = np.zeros((seen.lights.shape[0], 10)), np.zeros(PARAMETERS)
    matrix = np.zeros((PARAMETERS, PARAMETERS))
    for pixel in range(theta.shape[0]):
        trace_paths(pixel, seen, paths)
        predict(theta[pixel], pixel, paths, seen, radiance, gradient)
        normal_equations(
            theta[pixel], pixel, mean, precision, seen, radiance, gradient, matrix, slope
        )
        result[pixel] = matrix


@njit(cache=True, nogil=True, fastmath=True)
def predictions(theta: Any, seen: Any, result: Any) -> None:
    """result (K, P, 3): ln(model + floor)."""
    shots = seen.floor.shape[0]
    radiance, no_gradient = np.zeros((shots, 3)), np.zeros((shots, 0, BY_CHANNEL))
    paths = np.zeros((seen.lights.shape[0], 10))
    for pixel in range(theta.shape[0]):
        trace_paths(pixel, seen, paths)
        predict(theta[pixel], pixel, paths, seen, radiance, no_gradient)
        for k in range(shots):
            for c in range(3):
                result[k, pixel, c] = math.log(radiance[k, c] + seen.floor[k])
