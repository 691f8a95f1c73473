"""The network's inputs from a Picture."""

import cv2
import numpy as np
import numpy.typing as npt

from svbrdf.lighting import Light, Lighting
from turnlight.picture.picture import Picture

GAMMA = 2.2


def network_input(picture: Picture, resolution: int = 256) -> npt.NDArray[np.uint8]:
    """(resolution, resolution, 3) RGB as an 8-bit camera would give it: gamma 2.2, clipped at 1.

    Resampled in linear light, by area where that is a reduction; untouched at the same size.
    """
    image = _resized(picture.image, resolution)
    coded = np.clip(image * np.float32(picture.gain), 0, 1) ** (1 / GAMMA)
    return np.asarray(np.rint(coded * 255), np.uint8)


def network_lighting(picture: Picture, resolution: int = 256) -> Lighting | None:
    """The picture's lighting on the scale and at the resolution of `network_input`."""
    if picture.lighting is None:
        return None
    gain = np.float32(picture.gain)
    lights = tuple(
        Light(light.position, _resized(light.white, resolution) * gain)
        for light in picture.lighting.lights
    )
    return Lighting(picture.lighting.view, lights)


def _resized(image: npt.NDArray[np.float32], resolution: int) -> npt.NDArray[np.float32]:
    size = image.shape[0]
    if size in (1, resolution):
        return image
    method = cv2.INTER_AREA if size > resolution else cv2.INTER_CUBIC
    return cv2.resize(image, (resolution, resolution), interpolation=method).astype(np.float32)
