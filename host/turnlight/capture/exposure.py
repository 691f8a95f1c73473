"""The exposure test: before a run, one exposure for each LED, so that the sample uses the sensor's range."""

import math
from functools import partial

import cv2
import numpy as np
import numpy.typing as npt

from turnlight.capture.manifest import LitExposure
from turnlight.capture.recovery import Recovery
from turnlight.capture.verify import verify_exposure
from turnlight.config import RigConfig
from turnlight.frame import Exposure, Frame
from turnlight.picture.pinhole import plane_homography, platter_pose, project
from turnlight.picture.radiometry import linear
from turnlight.rig.rig import Rig

MOST_CLIPPED = 0.005
"""Share of the sample's pixels that may read full scale in any channel."""
BRIGHTEST = 0.9
"""Of full scale, where the brightest but MOST_CLIPPED of the pixels are to lie."""
LONGEST, SHORTEST_US, LONGEST_US = 4, 100, 800_000
_STEPS_PER_OCTAVE = 2
_EVERY_PX = 2
_ROUNDS = 8


def find_exposure(
    rig: Rig,
    recovery: Recovery,
    leds: tuple[int, ...],
    thickness_mm: float,
    angle_deg: float = 0.0,
) -> LitExposure:
    """Light these LEDs, the table being at angle_deg, and find the longest exposure that clips little.

    In steps of half a stop of the rig file's exposure, at most LONGEST times it, so that few dark
    frames are needed. Raises CameraError, RigError or LinkError.
    """
    camera = rig.config.camera
    sample = sample_mask(rig.config, angle_deg, thickness_mm)[::_EVERY_PX, ::_EVERY_PX]
    exposure = Exposure(camera.exposure_us, camera.gain)
    for _ in range(_ROUNDS):
        frame = recovery.insist(partial(_lit, rig, leds, exposure))
        values = frame.pixels[::_EVERY_PX, ::_EVERY_PX][sample].max(axis=-1)
        brightest = np.quantile(values, [1 - MOST_CLIPPED], method="higher")
        bright = float(linear(frame, brightest)[0])
        if bright < 1 or exposure.exposure_us == SHORTEST_US:
            break
        exposure = Exposure(max(SHORTEST_US, exposure.exposure_us // 400 * 100), camera.gain)
    chosen_us = _on_grid(camera.exposure_us, exposure.exposure_us * BRIGHTEST / max(bright, 1e-6))
    readings = linear(frame, values) * (chosen_us / exposure.exposure_us)
    return LitExposure(leds=leds, exposure_us=chosen_us, clipped=float(np.mean(readings >= 1)))


def sample_mask(config: RigConfig, angle_deg: float, thickness_mm: float) -> npt.NDArray[np.bool_]:
    """(height, width) True where the camera sees the sample's surface, by the rig's geometry."""
    half = config.sample.side_mm / 2
    corners = np.array([(-half, half), (half, half), (half, -half), (-half, -half)])
    pose = platter_pose(config, angle_deg)
    outline = project(plane_homography(config, pose, thickness_mm), corners)
    mask = np.zeros((config.camera.height_px, config.camera.width_px), np.uint8)
    cv2.fillConvexPoly(mask, np.rint(outline).astype(np.int32), 1)
    return mask.astype(bool)


def _lit(rig: Rig, leds: tuple[int, ...], exposure: Exposure) -> Frame:
    rig.controller.light(leds)
    rig.clock.sleep(rig.config.controller.settle_ms / 1000)
    frame = rig.camera.capture(exposure)
    rig.controller.off()
    verify_exposure(exposure, frame)
    return frame


def _on_grid(base_us: int, wanted_us: float) -> int:
    """The longest base_us * 2**(k/2), in whole tenths of a millisecond, that is not above wanted_us."""
    steps = math.floor(_STEPS_PER_OCTAVE * math.log2(wanted_us / base_us))
    steps = min(steps, round(_STEPS_PER_OCTAVE * math.log2(LONGEST)))
    exact_us = base_us * 2 ** (steps / _STEPS_PER_OCTAVE)
    return min(LONGEST_US, max(SHORTEST_US, 100 * math.floor(exact_us / 100)))
