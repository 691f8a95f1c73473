"""One attempt at a shot: the table turned, the LEDs lit, a frame taken and verified."""

import contextlib
import itertools
from collections.abc import Callable
from dataclasses import dataclass

from turnlight.capture import verify
from turnlight.capture.plan import Shot
from turnlight.capture.state import Step
from turnlight.errors import LinkError, RigError
from turnlight.frame import Exposure, Frame
from turnlight.rig.rig import Rig

SHORTER = 8
"""A bracketed shot's second exposure is this many times shorter."""


@dataclass(frozen=True)
class Taken:
    """A verified shot that is not yet on disk. short: its second exposure, where it is bracketed."""

    shot: Shot
    frame: Frame
    short: Frame | None
    reported_angle_deg: float


class Photographer:
    """Takes shots on a rig, one attempt at a time.

    saved_dark: gives the frame without LEDs that an earlier run has taken at an exposure, if any.
    report: is told how far a shot has come.
    """

    def __init__(
        self,
        rig: Rig,
        saved_dark: Callable[[Exposure], Frame | None],
        report: Callable[[Shot, Step], None],
    ) -> None:
        self._rig = rig
        self._saved_dark = saved_dark
        self._darks: dict[Exposure, Frame] = {}
        self._report = report
        self._strobes = itertools.count()
        self._previous: Frame | None = None

    def take_dark(self, exposure: Exposure) -> Frame:
        """A frame without LEDs. Raises CameraError, RigError or LinkError."""
        frame = take_dark(self._rig, exposure)
        self._darks[exposure] = verify.looked_at(frame)
        return frame

    def position(self, shot: Shot) -> None:
        """Turn the table to where the shot wants it, and see that it stands still there."""
        self._rig.controller.move(shot.angle_deg)
        self._report(shot, Step.POSITIONED)
        verify.verify_rest(shot, self._rig.controller.status())
        self._report(shot, Step.SETTLED)

    def expose(self, shot: Shot, bracketed: bool) -> Taken:
        """Light, photograph and verify. The LEDs are off afterwards; CameraError or RigError if not so."""
        rig, exposure = self._rig, Exposure(shot.exposure_us, shot.gain)
        rig.controller.light(shot.leds)
        rig.clock.sleep(rig.config.controller.settle_ms / 1000)
        strobe = rig.controller.trigger(next(self._strobes))
        verify.verify_lit(shot, strobe.leds)
        self._report(shot, Step.LIT)
        frame = _capture(rig, exposure)
        short = _capture(rig, shorter(exposure)) if bracketed else None
        after = rig.controller.status()
        rig.controller.off()
        self._report(shot, Step.EXPOSED)
        verify.verify_rest(shot, after)
        verify.verify_lit(shot, after.leds)
        seen = verify.looked_at(frame)
        verify.verify(shot, seen, self._dark(exposure), self._previous, strobe)
        self._previous = seen
        self._report(shot, Step.VERIFIED)
        return Taken(shot, frame, short, strobe.angle_deg)

    def _dark(self, exposure: Exposure) -> Frame | None:
        if exposure not in self._darks and (saved := self._saved_dark(exposure)):
            self._darks[exposure] = verify.looked_at(saved)
        return self._darks.get(exposure)


def take_dark(rig: Rig, exposure: Exposure) -> Frame:
    """A frame without LEDs. Raises CameraError, RigError or LinkError."""
    rig.controller.off()
    rig.clock.sleep(rig.config.controller.settle_ms / 1000)
    return _capture(rig, exposure)


def shorter(exposure: Exposure) -> Exposure:
    """The second exposure of a bracketed shot."""
    return Exposure(max(100, exposure.exposure_us // (100 * SHORTER) * 100), exposure.gain)


def lights_off(rig: Rig) -> None:
    """Off if the line still works; if it does not, the rig switches itself off within a second."""
    with contextlib.suppress(LinkError, RigError):
        rig.controller.off()


def _capture(rig: Rig, exposure: Exposure) -> Frame:
    frame = rig.camera.capture(exposure)
    verify.verify_exposure(exposure, frame)
    return frame
