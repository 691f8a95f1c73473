"""What to try before a person is called: make the rig ready again, and do it once more."""

import contextlib
from collections.abc import Callable
from contextlib import AbstractContextManager
from typing import TypeVar

from turnlight.errors import CameraError, RigError, TurnlightError
from turnlight.rig.rig import Rig

ATTEMPTS = 3
BY_HAND = {
    "stop": "The rig was stopped, by its button or by noise on its line; see that nothing is in its "
    "way, then resume.",
    "estop": "The emergency stop is or was pressed; release it, then resume.",
}
"""Faults that a person has brought about at the rig, which nothing but a person may undo."""

T = TypeVar("T")


class Recovery:
    """Makes `rig` ready again after a failure.

    releasing: entered while the controller is released from a stop; it raises RigError when the
    operator has stopped the rig, which nothing but the operator may undo.
    """

    def __init__(self, rig: Rig, releasing: Callable[[], AbstractContextManager[None]]) -> None:
        self._rig = rig
        self._releasing = releasing

    def insist(self, work: Callable[[], T]) -> T:
        """The result of `work`, which is tried three times, with a recovery in between."""
        for _ in range(ATTEMPTS - 1):
            try:
                return work()
            except (CameraError, RigError) as error:
                self.recover(error)
        return work()

    def recover(self, error: TurnlightError) -> None:
        """Greet the controller anew, clear its fault, and home if it has lost the angle.

        Raises CameraError, RigError or LinkError for what a person must see to.
        """
        rig = self._rig
        with contextlib.suppress(RigError):
            rig.controller.off()
        if isinstance(error, CameraError):
            rig.camera.recover()
        rig.controller.hello()
        if (state := rig.controller.status().state) in BY_HAND:
            raise RigError(BY_HAND[state])
        with self._releasing():
            rig.controller.clear()
        if not rig.controller.status().homed:
            rig.controller.home()
