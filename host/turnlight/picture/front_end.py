"""The network's input from a Picture."""

import cv2
import numpy as np
import numpy.typing as npt

from turnlight.picture.picture import Picture

GAMMA = 2.2


def network_input(picture: Picture, resolution: int = 256) -> npt.NDArray[np.uint8]:
    """(resolution, resolution, 3) RGB as an 8-bit camera would give it: gamma 2.2, clipped at 1.

    Resampled in linear light, by area where that is a reduction; untouched at the same size.
    """
    image = picture.image
    if image.shape[0] != resolution:
        method = cv2.INTER_AREA if image.shape[0] > resolution else cv2.INTER_CUBIC
        image = cv2.resize(image, (resolution, resolution), interpolation=method).astype(np.float32)
    coded = np.clip(image * np.float32(picture.gain), 0, 1) ** (1 / GAMMA)
    return np.asarray(np.rint(coded * 255), np.uint8)
