"""The clock that a rig lives by: the wall's for a real one, virtual time for a simulated one."""

import time
from typing import Protocol


class Clock(Protocol):
    """Time as the rig's motions and lights experience it."""

    def now_s(self) -> float:
        """Seconds since some fixed moment; never goes back."""
        ...

    def sleep(self, seconds: float) -> None:
        """Let this much time pass on the rig."""
        ...


class WallClock:
    """Real time."""

    def now_s(self) -> float:
        return time.monotonic()

    def sleep(self, seconds: float) -> None:
        time.sleep(seconds)
