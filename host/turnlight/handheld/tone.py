"""What the frame's grey patches say of a photo's tone curve.

No printer keeps to the greys, so nothing is corrected by them; but filters and HDR are farther off.
"""

import numpy as np

from turnlight.handheld.shading import Shading
from turnlight.handheld.unwarp import PaperLight

FEWEST_PATCHES = 3
DARKEST, LIGHTEST = 1.5, 0.67
"""Exponents that a printer may be to blame for."""


def tone(paper: PaperLight, lit: Shading) -> float | None:
    """Exponent that leads from the greys as they were printed to what they read beside the paper around them.

    1 where printer and photo keep to what they say. None where they are not seen, or not one darker than
    the other.
    """
    if len(paper.greys) < FEWEST_PATCHES:
        return None
    white = np.array([lit.reading(grey.middle_mm) for grey in paper.greys])
    read = np.array([grey.reading for grey in paper.greys]) / white
    printed = np.array([grey.printed for grey in paper.greys])
    if read.min() <= 0 or (np.diff(read) * np.diff(printed) <= 0).any():
        return None
    known, seen = np.log(printed), np.log(read)
    return float(known @ seen / (known @ known))
