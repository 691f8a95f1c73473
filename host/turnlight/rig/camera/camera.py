"""What every camera offers, real or simulated."""

from typing import Protocol

from turnlight.frame import Exposure, Frame


class Camera(Protocol):
    """A camera that looks at the table."""

    @property
    def description(self) -> str:
        """Which camera this is and how it is connected, in a few words."""
        ...

    def capture(self, exposure: Exposure) -> Frame:
        """One frame, begun after this call and taken with exactly this exposure.

        Raises CameraError when no such frame arrives, at most 2 s and the exposure after the call.
        """
        ...

    def recover(self) -> None:
        """Make ready again after a CameraError. Call with the LEDs off: it may take 20 s.

        Raises CameraError while the camera is not there; calling it again tries again.
        """
        ...

    def close(self) -> None:
        """Give the device back; calling it again does nothing."""
        ...
