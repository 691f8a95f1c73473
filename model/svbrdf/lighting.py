"""What is known of how a picture was taken: where the camera and the lights were, and how bright they are."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float32]


@dataclass(frozen=True)
class Light:
    """One point light over the sample.

    position: (3,) in the sample's frame, in half sides.
    white: (n, n, 3), or (1, 1, 3) where it is the same everywhere: what a white Lambertian patch that
    faces the light would record at each pixel, linear, exposure and gain included.
    """

    position: Array
    white: Array


@dataclass(frozen=True)
class Lighting:
    """The lights of one picture, whose radiances add up, and the camera.

    view: (3,) centre of the camera in the sample's frame, in half sides.

    A picture's linear value is the sum over lights of f(l, v) x max(n.l, 0) x pi x white.
    """

    view: Array
    lights: tuple[Light, ...]
