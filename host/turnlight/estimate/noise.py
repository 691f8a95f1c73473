"""How far the logs of pictures usually are from the model's, pixel by pixel: not the sensor's noise alone.

Against true materials they err by 1 % where neighbours are alike and by a quarter of their spread where they
are not, as resampling and misalignment mix them. And where a picture is darker than the pixel's others, it
errs by more: what lies within a pixel turns away from the light, or into shadow, piece by piece, which the mean
slope does not tell. Were such values trusted like others, every steep slope would come out too flat.
"""

from collections.abc import Sequence

import cv2
import numpy as np

from svbrdf.lighting import Lighting
from turnlight.estimate.observations import Array, facing, floor_of, pixel_grid
from turnlight.picture.picture import Picture

EVERYWHERE, CONTRAST = 0.02, 0.25
"""Of the logs: everywhere, and per standard deviation of the logs around the pixel."""
DARK = 0.01
"""Of white: reflectances that are darker count as equal."""


def noise_of(pictures: Sequence[Picture]) -> list[Array]:
    """(H, W) standard deviation of the logs of each of these `scaled` pictures, with known lighting."""
    grey = [np.maximum(picture.image.mean(axis=-1), 0) for picture in pictures]
    lightings = [p.lighting for p in pictures if p.lighting is not None]
    reflectances = [
        g / _flat_white(lit, g.shape[0]) for g, lit in zip(grey, lightings, strict=True)
    ]
    usual = np.median(reflectances, axis=0)
    result = []
    for lit, value, reflectance in zip(lightings, grey, reflectances, strict=True):
        contrast = CONTRAST * _spread(value + np.float32(floor_of(lit)))
        shaded = np.maximum((usual + DARK) / (reflectance + DARK), 1)
        result.append(np.asarray(np.hypot(EVERYWHERE, contrast) * shaded, np.float32))
    return result


def _flat_white(lighting: Lighting, resolution: int) -> Array:
    """(H, W) what a flat white sample would read."""
    positions = pixel_grid(resolution)
    lit = [facing(g.position, positions) * g.white.mean(axis=-1) for g in lighting.lights]
    return np.sum(lit, axis=0)


def _spread(above: Array) -> Array:
    """(H, W) standard deviation of the logs around each pixel."""
    logs = np.log(above)
    return np.sqrt(cv2.blur((logs - cv2.blur(logs, (3, 3))) ** 2, (3, 3)))
