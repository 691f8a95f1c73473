"""What every camera offers, real or simulated."""

from typing import Protocol

from turnlight.frame import Exposure, Frame


class Camera(Protocol):
    """A camera that looks at the table."""

    def capture(self, exposure: Exposure) -> Frame:
        """One frame, begun after this call and taken with exactly this exposure.

        Raises CameraError when no such frame arrives.
        """
        ...

    def close(self) -> None:
        """Give the device back; calling it again does nothing."""
        ...
