"""What the page's relit view has to show, by svbrdf.renderer: the maps between their pixels, seen by a camera
that circles the sample and keeps it in the middle of the picture."""

import numpy as np
import numpy.typing as npt
from scipy.ndimage import map_coordinates

from svbrdf import renderer
from svbrdf.maps import Maps

Array = npt.NDArray[np.float64]
DISTANCE, MARGIN = 4.0, 0.06


def relit(
    maps: Maps, light: Array, turn: float, tilt: float, size: int
) -> tuple[Array, npt.NDArray[np.bool_]]:
    """(size, size, 3) of 0 to 255, row 0 on top, and where the sample is seen, its edge left out."""
    camera = DISTANCE * np.array(
        [np.sin(tilt) * np.sin(turn), -np.sin(tilt) * np.cos(turn), np.cos(tilt)]
    )
    ahead = -camera / DISTANCE
    right = np.array([np.cos(turn), np.sin(turn), 0.0])
    axes = np.stack([right, np.cross(right, ahead), ahead])
    corners = np.array([[x, y, 0.0] for x in (-1, 1) for y in (-1, 1)])
    seen = (corners - camera) @ axes.T
    flat = seen[:, :2] / seen[:, 2:]
    low, high = flat.min(axis=0), flat.max(axis=0)
    reach = (high - low).max() / 2 * (1 + MARGIN * np.sin(tilt))
    pixels = ((np.arange(size) + 0.5) / size * 2 - 1) * reach
    middle = (low + high) / 2
    x, y = np.meshgrid(middle[0] + pixels, middle[1] - pixels)
    rays = np.stack([x, y, np.ones_like(x)], axis=-1) @ axes
    at = camera - rays * (camera[2] / rays[..., 2:])
    inside = np.abs(at[..., :2]).max(axis=-1) < 0.99
    here = Maps(
        *(_between(m, at) for m in (maps.normal, maps.diffuse, maps.roughness, maps.specular))
    )
    here.normal[:] /= np.linalg.norm(here.normal, axis=-1, keepdims=True)
    to_light = light - at
    distance2 = np.sum(to_light**2, axis=-1, keepdims=True)
    irradiance = np.pi * np.sum(light**2) / distance2
    radiance = renderer.shade(here, to_light / np.sqrt(distance2), _unit(camera - at), irradiance)
    return np.clip(radiance, 0, 1) ** (1 / 2.2) * 255, inside


def _between(image: npt.NDArray[np.float32], at: Array) -> Array:
    """Bilinear, repeating."""
    height, width, channels = image.shape
    row = (1 - at[..., 1]) / 2 * height - 0.5
    column = (at[..., 0] + 1) / 2 * width - 0.5
    parts = [
        map_coordinates(image[..., c].astype(float), [row, column], order=1, mode="grid-wrap")
        for c in range(channels)
    ]
    return np.stack(parts, axis=-1)


def _unit(vector: Array) -> Array:
    return np.asarray(vector / np.linalg.norm(vector, axis=-1, keepdims=True))
