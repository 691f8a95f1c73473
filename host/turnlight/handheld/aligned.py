"""Pictures from photographs that are already rectified and square."""

from pathlib import Path

import numpy as np

from turnlight.errors import ImageError
from turnlight.handheld.photo import read_photo
from turnlight.picture.picture import Picture

GAMMA = 2.2


def load_aligned(path: Path) -> Picture:
    """Read a square photograph, row 0 the sample's top, as a Picture of gain 1.

    Whatever `read_photo` reads; without a colour profile it is taken to be coded with gamma 2.2, as the
    network's pictures are. Raises ImageError when it is not square, and as `read_photo` does.
    """
    photo = read_photo(path, GAMMA)
    height, width = photo.clipped.shape
    if width != height:
        raise ImageError(
            f"{path} is {width}x{height} pixels and not square; crop it square to the sample."
        )
    light = np.maximum(photo.pixels, 0)
    return Picture(light, 1.0, np.ones_like(photo.clipped), photo.clipped)
