"""Where a device's flash sits beside its lens."""

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
import numpy.typing as npt
from scipy.optimize import least_squares

from turnlight.picture.pinhole import Matrix, Pose
from turnlight.picture.warp import Image

FARTHEST_MM = 60.0
"""A light this far from the lens or farther is no flash of this device."""
TYPICAL_MM = 15.0
SHADING_MM, HIGHLIGHT_MM = 8.0, 3.0
"""How exact a lamp's place from the shading is, and a highlight's on the sample."""
_BRIGHTER = 2.0
_LARGEST_SHARE = 0.12
_BLUR_SHARE = 0.02


@dataclass(frozen=True)
class Clue:
    """What one photo says of the flash. lamp_mm: (3,) from the shading; highlight_mm: (2,), if it has one."""

    pose: Pose
    lamp_mm: Matrix
    highlight_mm: Matrix | None


def flash_offset(clues: Sequence[Clue]) -> Matrix:
    """(2,) mm from lens to flash, x right and y down as the camera has them.

    From shading and highlights of all photos that seem to be lit by a flash; zero if none is.
    """
    near = [
        (clue, beside) for clue in clues if _is_near(beside := _beside(clue.pose, clue.lamp_mm))
    ]
    if not near:
        return np.zeros(2)

    def off(offset: Matrix) -> Matrix:
        terms = [offset / TYPICAL_MM]
        for clue, beside in near:
            terms.append((offset - beside[:2]) / SHADING_MM)
            if clue.highlight_mm is not None:
                terms.append((mirror_point(clue.pose, offset) - clue.highlight_mm) / HIGHLIGHT_MM)
        return np.concatenate(terms)

    return np.asarray(least_squares(off, np.zeros(2), loss="soft_l1").x, dtype=float)


def is_flash(pose: Pose, lamp_mm: Matrix) -> bool:
    """Whether a lamp that the shading puts there can be the device's own."""
    return _is_near(_beside(pose, lamp_mm))


def flash_mm(pose: Pose, offset: Matrix) -> Matrix:
    """(3,) in the frame's coordinates."""
    rotation, translation = pose
    return np.asarray(rotation.T @ (np.append(offset, 0.0) - translation))


def mirror_point(pose: Pose, offset: Matrix) -> Matrix:
    """(2,) mm where a flat mirror in the frame would show the flash."""
    camera, light = flash_mm(pose, np.zeros(2)), flash_mm(pose, offset)
    share = camera[2] / (camera[2] + light[2])
    return np.asarray(camera[:2] + (light[:2] - camera[:2]) * share)


def highlight(image: Image, clipped: npt.NDArray[np.bool_], side_mm: float) -> Matrix | None:
    """(2,) mm: the middle of a picture's one highlight, None if there is none that stands out.

    image: (n, n, 3) over what white reads there, so that the fall-off is no highlight.
    """
    size = len(image)
    grey = cv2.GaussianBlur(image.mean(axis=-1), (0, 0), _BLUR_SHARE * size)
    level = float(np.median(grey))
    bright = grey > level * _BRIGHTER
    share = float(bright.mean())
    if not 0 < share < _LARGEST_SHARE:
        return None
    count, labels, stats, _ = cv2.connectedComponentsWithStats(bright.astype(np.uint8))
    largest = 1 + int(np.argmax(stats[1:count, cv2.CC_STAT_AREA]))
    if stats[largest, cv2.CC_STAT_AREA] < 0.7 * bright.sum():
        return None
    weight = np.where(labels == largest, grey - level * _BRIGHTER, 0) * (1 + clipped)
    rows, columns = np.mgrid[:size, :size]
    x = float((weight * columns).sum() / weight.sum()) + 0.5
    y = float((weight * rows).sum() / weight.sum()) + 0.5
    return (np.array([x, size - y]) / size - 0.5) * side_mm


def _beside(pose: Pose, lamp_mm: Matrix) -> Matrix:
    rotation, translation = pose
    return np.asarray(rotation @ lamp_mm + translation)


def _is_near(beside: Matrix) -> bool:
    return bool(np.linalg.norm(beside) < FARTHEST_MM)
