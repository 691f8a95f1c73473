"""What is wished of a run and which state it is in, for the run's own thread and for everyone else's."""

import contextlib
import threading
from collections.abc import Iterator
from enum import IntEnum, auto

from turnlight.capture.events import StateChanged
from turnlight.capture.hub import Hub
from turnlight.capture.state import State
from turnlight.errors import RigError, RunError

STOPPED = "The operator stopped the rig; see that nothing is in its way, then resume."
_UNDER_WAY = frozenset({State.RUNNING, State.PAUSING, State.PAUSED})
VERBS: dict[str, frozenset[State]] = {
    "start": frozenset({State.IDLE}),
    "pause": frozenset({State.RUNNING}),
    "resume": frozenset({State.PAUSING, State.PAUSED, State.INTERRUPTED}),
    "stop": _UNDER_WAY | {State.HOMING, State.INTERRUPTED},
    "stop now": _UNDER_WAY | {State.HOMING},
    "retake": _UNDER_WAY | {State.INTERRUPTED},
    "drop": _UNDER_WAY | {State.INTERRUPTED},
    "dismiss": frozenset({State.INTERRUPTED, State.FAULTED}),
}
"""What may be asked in which states."""


class Wish(IntEnum):
    """What the run is to do at the next place where it can; a weaker wish does not undo a stronger."""

    PAUSE = auto()
    RESUME = auto()
    DISMISS = auto()
    STOP = auto()
    STOP_NOW = auto()


class Control:
    """State, wishes and listeners of one engine."""

    def __init__(self) -> None:
        self.hub = Hub()
        self._changed = threading.Condition()
        self._state = State.IDLE
        self._wish: Wish | None = None
        self._retakes: list[int] = []
        self._drops: list[int] = []
        self.release_lock = threading.Lock()
        """Held while the controller is released from a stop."""

    @property
    def state(self) -> State:
        with self._changed:
            return self._state

    @property
    def stopping_now(self) -> bool:
        with self._changed:
            return self._wish is Wish.STOP_NOW

    def start(self) -> None:
        """For anyone: claim the engine for a run."""
        with self._changed:
            self._check("start")
            self._wish = None
            self._retakes, self._drops = [], []
            self._enter(State.HOMING)

    def pause(self) -> None:
        """For anyone: pause when the shot under way is done."""
        with self._changed:
            self._check("pause")
            self._want(Wish.PAUSE)
            self._enter(State.PAUSING)

    def resume(self) -> None:
        """For anyone: go on after a pause or an interruption."""
        with self._changed:
            self._check("resume")
            if self._state is not State.PAUSING:
                self._want(Wish.RESUME)
                self._enter(State.HOMING if self._state is State.INTERRUPTED else State.RUNNING)
            elif self._wish is Wish.PAUSE:
                self._wish = None
                self._enter(State.RUNNING)

    def ask(self, verb: str, wish: Wish) -> None:
        """For anyone: one of the other verbs. RunError if the state does not allow it."""
        with self._changed:
            self._check(verb)
            self._want(wish)

    def dismiss(self) -> None:
        """For anyone: leave a run that is interrupted or faulted."""
        with self._changed:
            self._check("dismiss")
            if self._state is State.FAULTED:
                self._enter(State.IDLE)
            else:
                self._want(Wish.DISMISS)

    def ask_for(self, verb: str, index: int) -> None:
        """For anyone: retake or drop this shot."""
        with self._changed:
            self._check(verb)
            (self._retakes if verb == "retake" else self._drops).append(index)
            self._changed.notify_all()

    def enter(self, state: State) -> None:
        """For the run: it is in this state now."""
        with self._changed:
            self._enter(state)

    def take_wish(self, wait: bool = False) -> Wish | None:
        """For the run: what is wished. wait: until something is, a drop included, which gives None."""
        with self._changed:
            self._changed.wait_for(lambda: not wait or self._wish or self._drops)
            wish, self._wish = self._wish, None
            return wish

    def take_retakes(self) -> list[int]:
        with self._changed:
            taken, self._retakes = self._retakes, []
            return taken

    def take_drops(self) -> list[int]:
        with self._changed:
            taken, self._drops = self._drops, []
            return taken

    @contextlib.contextmanager
    def releasing(self) -> Iterator[None]:
        """For the run: around releasing the controller. RigError if the operator has stopped the rig."""
        with self.release_lock:
            if self.stopping_now:
                raise RigError(STOPPED)
            yield

    def wait(self, states: frozenset[State], timeout_s: float | None = None) -> bool:
        """For anyone: until the engine is in one of these states; False if it takes longer."""
        with self._changed:
            return self._changed.wait_for(lambda: self._state in states, timeout_s)

    def _check(self, verb: str) -> None:
        if self._state not in VERBS[verb]:
            allowed = " or ".join(sorted(VERBS[verb]))
            raise RunError(
                f"The run is {self._state}, and `{verb}` can be asked for only when it is {allowed}."
            )

    def _want(self, wish: Wish) -> None:
        self._wish = max(wish, self._wish or wish)
        self._changed.notify_all()

    def _enter(self, state: State) -> None:
        if self._state is not state:
            self._state = state
            self.hub.publish(StateChanged(state))
            self._changed.notify_all()
