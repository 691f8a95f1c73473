"""One run, on a thread of its own: from homing to the last file, over interruptions."""

from collections.abc import Callable
from contextlib import AbstractContextManager
from dataclasses import dataclass
from pathlib import Path

from svbrdf.materials import MaterialError
from turnlight.capture import events
from turnlight.capture.control import STOPPED, Control, Wish
from turnlight.capture.manifest import Manifest
from turnlight.capture.pipeline import Estimator
from turnlight.capture.session import Session
from turnlight.capture.shooting import Shooting, StoppedError
from turnlight.capture.state import State
from turnlight.errors import TurnlightError
from turnlight.rig.rig import Rig

BuildRig = Callable[[Manifest], AbstractContextManager[Rig]]
NewEstimator = Callable[[], Estimator]


@dataclass(frozen=True)
class Job:
    """What to capture: a session to be made in `folder`, or one to go on with.

    retake: indices of shots to be taken again, before those that are missing. finish: take no shot, and
    finish with what there is.
    """

    manifest: Manifest
    folder: Path
    session: Session | None = None
    retake: tuple[int, ...] = ()
    finish: bool = False


class Run:
    """Does a job. `go` is the thread; whatever is wished of it comes by `control`.

    rig: while one is connected.
    """

    def __init__(
        self, job: Job, build_rig: BuildRig, new_estimator: NewEstimator, control: Control
    ) -> None:
        self.rig: Rig | None = None
        self._job = job
        self._build_rig = build_rig
        self._new_estimator = new_estimator
        self._control = control
        self._shooting: Shooting | None = None

    def go(self) -> None:
        """To the end: the engine is idle afterwards, or faulted by a defect of the program."""
        try:
            self._go()
        except Exception as error:
            safe = self._shooting.safe if self._shooting else 0
            cause = f"The program failed ({type(error).__name__}: {error}); report it to support."
            self._control.enter(State.FAULTED)
            self._control.hub.publish(events.Faulted(safe, cause))
        finally:
            if self._shooting is not None:
                self._shooting.close()

    def _go(self) -> None:
        wish = Wish.STOP if self._job.finish else None
        while wish is not Wish.DISMISS:
            try:
                if self._shooting is None and self._job.session is not None:
                    self._open(self._job.session)
                if wish is not Wish.STOP:
                    self._shoot()
                if self._shooting is not None:
                    self._control.enter(State.FINISHING)
                    self._shooting.finish()
                break
            except (TurnlightError, MaterialError) as error:
                if self._shooting is None:
                    self._control.hub.publish(events.Refused(str(error)))
                    break
                wish = self._interrupted(self._shooting, error)
        self._control.enter(State.IDLE)

    def _shoot(self) -> None:
        """Everything that needs the rig, until nothing is missing or the operator wants no more."""
        self._control.enter(State.HOMING)
        if self._shooting is not None:
            self._shooting.try_again()
            if not self._shooting.anything_missing():
                return
        with self._build_rig(self._job.manifest) as rig:
            shooting = self._shooting or self._open(self._new_session(rig))
            self.rig = rig
            try:
                shooting.shoot(rig)
            except StoppedError:
                return
            finally:
                self.rig = None

    def _new_session(self, rig: Rig) -> Session:
        manifest = self._job.manifest
        if rig.firmware:
            versions = {**manifest.versions, "firmware": rig.firmware}
            manifest = manifest.model_copy(update={"versions": versions})
        return Session(self._job.folder, manifest)

    def _open(self, session: Session) -> Shooting:
        self._shooting = Shooting(session, self._new_estimator(), self._control)
        self._shooting.retake(self._job.retake)
        return self._shooting

    def _interrupted(self, shooting: Shooting, error: Exception) -> Wish:
        """Tell why, and wait for what the operator wants."""
        cause = STOPPED if self._control.stopping_now else str(error)
        self._control.take_wish()
        shooting.save_rest()
        self._control.enter(State.INTERRUPTED)
        self._control.hub.publish(
            events.Interrupted(shooting.number, shooting.count, shooting.safe, cause)
        )
        while True:
            wish = self._control.take_wish(wait=True)
            shooting.drop(self._control.take_drops())
            if wish in (Wish.RESUME, Wish.STOP, Wish.DISMISS):
                shooting.mend()
                return wish
