"""The BRDF of svbrdf.renderer for one pixel, compiled, with its derivatives.

A pixel's material is nine numbers, `PARAMETERS` in order: the slopes nx/nz and ny/nz of its normal, the
logs of its diffuse albedo, its roughness, the log of its green specular albedo, and how much the logs of
red and blue lie above that. All are unbounded but for the ranges in LOWER and UPPER; nothing solid has a
specular albedo below 0.02, but a fit whose other errors ask for it would go there.
"""

import math
from typing import Any

import numpy as np
import numpy.typing as npt
from numba import njit

from svbrdf.maps import Maps
from svbrdf.renderer import COSINE_FLOOR, ROUGHNESS_FLOOR

Array = npt.NDArray[np.float32]
PARAMETERS = 9
SLOPE, DIFFUSE, ROUGHNESS, SPECULAR, TINT = slice(0, 2), slice(2, 5), 5, 6, slice(7, 9)
LOWER = np.array([-3, -3, *[math.log(2e-5)] * 3, ROUGHNESS_FLOOR, math.log(0.02), -1.5, -2.0])
UPPER = np.array([3, 3, *[math.log(1.2)] * 3, 1.0, math.log(1.0), 1.5, 1.5])


def from_maps(maps: Maps) -> Array:
    """(H, W, 9) parameters of maps."""
    slopes = maps.normal[..., :2] / np.maximum(maps.normal[..., 2:], 0.1)
    diffuse = np.log(np.maximum(maps.diffuse, math.exp(LOWER[2])))
    specular = np.log(np.clip(maps.specular, 0.01, 1.0))
    green = specular[..., 1:2]
    tint = np.concatenate([specular[..., :1] - green, specular[..., 2:] - green], axis=-1)
    theta = np.concatenate([slopes, diffuse, maps.roughness, green, tint], axis=-1)
    return np.clip(theta, LOWER, UPPER).astype(np.float32)


def to_maps(theta: Array) -> Maps:
    """Maps of (H, W, 9) parameters."""
    normal = np.concatenate([theta[..., :2], np.ones_like(theta[..., :1])], axis=-1)
    normal /= np.linalg.norm(normal, axis=-1, keepdims=True)
    green = theta[..., 6:7]
    specular = np.exp(
        np.concatenate([green + theta[..., 7:8], green, green + theta[..., 8:9]], axis=-1)
    )
    return Maps(
        normal.astype(np.float32),
        np.minimum(np.exp(theta[..., 2:5]), 1.0),
        theta[..., 5:6].copy(),
        np.minimum(specular, 1.0),
    )


@njit(cache=True, nogil=True, fastmath=True)
def geometry(position: Any, light: Any, view: Any, directions: Any) -> None:
    """What of one light's path does not depend on the material: directions (10,) of a pixel at (x, y).

    Unit vectors toward the light, the viewer and halfway, and the weight of Schlick's Fresnel term.
    """
    for start, point in ((0, light), (3, view)):
        dx, dy, dz = point[0] - position[0], point[1] - position[1], point[2]
        scale = 1.0 / math.sqrt(dx * dx + dy * dy + dz * dz)
        directions[start] = dx * scale
        directions[start + 1] = dy * scale
        directions[start + 2] = dz * scale
    total, v_h = 0.0, 0.0
    for i in range(3):
        directions[6 + i] = directions[i] + directions[3 + i]
        total += directions[6 + i] ** 2
    scale = 1.0 / math.sqrt(total)
    for i in range(6, 9):
        directions[i] *= scale
        v_h += directions[i] * directions[i - 3]
    v_h = max(v_h, COSINE_FLOOR)
    directions[9] = 2.0 ** ((-5.55473 * v_h - 6.98316) * v_h)


@njit(cache=True, nogil=True, fastmath=True)
def colours(theta: Any, albedo: Any) -> None:
    """albedo (6,): the diffuse albedo over pi and the specular albedo of parameters theta (9,)."""
    for c in range(3):
        albedo[c] = math.exp(theta[2 + c]) / math.pi
    albedo[3] = min(math.exp(theta[6] + theta[7]), 1.0)
    albedo[4] = min(math.exp(theta[6]), 1.0)
    albedo[5] = min(math.exp(theta[6] + theta[8]), 1.0)


@njit(cache=True, nogil=True, fastmath=True)
def shade(
    theta: Any, albedo: Any, directions: Any, irradiance: Any, radiance: Any, gradient: Any
) -> None:
    """Add one light's radiance (3,), and its derivatives (3, 5) unless gradient is empty, (0, 5).

    albedo: `colours` of theta. directions: `geometry` of the light. irradiance (3,): of a patch that
    faces the light. The derivatives of a channel are those by both slopes, its own diffuse, the
    roughness and its own specular.
    """
    lx, ly, lz = directions[0], directions[1], directions[2]
    vx, vy, vz = directions[3], directions[4], directions[5]
    hx, hy, hz = directions[6], directions[7], directions[8]
    x = directions[9]
    shorten = 1.0 / math.sqrt(1.0 + theta[0] * theta[0] + theta[1] * theta[1])
    nx, ny = theta[0] * shorten, theta[1] * shorten
    cosine = nx * lx + ny * ly + shorten * lz
    if cosine <= 0.0:
        return
    raw_h, raw_v = nx * hx + ny * hy + shorten * hz, nx * vx + ny * vy + shorten * vz
    n_l, n_v = max(cosine, COSINE_FLOOR), max(raw_v, COSINE_FLOOR)
    n_h = min(max(raw_h, COSINE_FLOOR), 1.0)
    rough = max(theta[5], ROUGHNESS_FLOOR)
    alpha = rough * rough
    alpha2, k = alpha * alpha, alpha / 2
    t = n_h * n_h * (alpha2 - 1.0) + 1.0
    a, b = n_l * (1.0 - k) + k, n_v * (1.0 - k) + k
    lobe = alpha2 / (4.0 * math.pi * t * t * a * b)
    if gradient.shape[0] > 0:
        by_h = -4.0 * n_h * (alpha2 - 1.0) / t
        by_l = -(1.0 - k) / a
        by_v = -(1.0 - k) / b if raw_v > COSINE_FLOOR else 0.0
        by_rough = (1.0 / alpha2 - 2.0 * n_h * n_h / t) * 4.0 * rough * alpha
        by_rough -= ((1.0 - n_l) / a + (1.0 - n_v) / b) * rough
        cosine_p, cosine_q = (lx - nx * cosine) * shorten, (ly - ny * cosine) * shorten
        lobe_p = by_h * (hx - nx * raw_h) * shorten + by_v * (vx - nx * raw_v) * shorten
        lobe_q = by_h * (hy - ny * raw_h) * shorten + by_v * (vy - ny * raw_v) * shorten
        lobe_p, lobe_q = lobe_p + by_l * cosine_p, lobe_q + by_l * cosine_q
    for c in range(3):
        matte, f0 = albedo[c], albedo[3 + c]
        gloss = (f0 + (1.0 - f0) * x) * lobe
        f = matte * (1.0 - f0) + gloss
        lit = cosine * irradiance[c]
        radiance[c] += f * lit
        if gradient.shape[0] > 0:
            gradient[c, 0] += irradiance[c] * f * cosine_p + lit * gloss * lobe_p
            gradient[c, 1] += irradiance[c] * f * cosine_q + lit * gloss * lobe_q
            gradient[c, 2] += lit * matte * (1.0 - f0)
            gradient[c, 3] += lit * gloss * by_rough
            gradient[c, 4] += lit * f0 * ((1.0 - x) * lobe - matte)
