"""A Frame: what the camera gave, with the camera's own metadata."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt


@dataclass(frozen=True)
class Exposure:
    """What is asked of a camera for one frame."""

    exposure_us: int
    gain: float


@dataclass(frozen=True)
class Frame:
    """One frame and what the camera itself says about it.

    pixels: (height, width, 3) uint16, RGB, the camera's own bits in the low `bit_depth` bits.
    started_us: when the exposure began, on the controller's clock.
    """

    pixels: npt.NDArray[np.uint16]
    bit_depth: int
    gamma: float
    exposure: Exposure
    started_us: int
