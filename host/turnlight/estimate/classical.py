"""The classical optimisation that the paper compares with, as a baseline: no prior but smoothness.

Adam on the paper's rendering loss (L1 of logs) of all pictures plus total variation, from its
initialisation: the most fronto-parallel picture as diffuse, a flat normal, grey specular. Roughness starts
in the middle and not at zero as there, from where few shots show a way. Coarse to fine, which spares
steps. Lights are taken as exact.
"""

from collections.abc import Sequence
from typing import Any

import cv2
import numpy as np
from numba import njit

from svbrdf.maps import Maps
from turnlight.estimate.brdf_kernel import PARAMETERS, to_maps
from turnlight.estimate.map_kernel import BY_CHANNEL, CLIPPED, UNSEEN, predict, trace_paths
from turnlight.estimate.observations import (
    CHUNK,
    DARKNESS,
    Array,
    Observations,
    in_chunks,
    observe,
    scaled,
)
from turnlight.picture.picture import Picture

START_ROUGHNESS, START_SPECULAR = 0.5, 0.04
LOSS_OFFSET = 0.1
"""Added before the logs of the loss, relative to white."""
VARIATION = 0.005
STEPS = ((4, 500), (2, 300), (1, 200))
"""How much coarser than the result, and Adam's steps there. Of half and all of these steps, RATE once and twice
this, and VARIATION from 0.0002 to 0.06, these gave the best SSIM on training and validation materials."""
RATE, LAST_RATE, BETAS, EPSILON = 0.05, 0.005, (0.9, 0.99), 1e-8
_LIMIT = 7.0


def optimise(pictures: Sequence[Picture], resolution: int) -> Maps:
    """Maps (resolution, resolution, ...) of pictures with known lighting."""
    raw: Array | None = None
    for coarser, steps in STEPS:
        size = max(8, resolution // coarser)
        sized = [scaled(picture, size) for picture in pictures]
        start = _start(sized) if raw is None else _enlarged(raw, size)
        alike = [np.ones((size, size), np.float32)] * len(sized)
        raw = _descend(observe(sized, alike, slice(None)), start, steps)
    assert raw is not None
    return to_maps(_theta(raw))


def _start(pictures: Sequence[Picture]) -> Array:
    """(H, W, 9) of what `_theta` reads."""
    lightings = [p.lighting for p in pictures if p.lighting is not None]
    frontal = [
        g.view[2] / np.linalg.norm(g.view) + _height(g.lights[0].position) for g in lightings
    ]
    best = int(np.argmax(frontal))
    white = sum(light.white for light in lightings[best].lights)
    raw = np.zeros((*pictures[best].image.shape[:2], PARAMETERS), np.float32)
    raw[..., 2:5] = _logit(np.clip(pictures[best].image / white, 0.02, 0.9))
    raw[..., 5] = _logit(np.float32(START_ROUGHNESS))
    raw[..., 6:9] = _logit(np.float32(START_SPECULAR))
    return raw


def _descend(seen: Observations, raw: Array, steps: int) -> Array:
    shape = raw.shape
    first, second = np.zeros(shape, np.float32), np.zeros(shape, np.float32)
    for step in range(1, steps + 1):
        gradient = _data_gradient(seen, raw) + VARIATION * _variation_gradient(raw)
        first += (1 - BETAS[0]) * (gradient - first)
        second += (1 - BETAS[1]) * (gradient**2 - second)
        fast = first / (1 - BETAS[0] ** step)
        size = np.sqrt(second / (1 - BETAS[1] ** step)) + EPSILON
        rate = RATE * (LAST_RATE / RATE) ** (step / steps)
        raw = np.clip(raw - rate * fast / size, -_LIMIT, _LIMIT).astype(np.float32)
    return raw


def _theta(raw: Array) -> Array:
    """brdf_kernel's parameters of slopes and logits (H, W, 9): diffuse, roughness, specular RGB."""
    share = 1 / (1 + np.exp(-raw[..., 2:]))
    logs = np.log(np.maximum(share, 1e-3))
    red, green, blue = logs[..., 4], logs[..., 5], logs[..., 6]
    columns = [*np.moveaxis(raw[..., :2], -1, 0), *np.moveaxis(logs[..., :3], -1, 0)]
    columns += [np.maximum(share[..., 3], 0.03), green, red - green, blue - green]
    return np.stack(columns, axis=-1).astype(np.float32)


def _data_gradient(seen: Observations, raw: Array) -> Array:
    theta = _theta(raw).reshape(-1, PARAMETERS)
    result = np.zeros_like(theta)
    offset = (LOSS_OFFSET / DARKNESS) * seen.floor

    def one(part: slice) -> None:
        here = seen.of_pixels(part)
        _gradients(theta[part], here, offset, result[part])

    in_chunks(one, len(theta), CHUNK)
    share = 1 / (1 + np.exp(-raw.reshape(-1, PARAMETERS)[:, 2:]))
    result[:, 2:5] *= 1 - share[:, :3]
    result[:, 5] *= share[:, 3] * (1 - share[:, 3])
    result[:, 6:] *= 1 - share[:, 4:]
    return result.reshape(raw.shape)


def _variation_gradient(raw: Array) -> Array:
    """Of the sum over neighbours of |difference|."""
    gradient = np.zeros_like(raw)
    across, down = np.tanh(np.diff(raw, axis=1) / 0.02), np.tanh(np.diff(raw, axis=0) / 0.02)
    gradient[:, 1:] += across
    gradient[:, :-1] -= across
    gradient[1:] += down
    gradient[:-1] -= down
    return gradient


def _enlarged(raw: Array, size: int) -> Array:
    planes = [
        cv2.resize(p, (size, size), interpolation=cv2.INTER_LINEAR) for p in np.moveaxis(raw, -1, 0)
    ]
    return np.stack(planes, axis=-1).astype(np.float32)


def _height(position: Array) -> float:
    return float(position[2] / np.linalg.norm(position))


def _logit(share: Array | np.float32) -> Array:
    return np.asarray(np.log(share / (1 - share)), np.float32)


@njit(cache=True, nogil=True, fastmath=True)
def _gradients(theta: Any, seen: Any, offset: Any, result: Any) -> None:
    """result (P, 9): of the mean over values of |ln(model + offset) - ln(picture + offset)|, by slopes,
    logs of diffuse, roughness and logs of specular."""
    shots = seen.logs.shape[0]
    radiance, gradient = np.zeros((shots, 3)), np.zeros((shots, 3, BY_CHANNEL))
    paths = np.zeros((seen.lights.shape[0], 10))
    for pixel in range(theta.shape[0]):
        trace_paths(pixel, seen, paths)
        predict(theta[pixel], pixel, paths, seen, radiance, gradient)
        for k in range(shots):
            if seen.state[k, pixel] == UNSEEN:
                continue
            for c in range(3):
                value = np.exp(seen.logs[k, pixel, c]) - seen.floor[k]
                model = radiance[k, c]
                if seen.state[k, pixel] == CLIPPED and model > value:
                    continue
                scale = (1.0 if model > value else -1.0) / ((model + offset[k]) * 3 * shots)
                result[pixel, 0] += scale * gradient[k, c, 0]
                result[pixel, 1] += scale * gradient[k, c, 1]
                result[pixel, 2 + c] += scale * gradient[k, c, 2]
                result[pixel, 5] += scale * gradient[k, c, 3]
                result[pixel, 6 + c] += scale * gradient[k, c, 4]
