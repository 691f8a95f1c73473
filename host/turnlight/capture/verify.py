"""Does a frame show what its shot asked for? Whatever is not proven is refused."""

from dataclasses import replace

import numpy as np
import numpy.typing as npt

from turnlight.capture.plan import Shot, turn_deg
from turnlight.errors import CameraError, RigError
from turnlight.frame import Exposure, Frame
from turnlight.picture.radiometry import linear
from turnlight.rig.controller import Status, Strobe

ARRIVED_DEG = 0.05
NO_LIGHT = 0.0005
"""Mean linear value above the dark frame's, of full scale, below which a frame is unlit: white of the
platter's markers is in every frame, and ten thousands of pixels are averaged."""
BY_CHANCE = 4
"""Rows looked at of a ten-bit camera, in the dark beside the platter, may be all of one value by chance."""
_PARTS = 4
"""The platter is seen from the frame's top to its bottom, so light reaches each quarter."""
_EVERY_PX, _EVERY_ROW = 16, 4


def looked_at(frame: Frame) -> Frame:
    """The part of a frame that `verify` looks at, a small one: the table waits meanwhile."""
    return replace(frame, pixels=frame.pixels[::_EVERY_ROW, ::_EVERY_PX].copy())


def verify(
    shot: Shot, frame: Frame, dark: Frame | None, previous: Frame | None, strobe: Strobe
) -> None:
    """The frame itself: begun after the strobe, whole, and lit.

    frame, dark, previous: from `looked_at`; dark is without LEDs, at the same exposure, and previous
    the lit frame before this one. CameraError or RigError says what is wrong.
    """
    if frame.started_us < strobe.time_us:
        raise CameraError(
            f"Shot {shot.index + 1}: the camera's frame was begun before the light had settled; "
            "run turnlight doctor to check the camera."
        )
    if dark is None:
        return
    unlit = _means(frame) - _means(dark) < NO_LIGHT
    torn = max(_torn_rows(frame, dark, previous), unlit.sum() * len(frame.pixels) // _PARTS)
    if unlit.all():
        raise RigError(
            f"Shot {shot.index + 1}: LED {listed(shot.leds)} gives no light; check its plug and "
            "cable, or replace it."
        )
    if torn > BY_CHANCE:
        raise CameraError(
            f"Shot {shot.index + 1}: the camera's frame is torn ({torn / len(frame.pixels):.0%} of "
            "its rows are missing or of the frame before); check the camera's cable and USB port."
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


def listed(leds: tuple[int, ...]) -> str:
    return ", ".join(map(str, leds)) or "none"


def _torn_rows(frame: Frame, dark: Frame, previous: Frame | None) -> int:
    """Rows that carry no noise though the dark frame's do, or that repeat the frame before to the bit."""
    here, unlit = frame.pixels, dark.pixels
    noisy = _noisy(here)
    torn = ~noisy & _noisy(unlit)
    if previous is not None and previous.pixels.shape == here.shape:
        torn |= noisy & _same(here, previous.pixels) & ~_same(here, unlit)
    return int(torn.sum())


def _noisy(rows: npt.NDArray[np.uint16]) -> npt.NDArray[np.bool_]:
    """Rows in which neighbours differ, and not just beside a stuck pixel."""
    noisy: npt.NDArray[np.bool_] = np.mean(rows[:, 1:] != rows[:, :-1], axis=(1, 2)) > 0.1
    return noisy


def _same(rows: npt.NDArray[np.uint16], others: npt.NDArray[np.uint16]) -> npt.NDArray[np.bool_]:
    same: npt.NDArray[np.bool_] = np.all(rows == others, axis=(1, 2))
    return same


def _means(frame: Frame) -> npt.NDArray[np.float64]:
    """(_PARTS,) of the parts that lie above each other."""
    parts = np.array_split(linear(frame, frame.pixels), _PARTS)
    return np.array([part.mean(dtype=np.float64) for part in parts])
