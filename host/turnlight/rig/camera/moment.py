"""One moment on two clocks: this computer's monotonic one, on which cameras tell when a frame began,
and the controller's, on which the rig tells when its light was on."""

import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Self


@dataclass(frozen=True)
class Moment:
    """host_s is at or after controller_us: the answer took its way, some 2 ms, to get here."""

    host_s: float
    controller_us: int

    @classmethod
    def now(cls, controller_time_us: Callable[[], int]) -> Self:
        """Ask the controller for its time."""
        controller_us = controller_time_us()
        return cls(time.monotonic(), controller_us)

    def controller_us_at(self, host_s: float) -> int:
        """A later moment on the controller's clock, or a little before it; never after it.

        So a frame that is said to have begun after a light was on, was.
        """
        return self.controller_us + int((host_s - self.host_s) * 1e6)
