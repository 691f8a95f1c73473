"""Frames for calibration: the table turned, LEDs lit, exposure chosen, everything verified."""

from collections.abc import Sequence

import cv2
import numpy as np
import numpy.typing as npt

from turnlight.capture.plan import turn_deg
from turnlight.capture.shot import take_dark
from turnlight.capture.verify import ARRIVED_DEG, verify_exposure
from turnlight.config import RigConfig
from turnlight.errors import CalibrationError, RigError
from turnlight.frame import Exposure, Frame
from turnlight.picture.radiometry import linear
from turnlight.picture.warp import Image
from turnlight.rig.rig import Rig

LONGEST_US, SHORTEST_US = 800_000, 100
AIM = 0.7
"""Share of full scale that the brightest parts shall read."""
BRIGHT_PERCENTILE = 99.5
LIVE_PX = 480


class Bench:
    """Takes frames on a rig, whose `config` the caller may know better by and by."""

    def __init__(self, rig: Rig) -> None:
        self._rig = rig

    @property
    def exposure(self) -> Exposure:
        """The rig's usual exposure."""
        camera = self._rig.config.camera
        return Exposure(camera.exposure_us, camera.gain)

    def turn(self, angle_deg: float) -> float:
        """Turn the table; returns where the controller says it is."""
        self._rig.controller.move(angle_deg)
        reached = self._rig.controller.status().angle_deg
        if turn_deg(angle_deg, reached) > ARRIVED_DEG:
            raise RigError(
                f"The table was sent to {angle_deg:.2f} degrees but is at {reached:.2f}; check that "
                "nothing moves it, then start again."
            )
        return reached

    def frame(self, leds: Sequence[int], exposure: Exposure) -> Frame:
        """One frame by these LEDs, which are off afterwards."""
        rig = self._rig
        if not leds:
            return take_dark(rig, exposure)
        rig.controller.light(leds)
        rig.clock.sleep(rig.config.controller.settle_ms / 1000)
        frame = rig.camera.capture(exposure)
        lit = rig.controller.status().leds
        rig.controller.off()
        verify_exposure(exposure, frame)
        if lit != tuple(sorted(leds)):
            raise RigError("Other LEDs are lit than were asked for; run turnlight doctor.")
        return frame

    def expose(self, leds: Sequence[int], brightest: float = AIM) -> Exposure:
        """The exposure at which the brightest parts by these LEDs read `brightest`."""
        exposure = self.exposure
        for _ in range(4):
            frame = self.frame(leds, exposure)
            reading = float(np.percentile(linear(frame, frame.pixels[::4, ::4]), BRIGHT_PERCENTILE))
            if 0.5 * brightest < reading < min(1.3 * brightest, 0.98):
                return exposure
            factor = brightest / max(reading, 0.02) if reading < 0.98 else 0.25
            exposure_us = round(exposure.exposure_us * factor)
            exposure = Exposure(min(max(exposure_us, SHORTEST_US), LONGEST_US), exposure.gain)
        if reading >= 0.98 or reading < 0.1:
            raise CalibrationError(
                "No exposure fits the LEDs' light; check that they are lit, or change camera.gain in "
                "the rig file."
            )
        return exposure


def four_around(config: RigConfig, ring: int) -> tuple[int, ...]:
    """Four LEDs of a ring, spread evenly around."""
    counts = [r.count for r in config.ring]
    first, count = sum(counts[: ring % len(counts)]), counts[ring]
    return tuple(sorted({first + round(i * count / 4) % count for i in range(4)}))


def green(frame: Frame) -> Image:
    """(h, w) linear."""
    return linear(frame, np.ascontiguousarray(frame.pixels[..., 1]))


def live(frame: Frame) -> npt.NDArray[np.uint8]:
    """The frame as a screen shows it, reduced."""
    height, width = frame.pixels.shape[:2]
    scale = min(1.0, LIVE_PX / max(height, width))
    size = (round(width * scale), round(height * scale))
    small = cv2.resize(linear(frame, frame.pixels), size, interpolation=cv2.INTER_AREA)
    return np.asarray(np.rint(small ** (1 / 2.2) * 255), np.uint8)
