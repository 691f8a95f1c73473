"""A Picture: one rectified photograph of the sample, ready for the estimator."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from svbrdf.lighting import Lighting


@dataclass(frozen=True)
class Picture:
    """Rectified, square, linear.

    image: (n, n, 3) float32 linear RGB, 0 to 1 where the sensor did not clip before the dark frame's
    subtraction, by whose noise black may read below 0; row 0 is the sample's top (+y), pixel centres at
    (i + 1/2) / n.
    gain: factor that brings the image to the scale the network was trained for.
    valid: (n, n) bool, False where the frame did not see the sample.
    clipped: (n, n) bool, True where any channel of any sensor pixel that a value draws on was at full
    scale: the true value is at least what the image says.
    lighting: where the camera and the lights were, None where that is not known; its white is on the
    image's own scale, before `gain`.
    """

    image: npt.NDArray[np.float32]
    gain: float
    valid: npt.NDArray[np.bool_]
    clipped: npt.NDArray[np.bool_]
    lighting: Lighting | None = None
