"""What is left between two pictures of one sample after rectification: a sample that lies higher or lower
than the frame, paper that is not flat."""

import cv2
import numpy as np

from turnlight.picture.pinhole import Matrix
from turnlight.picture.warp import Image

SMALLEST_SHARE, LARGEST_SHARE = 0.003, 0.02
"""Of the side. The frame is more exact than the smallest, and relief that is lit from two sides looks shifted
by up to about that; what is farther off than the largest is no misalignment."""
GAIN = 0.05
"""By how much the correlation must rise for a shift to be believed."""
_DARKNESS = 0.02
_BLUR_PX = 0.8


def features(image: Image) -> Image:
    """(n, n) how much brightness and colour change at each place, whatever side the light comes from."""
    value = np.log(np.maximum(image, 0) + _DARKNESS * float(image.mean()) + 1e-6)
    planes = (value.mean(axis=-1), value[..., 0] - value[..., 1], value[..., 2] - value[..., 1])
    total = np.zeros(image.shape[:2], np.float32)
    for plane in planes:
        smooth = cv2.GaussianBlur(plane.astype(np.float32), (0, 0), _BLUR_PX)
        total += np.hypot(cv2.Sobel(smooth, cv2.CV_32F, 1, 0), cv2.Sobel(smooth, cv2.CV_32F, 0, 1))
    detail = total - cv2.GaussianBlur(total, (0, 0), 16)
    return np.asarray(detail / max(float(detail.std()), 1e-9), np.float32).clip(-4, 4)


def misalignment(reference: Image, other: Image) -> Matrix:
    """(2,) in pixels, what has to be added to positions in `other` to see there what `reference` shows.

    Both from `features`. Zero unless that makes the two clearly more alike (phase correlation, then a
    check by correlation).
    """
    window = cv2.createHanningWindow(reference.shape[::-1], cv2.CV_32F)
    (x, y), _ = cv2.phaseCorrelate(reference, other, window)
    shift = np.array([x, y])
    far = float(np.linalg.norm(shift))
    if not SMALLEST_SHARE < far / len(reference) < LARGEST_SHARE:
        return np.zeros(2)
    before, after = alikeness(reference, other, np.zeros(2)), alikeness(reference, other, shift)
    return shift if after > before + GAIN else np.zeros(2)


def alikeness(reference: Image, other: Image, shift: Matrix) -> float:
    """Correlation, -1 to 1, after a shift; both blurred alike, as resampling does."""
    move = np.array([[1, 0, shift[0]], [0, 1, shift[1]]])
    flags = cv2.INTER_CUBIC | cv2.WARP_INVERSE_MAP
    moved = cv2.warpAffine(other, move, reference.shape[::-1], flags=flags)
    edge = int(np.ceil(LARGEST_SHARE * len(reference)))
    a, b = (i[edge:-edge, edge:-edge].ravel() for i in (reference, moved))
    return float(np.corrcoef(a, b)[0, 1])
