"""What goes wrong on a bench, for tests that ask for it: a camera's faults, and LEDs that stay dark."""

from dataclasses import dataclass, field, replace
from enum import StrEnum

from turnlight.errors import CameraError
from turnlight.frame import Exposure, Frame
from turnlight.rig.camera.camera import Camera
from turnlight.simulation.camera import PhysicalState, SideChannel

PATIENCE_MS = 1500.0
"""How long a stalled camera is waited for."""


class CameraFault(StrEnum):
    """What befalls one frame; `UNPLUG` holds until the camera is plugged in again."""

    STALL = "stall"
    DROP = "drop"
    WRONG_EXPOSURE = "wrong exposure"
    TORN = "torn frame"
    UNPLUG = "unplug"


@dataclass
class FaultyCamera:
    """A camera to which `faults` happen, by the number of the frame, counted from 0."""

    camera: Camera
    board: SideChannel
    faults: dict[int, CameraFault] = field(default_factory=dict)
    taken: int = 0
    plugged_in: bool = True
    _previous: Frame | None = None

    @property
    def description(self) -> str:
        return f"{self.camera.description} with faults"

    def capture(self, exposure: Exposure) -> Frame:
        fault = self.faults.get(self.taken)
        self.taken += 1
        if fault is CameraFault.UNPLUG:
            self.plugged_in = False
        self._check_plug()
        if fault is CameraFault.STALL:
            self.board.advance(PATIENCE_MS)
            raise CameraError(
                "The camera gives no frames; check its cable, and that it has a USB 3 port to itself."
            )
        frame = self.camera.capture(exposure)
        if fault is CameraFault.DROP:
            raise CameraError("A frame was lost on its way from the camera; check its cable.")
        if fault is CameraFault.WRONG_EXPOSURE:
            frame = replace(frame, exposure=replace(exposure, exposure_us=exposure.exposure_us * 2))
        if fault is CameraFault.TORN:
            frame = self._torn(frame)
        self._previous = frame
        return frame

    def recover(self) -> None:
        self._check_plug()
        self.camera.recover()

    def close(self) -> None:
        self.camera.close()

    def _check_plug(self) -> None:
        if not self.plugged_in:
            raise CameraError("The camera has gone; plug it in again.")

    def _torn(self, frame: Frame) -> Frame:
        """The lower half is still that of the frame before, or empty."""
        pixels = frame.pixels.copy()
        half = len(pixels) // 2
        pixels[half:] = 0 if self._previous is None else self._previous.pixels[half:]
        return replace(frame, pixels=pixels)


@dataclass
class DeadLeds:
    """A board's side channel, on which these LEDs give no light, whatever the firmware believes."""

    board: SideChannel
    dead: frozenset[int] = frozenset()

    def state(self) -> PhysicalState:
        return self._darker(self.board.state())

    def advance(self, ms: float) -> PhysicalState:
        return self._darker(self.board.advance(ms))

    def _darker(self, state: PhysicalState) -> PhysicalState:
        leds = tuple(0 if n in self.dead else level for n, level in enumerate(state.leds))
        return _Seen(state.time_us, state.angle_deg, leds)


@dataclass(frozen=True)
class _Seen:
    time_us: int
    angle_deg: float
    leds: tuple[int, ...]
