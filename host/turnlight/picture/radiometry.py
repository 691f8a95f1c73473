"""From the camera's bits to light: linear, without dark level, vignetting, and colour of lens or LED."""

from collections.abc import Sequence
from typing import Any

import cv2
import numpy as np
import numpy.typing as npt
from numba import njit

from turnlight.config import RigConfig
from turnlight.frame import Frame
from turnlight.picture.pinhole import Matrix
from turnlight.picture.warp import Image

_VALUES = 1 << 16
"""That 16 bits may have; OpenCV's tables have an entry for each."""


def linear(frame: Frame, pixels: npt.NDArray[np.uint16]) -> Image:
    """Undo the camera's gamma: float32 in [0, 1]. pixels: the frame's, or any part of them."""
    return np.asarray(cv2.LUT(pixels, _light_of(frame)), np.float32).reshape(pixels.shape)


def averaged(frame: Frame, pixels: npt.NDArray[np.uint16], side: int) -> Image:
    """(h // side, w // side, 4) of blocks of (h, w, 3): mean linear light, and the share that is clipped."""
    blocks = np.empty((pixels.shape[0] // side, pixels.shape[1] // side, 4), np.float32)
    _average(pixels, _light_of(frame), (1 << frame.bit_depth) - 1, side, blocks)
    return blocks


def _light_of(frame: Frame) -> npt.NDArray[np.float32]:
    """(_VALUES,) what each value of a pixel stands for."""
    top = (1 << frame.bit_depth) - 1
    table = ((np.arange(top + 1) / top) ** frame.gamma).astype(np.float32)
    return np.pad(table, (0, _VALUES - len(table)), "edge")


@njit(cache=True, nogil=True)
def _average(pixels: Any, light_of: Any, top: int, side: int, blocks: Any) -> None:
    share = np.float32(1 / side**2)
    for row in range(blocks.shape[0]):
        for column in range(blocks.shape[1]):
            red = green = blue = clipped = np.float32(0)
            for y in range(row * side, row * side + side):
                for x in range(column * side, column * side + side):
                    r, g, b = pixels[y, x, 0], pixels[y, x, 1], pixels[y, x, 2]
                    red += light_of[r]
                    green += light_of[g]
                    blue += light_of[b]
                    clipped += np.float32(max(r, g, b) >= top)
            blocks[row, column, 0] = red * share
            blocks[row, column, 1] = green * share
            blocks[row, column, 2] = blue * share
            blocks[row, column, 3] = clipped * share


def clipped(frame: Frame, pixels: npt.NDArray[np.uint16]) -> npt.NDArray[np.bool_]:
    """(h, w) where any channel is at full scale."""
    full_scale = pixels >= (1 << frame.bit_depth) - 1
    return np.asarray(full_scale[..., 0] | full_scale[..., 1] | full_scale[..., 2])


def vignetting(config: RigConfig, sensor_px: Matrix) -> Image:
    """(..., 1) what the lens lets through at (..., 2) sensor pixels, relative to its centre."""
    measured, camera = config.geometry.lens, config.camera
    size = np.array([camera.width_px, camera.height_px])
    centre = np.divide(measured.centre_px, (measured.width_px, measured.height_px)) * size
    x, y = (sensor_px[..., axis] - centre[axis] for axis in (0, 1))
    square = (x * x + y * y)[..., None] / np.sum((size / 2) ** 2)
    a, b = measured.vignetting
    return np.asarray(1 + square * (a + square * b), np.float32)


def colour_corrected(image: Image, config: RigConfig, leds: Sequence[int]) -> Image:
    """(..., 3) linear camera RGB under these LEDs as linear sRGB in which white has no colour.

    Neutral white under the LEDs keeps its green reading, which is the one that LED powers are in.
    Light of several LEDs is taken to have their mean colour, weighed by power. The LED's power and
    fall-off stay in the image: `Lighting.white` says what they are.
    """
    calibration = config.geometry
    lit = [calibration.led[i] for i in leds] or calibration.led
    total = np.sum([np.multiply(led.colour, led.power) for led in lit], axis=0)
    balance = total[1] / total
    matrix = np.array(calibration.colour.matrix) if calibration.colour else np.eye(3)
    correction = matrix * balance
    if np.array_equal(correction, np.eye(3)):
        return image
    return np.asarray(image @ correction.T, np.float32)
