"""Does a frame show what its shot asked for? Whatever is not proven is refused."""

import numpy as np
import numpy.typing as npt

from turnlight.capture.plan import Shot, turn_deg
from turnlight.errors import CameraError, RigError
from turnlight.frame import Exposure, Frame
from turnlight.rig.controller import Status, Strobe

ARRIVED_DEG = 0.05
NO_LIGHT = 0.0005
"""Mean linear value above the dark frame's, of full scale, below which a frame is unlit: white of the
platter's markers is in every frame, and ten thousands of pixels are averaged."""
BY_CHANCE = 16
"""Rows of a ten-bit camera, in the dark beside the platter, may be all of one value by chance."""
_PARTS = 4
"""The platter is seen from the frame's top to its bottom, so light reaches each quarter."""
_EVERY_PX, _EVERY_ROW = 16, 4
"""What is looked at of a frame: the table waits meanwhile."""


def verify(
    shot: Shot, frame: Frame, dark: Frame | None, previous: Frame | None, strobe: Strobe
) -> None:
    """The frame itself: begun after the strobe, whole, and lit.

    dark: without LEDs, at the same exposure. previous: the lit frame before this one. CameraError or
    RigError says what is wrong.
    """
    if frame.started_us < strobe.time_us:
        raise CameraError(
            f"Shot {shot.index + 1}: the camera's frame was begun before the light had settled; "
            "run turnlight doctor to check the camera."
        )
    if dark is None:
        return
    unlit = [_mean(frame, part) - _mean(dark, part) < NO_LIGHT for part in range(_PARTS)]
    torn = max(_torn_rows(frame, dark, previous), sum(unlit) * len(frame.pixels) // _PARTS)
    if all(unlit):
        raise RigError(
            f"Shot {shot.index + 1}: LED {listed(shot.leds)} gives no light; check its plug and "
            "cable, or replace it."
        )
    if torn > BY_CHANCE:
        raise CameraError(
            f"Shot {shot.index + 1}: the camera's frame is torn ({torn} of {len(frame.pixels)} rows "
            "are missing or of the frame before); check the camera's cable and USB port."
        )


def verify_exposure(asked: Exposure, frame: Frame) -> None:
    """CameraError unless the camera says that it exposed as asked."""
    if frame.exposure != asked:
        raise CameraError(
            f"The camera was asked for {asked.exposure_us} us at gain {asked.gain:g} but exposed "
            f"{frame.exposure.exposure_us} us at gain {frame.exposure.gain:g}; run turnlight doctor "
            "to check the camera."
        )


def verify_rest(shot: Shot, status: Status) -> None:
    """RigError unless the table stands where the shot wants it."""
    if status.state != "ready":
        raise RigError(
            f"Shot {shot.index + 1}: the rig reports {status.state}; see that nothing is in its way "
            "and start again."
        )
    if turn_deg(shot.angle_deg, status.angle_deg) > ARRIVED_DEG:
        raise RigError(
            f"Shot {shot.index + 1}: the table was sent to {shot.angle_deg:.2f} degrees but is at "
            f"{status.angle_deg:.2f}; check that nothing moves it, then start again."
        )


def verify_lit(shot: Shot, lit: tuple[int, ...]) -> None:
    """RigError unless exactly the shot's LEDs were lit."""
    if lit != tuple(sorted(shot.leds)):
        raise RigError(
            f"Shot {shot.index + 1}: LEDs {listed(shot.leds)} were asked for but {listed(lit)} were "
            "lit; run turnlight doctor to check the rig."
        )


def linear(frame: Frame, pixels: npt.NDArray[np.uint16]) -> npt.NDArray[np.float64]:
    """These pixels of a frame without the camera's gamma, 0 to 1."""
    top = (1 << frame.bit_depth) - 1
    values: npt.NDArray[np.float64] = (pixels / top) ** frame.gamma
    return values


def listed(leds: tuple[int, ...]) -> str:
    return ", ".join(map(str, leds)) or "none"


def _torn_rows(frame: Frame, dark: Frame, previous: Frame | None) -> int:
    """Rows that carry no noise though the dark frame's do, or that repeat the frame before to the bit."""
    here, unlit = _thin(frame), _thin(dark)
    noisy = _noisy(here)
    torn = ~noisy & _noisy(unlit)
    if previous is not None and previous.pixels.shape == frame.pixels.shape:
        torn |= noisy & _same(here, _thin(previous)) & ~_same(here, unlit)
    return int(torn.sum()) * _EVERY_ROW


def _thin(frame: Frame) -> npt.NDArray[np.uint16]:
    return frame.pixels[::_EVERY_ROW, ::_EVERY_PX]


def _noisy(rows: npt.NDArray[np.uint16]) -> npt.NDArray[np.bool_]:
    """Rows in which neighbours differ, and not just beside a stuck pixel."""
    noisy: npt.NDArray[np.bool_] = np.mean(rows[:, 1:] != rows[:, :-1], axis=(1, 2)) > 0.1
    return noisy


def _same(rows: npt.NDArray[np.uint16], others: npt.NDArray[np.uint16]) -> npt.NDArray[np.bool_]:
    same: npt.NDArray[np.bool_] = np.all(rows == others, axis=(1, 2))
    return same


def _mean(frame: Frame, part: int) -> float:
    """Of one of the _PARTS that lie above each other."""
    rows = len(frame.pixels) // _PARTS
    pixels = frame.pixels[part * rows : (part + 1) * rows : _EVERY_ROW, ::_EVERY_PX]
    return float(linear(frame, pixels).mean())
