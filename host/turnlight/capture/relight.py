"""Maps as a screen shows them: each map, and the material under a light of one's choice."""

import math

import numpy as np
import numpy.typing as npt

from svbrdf import renderer
from svbrdf.maps import Maps

Image8 = npt.NDArray[np.uint8]
Position = tuple[float, float, float]
UPPER_LEFT = (-1.7, 1.7, 2.4)
_VIEW = (0.0, 0.0, 4.0)
_GAMMA = 2.2


def relit(maps: Maps, light: Position = UPPER_LEFT) -> Image8:
    """(h, w, 3) RGB: the material seen from above, lit by a point light at `light` in half sides.

    The light falls off with the square of its distance; a white sheet at the centre that faced it
    would be white.
    """
    source = np.array(light, np.float32)
    positions = renderer.pixel_positions(np, *maps.resolution, dtype=np.float32)
    distance2 = np.sum((source - positions) ** 2, axis=-1, keepdims=True)
    irradiance = math.pi * np.sum(source**2) / distance2
    radiance = renderer.render(maps, source, np.array(_VIEW, np.float32), irradiance)
    return _to_screen(radiance)


def shown(maps: Maps) -> dict[str, Image8]:
    """The four maps, (h, w, 3) RGB each: colours with gamma, normals and roughness as stored."""
    return {
        "Normal": _to_bytes((maps.normal + 1) / 2),
        "Diffuse": _to_screen(maps.diffuse),
        "Roughness": _to_bytes(np.repeat(maps.roughness, 3, axis=-1)),
        "Specular": _to_screen(maps.specular),
    }


def _to_screen(linear: npt.NDArray[np.float32]) -> Image8:
    return _to_bytes(np.clip(linear, 0, 1) ** (1 / _GAMMA))


def _to_bytes(image: npt.NDArray[np.float32]) -> Image8:
    return np.rint(np.clip(image, 0, 1) * 255).astype(np.uint8)
