"""The BRDF and its renderer, for numpy and torch arrays alike.

Isotropic Cook-Torrance with GGX, as published with "Flexible SVBRDF Capture with a Multi-Image Deep
Network" (EGSR 2019). No shadows, no interreflection. The diffuse term is divided by pi.
"""

import math
from typing import Any

import array_api_compat

from svbrdf.maps import Maps

COSINE_FLOOR = 0.001
ROUGHNESS_FLOOR = 0.03


def pixel_positions(xp: Any, height: int, width: int, **options: Any) -> Any:
    """(H, W, 3) positions of the pixel centres on the sample: x right, y up (row 0 on top), z = 0."""
    x = (xp.arange(width, **options) + 0.5) / width * 2 - 1
    y = 1 - (xp.arange(height, **options) + 0.5) / height * 2
    shape = (height, width)
    columns = xp.broadcast_to(x[None, :], shape)
    rows = xp.broadcast_to(y[:, None], shape)
    return xp.stack([columns, rows, xp.zeros_like(columns)], axis=-1)


def brdf(maps: Maps, to_light: Any, to_view: Any) -> Any:
    """f(l, v): (..., H, W, 3) in 1/sr, for unit vectors (..., H, W, 3) toward light and viewer."""
    xp = array_api_compat.array_namespace(maps.normal)
    half = _normalize(xp, to_light + to_view)
    n_h = xp.clip(_dot(xp, maps.normal, half), COSINE_FLOOR, 1.0)
    n_l = xp.clip(_dot(xp, maps.normal, to_light), COSINE_FLOOR, 1.0)
    n_v = xp.clip(_dot(xp, maps.normal, to_view), COSINE_FLOOR, 1.0)
    v_h = xp.clip(_dot(xp, to_view, half), COSINE_FLOOR, 1.0)
    alpha = xp.clip(maps.roughness, ROUGHNESS_FLOOR, 1.0) ** 2
    distribution = alpha**2 / (math.pi * (n_h**2 * (alpha**2 - 1) + 1) ** 2)
    fresnel = maps.specular + (1 - maps.specular) * 2.0 ** ((-5.55473 * v_h - 6.98316) * v_h)
    k = alpha / 2
    visibility = 1 / ((n_l * (1 - k) + k) * (n_v * (1 - k) + k))
    diffuse = maps.diffuse * (1 - maps.specular) / math.pi
    return diffuse + fresnel * (distribution * visibility / 4)


def render(maps: Maps, light: Any, view: Any, irradiance: Any) -> Any:
    """Radiance toward the viewer, (..., H, W, 3), of the sample lit by one point light.

    light, view: (..., 1, 1, 3) positions in the sample's frame (or (3,) for a single map set);
    irradiance: broadcastable to (..., H, W, 3), what a patch facing the light receives.
    """
    xp = array_api_compat.array_namespace(maps.normal)
    height, width = maps.resolution
    options = {"dtype": maps.normal.dtype, "device": array_api_compat.device(maps.normal)}
    positions = pixel_positions(xp, height, width, **options)
    to_light = _normalize(xp, light - positions)
    to_view = _normalize(xp, view - positions)
    return shade(maps, to_light, to_view, irradiance)


def shade(maps: Maps, to_light: Any, to_view: Any, irradiance: Any) -> Any:
    """Radiance (..., H, W, 3) for unit directions per pixel: f x max(n.l, 0) x irradiance."""
    xp = array_api_compat.array_namespace(maps.normal)
    cosine = xp.clip(_dot(xp, maps.normal, to_light), 0.0, 1.0)
    return brdf(maps, to_light, to_view) * cosine * irradiance


def _dot(xp: Any, a: Any, b: Any) -> Any:
    return xp.sum(a * b, axis=-1, keepdims=True)


def _normalize(xp: Any, vector: Any) -> Any:
    return vector / xp.sqrt(xp.sum(vector * vector, axis=-1, keepdims=True))
