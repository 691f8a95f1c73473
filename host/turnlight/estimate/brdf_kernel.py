"""The BRDF of svbrdf.renderer for one pixel, compiled, with its derivatives.

A pixel's material is nine numbers, `PARAMETERS` in order: the slopes nx/nz and ny/nz of its normal, the
logs of its diffuse albedo, its roughness, the log of its green specular albedo, and how much the logs of
red and blue lie above that. All are unbounded but for the ranges in LOWER and UPPER.
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
LOWER = np.array([-3, -3, *[math.log(5e-4)] * 3, ROUGHNESS_FLOOR, math.log(0.01), -1.5, -2.0])
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


@njit(cache=True, nogil=True)
def shade(  # noqa: PLR0915
    theta: Any, to_light: Any, to_view: Any, irradiance: Any, radiance: Any, gradient: Any
) -> None:
    """Add one light's radiance (3,) and its derivatives (3, 9), at a pixel of parameters theta (9,).

    to_light, to_view: unit vectors (3,). irradiance: (3,), of a patch that faces the light. An empty
    gradient, (0, 9), is left alone.
    """
    lx, ly, lz = to_light[0], to_light[1], to_light[2]
    vx, vy, vz = to_view[0], to_view[1], to_view[2]
    hx, hy, hz = lx + vx, ly + vy, lz + vz
    scale = 1.0 / math.sqrt(hx * hx + hy * hy + hz * hz)
    hx, hy, hz = hx * scale, hy * scale, hz * scale
    shorten = 1.0 / math.sqrt(1.0 + theta[0] * theta[0] + theta[1] * theta[1])
    nx, ny, nz = theta[0] * shorten, theta[1] * shorten, shorten
    cosine = nx * lx + ny * ly + nz * lz
    if cosine <= 0.0:
        return
    raw_h, raw_v = nx * hx + ny * hy + nz * hz, nx * vx + ny * vy + nz * vz
    n_l = max(cosine, COSINE_FLOOR)
    n_v = max(raw_v, COSINE_FLOOR)
    n_h = min(max(raw_h, COSINE_FLOOR), 1.0)
    v_h = max(vx * hx + vy * hy + vz * hz, COSINE_FLOOR)
    rough = max(theta[5], ROUGHNESS_FLOOR)
    alpha = rough * rough
    alpha2, k = alpha * alpha, alpha / 2
    t = n_h * n_h * (alpha2 - 1.0) + 1.0
    a, b = n_l * (1.0 - k) + k, n_v * (1.0 - k) + k
    lobe = alpha2 / (math.pi * t * t) / (a * b) / 4.0
    x = 2.0 ** ((-5.55473 * v_h - 6.98316) * v_h)
    with_gradient = gradient.shape[0] > 0
    if with_gradient:
        by_h = -4.0 * n_h * (alpha2 - 1.0) / t
        by_l = -(1.0 - k) / a
        by_v = -(1.0 - k) / b if raw_v > COSINE_FLOOR else 0.0
        by_rough = (1.0 / alpha2 - 2.0 * n_h * n_h / t) * 4.0 * rough**3
        by_rough += (-(1.0 - n_l) / a - (1.0 - n_v) / b) * rough
        cosine_p, cosine_q = (lx - nx * cosine) * shorten, (ly - ny * cosine) * shorten
        lobe_p = by_h * (hx - nx * raw_h) + by_l * (lx - nx * cosine) + by_v * (vx - nx * raw_v)
        lobe_q = by_h * (hy - ny * raw_h) + by_l * (ly - ny * cosine) + by_v * (vy - ny * raw_v)
        lobe_p, lobe_q = lobe_p * shorten, lobe_q * shorten
    for c in range(3):
        tint = theta[7] if c == 0 else (theta[8] if c == 2 else 0.0)
        f0 = min(math.exp(theta[6] + tint), 1.0)
        matte = math.exp(theta[2 + c]) / math.pi
        gloss = (f0 + (1.0 - f0) * x) * lobe
        f = matte * (1.0 - f0) + gloss
        strength = irradiance[c]
        radiance[c] += f * cosine * strength
        if with_gradient:
            lit = cosine * strength
            gradient[c, 0] += strength * f * cosine_p + lit * gloss * lobe_p
            gradient[c, 1] += strength * f * cosine_q + lit * gloss * lobe_q
            gradient[c, 2 + c] += lit * matte * (1.0 - f0)
            gradient[c, 5] += lit * gloss * by_rough
            by_f0 = lit * f0 * ((1.0 - x) * lobe - matte)
            gradient[c, 6] += by_f0
            if c == 0:
                gradient[c, 7] += by_f0
            elif c == 2:
                gradient[c, 8] += by_f0
