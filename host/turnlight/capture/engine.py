"""The engine: one run at a time, driven and followed from any thread."""

import contextlib
import threading
from collections.abc import Callable

from turnlight.capture.control import VERBS, Control, Wish
from turnlight.capture.events import Snapshot
from turnlight.capture.hub import Subscription
from turnlight.capture.run import BuildRig, Job, NewEstimator, Run
from turnlight.capture.state import State
from turnlight.errors import RunError, TurnlightError

SILENCE_S = 600.0
"""Nothing that a run at work does takes so long; the longest is to rebuild the maps of many shots."""
_AT_WORK = frozenset({State.HOMING, State.RUNNING, State.PAUSING})
_AT_REST = frozenset({State.IDLE, State.INTERRUPTED, State.FAULTED})


class Engine:
    """Runs one capture at a time: a technician swaps the samples by hand, so there is no queue.

    Every method returns at once and may be called from any thread; RunError says why a state does not
    allow it (`State` has the diagram). What comes of it is told to the subscriptions.
    """

    def __init__(self, build_rig: BuildRig, new_estimator: NewEstimator) -> None:
        self._build_rig = build_rig
        self._new_estimator = new_estimator
        self._control = Control()
        self._run: Run | None = None
        self._thread: threading.Thread | None = None

    @property
    def current(self) -> Snapshot:
        """The state now, and everything that has come of the run."""
        return self._control.hub.current

    @property
    def alive(self) -> bool:
        """False if nothing has come for SILENCE_S of a run that should be at work: its thread hangs."""
        at_work = self._control.state in _AT_WORK
        return not at_work or self._control.hub.silent_s < SILENCE_S

    @property
    def verbs(self) -> tuple[str, ...]:
        """What may be asked for now."""
        state = self._control.state
        return tuple(verb for verb, states in VERBS.items() if state in states)

    def subscribe(self, wake: Callable[[], None] = lambda: None) -> Subscription:
        """Every event from now on, after a Snapshot of what has been missed; `wake` says when."""
        return self._control.hub.subscribe(wake)

    def start(self, job: Job) -> None:
        """Begin a session, or go on with one."""
        self._control.start()
        self._run = Run(job, self._build_rig, self._new_estimator, self._control)
        self._thread = threading.Thread(target=self._run.go, name="run", daemon=True)
        self._thread.start()

    def pause(self) -> None:
        """Rest when the shot under way is done."""
        self._control.pause()

    def resume(self) -> None:
        """Go on, after an interruption with a rig connected anew and homed."""
        self._control.resume()

    def stop(self) -> None:
        """Finish with the shots that there are, when the one under way is done."""
        self._control.ask("stop", Wish.STOP)

    def stop_now(self) -> None:
        """Stop motor and LEDs through the firmware at once; the run is interrupted."""
        self._control.ask("stop now", Wish.STOP_NOW)
        self._halt()
        with self._control.release_lock:  # a recovery that was under way may have undone the first
            self._halt()

    def retake(self, number: int) -> None:
        """Take shot `number`, from 1, again, before any other."""
        self._control.ask_for("retake", self._index(number))

    def drop(self, number: int) -> None:
        """Let the maps do without shot `number`, from 1."""
        self._control.ask_for("drop", self._index(number))

    def dismiss(self) -> None:
        """Leave an interrupted or faulted run; its session can be gone on with later."""
        self._control.dismiss()

    def wait(self, timeout_s: float | None = None) -> bool:
        """Until the engine is idle, interrupted or faulted; False if that takes longer."""
        return self._control.wait(_AT_REST, timeout_s)

    def close(self) -> None:
        """Stop the rig if a run is on, leave the run, and wait for its end."""
        if not self._control.wait(_AT_REST, 0):
            with contextlib.suppress(RunError):
                self.stop_now()
            self.wait()
        with contextlib.suppress(RunError):
            self.dismiss()
        if self._thread is not None:
            self._thread.join()

    def _halt(self) -> None:
        rig = self._run.rig if self._run else None
        if rig is not None:
            with contextlib.suppress(TurnlightError):
                rig.controller.stop()

    def _index(self, number: int) -> int:
        count = self.current.count
        if not 1 <= number <= count:
            raise RunError(f"There is no shot {number}; the session has 1 to {count}.")
        return number - 1
