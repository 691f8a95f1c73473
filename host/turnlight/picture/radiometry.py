"""From the camera's bits to light: linear, without dark level, vignetting, and colour of lens or LED."""

from collections.abc import Sequence

import cv2
import numpy as np
import numpy.typing as npt

from turnlight.config import RigConfig
from turnlight.frame import Frame
from turnlight.picture.pinhole import Matrix
from turnlight.picture.warp import Image

_VALUES = 1 << 16
"""That 16 bits may have; OpenCV's tables have an entry for each."""


def linear(frame: Frame, pixels: npt.NDArray[np.uint16]) -> Image:
    """Undo the camera's gamma: float32 in [0, 1]. pixels: the frame's, or any part of them."""
    top = (1 << frame.bit_depth) - 1
    table = ((np.arange(top + 1) / top) ** frame.gamma).astype(np.float32)
    light = cv2.LUT(pixels, np.pad(table, (0, _VALUES - len(table)), "edge"))
    return np.asarray(light, np.float32).reshape(pixels.shape)


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
