"""The loop over a session's missing shots: pauses, retries, skips, retakes and drops."""

import contextlib
import math
import time
from collections import Counter
from collections.abc import Iterable
from dataclasses import replace
from functools import partial

from turnlight.capture import events
from turnlight.capture.control import STOPPED, Control, Wish
from turnlight.capture.exposure import find_exposure
from turnlight.capture.pipeline import MOST_WAITING, Estimator, Pipeline
from turnlight.capture.plan import Shot, total_turn_deg
from turnlight.capture.prepare import darks_missing, prepare
from turnlight.capture.recovery import ATTEMPTS, Recovery
from turnlight.capture.session import Session
from turnlight.capture.shot import Photographer, lights_off
from turnlight.capture.state import State, Step
from turnlight.errors import CameraError, ImageError, LinkError, RigError, TurnlightError
from turnlight.frame import Exposure, Frame
from turnlight.rig.rig import Rig

DROPPED = "Left out by the operator."
NONE, ANY = 0, math.inf
"""How many shots may wait to be looked at."""
MOST_SKIPPED_IN_A_ROW = 3
"""After so many, something is wrong with more than one shot, and a person has to look."""


class StoppedError(Exception):
    """The operator wants no more shots, and the data kept."""


class Shooting:
    """Takes the missing shots of a session on whatever rig it is prepared with."""

    def __init__(self, session: Session, estimator: Estimator, control: Control) -> None:
        self._session = session
        self._control = control
        self._publish = control.hub.publish
        self._pipeline = Pipeline(session, estimator, self._publish, self._report)
        self._retakes: list[int] = []
        self._submitted: set[int] = set()
        self._attempts: Counter[int] = Counter()
        self._skipped_in_a_row = 0
        self._began_s = time.monotonic()
        self._publish(
            events.Started(
                folder=session.folder,
                sample=session.manifest.sample,
                count=self.count,
                safe=tuple(record.shot.index + 1 for record in session.manifest.used),
                total_turn_deg=total_turn_deg(s.angle_deg for s in session.manifest.missing),
            )
        )
        if session.manifest.used:
            self._pipeline.rebuild()

    @property
    def safe(self) -> int:
        """Shots on disk."""
        return len(self._session.manifest.used)

    @property
    def count(self) -> int:
        return self._session.manifest.count

    @property
    def number(self) -> int:
        """Of the shot that is next, from 1."""
        missing = self._session.manifest.missing
        return missing[0].index + 1 if missing else self.count

    def try_again(self) -> None:
        """Go on from what is on disk; shots that were skipped are tried again."""
        self._submitted.clear()
        self._attempts.clear()
        self._skipped_in_a_row = 0
        self._session.reopen()

    def anything_missing(self) -> bool:
        """Is there a shot to take? Waits for the saved ones to be looked at if it seems not."""
        if self._next() is None:
            self._note_bad(NONE)
        manifest = self._session.manifest
        return self._next() is not None or len(manifest.plan) < manifest.count

    def shoot(self, rig: Rig) -> None:
        """Prepare the rig and take what is missing. The LEDs are off however this ends.

        Raises StoppedError when the operator wants no more, and CameraError, RigError, LinkError,
        SessionError or ModelError for what a person must see to.
        """
        recovery = Recovery(rig, self._control.releasing)
        photographer = Photographer(rig, self._saved_dark, self._report)
        try:
            prepare(rig, recovery, self._session, self._publish, self._pause_point)
            self._take_darks(photographer, recovery)
            self._control.enter(State.RUNNING)
            while True:
                self._take_missing(rig, photographer, recovery)
                self._pipeline.draw_contact_sheet()
                self._check_table(rig)
                self._note_bad(NONE)
                if self._enough() or self._next() is None:
                    return
        finally:
            lights_off(rig)

    def retake(self, indices: Iterable[int]) -> None:
        """Take these shots again, next; what is saved of them stays until there is better."""
        for index in indices:
            if index < len(self._session.manifest.plan):
                self._attempts[index] = 0
                self._retakes.append(index)

    def drop(self, indices: Iterable[int]) -> None:
        """Let the maps do without these shots."""
        for index in indices:
            self._session.drop(index, DROPPED)
            self._pipeline.rebuild()

    def save_rest(self) -> None:
        """Let the picture that is being saved come to its end, whatever it is."""
        with contextlib.suppress(TurnlightError):
            self._pipeline.wait_saved()

    def mend(self) -> None:
        """After an interruption: what a worker has left undone is done anew from the saved frames."""
        self._pipeline.settle()

    def finish(self) -> None:
        """The last files: everything that is saved is encoded, and the session closed."""
        self._pipeline.draw_contact_sheet()
        for bad in self._pipeline.collect(NONE):
            self._session.skip(bad.shot.index, bad.cause)
            self._publish(events.ShotSkipped(bad.shot.index + 1, bad.cause))
        self._session.finish()
        self._publish(
            events.Finished(self._session.folder, self.safe, self._pipeline.contact_sheet)
        )

    def close(self) -> None:
        """End the workers."""
        self._pipeline.close()

    def _take_darks(self, photographer: Photographer, recovery: Recovery) -> None:
        for exposure in darks_missing(self._session):
            self._pause_point()
            dark = recovery.insist(partial(photographer.take_dark, exposure))
            self._pipeline.wait_saved()
            self._pipeline.submit_dark(dark)

    def _take_missing(self, rig: Rig, photographer: Photographer, recovery: Recovery) -> None:
        """All that is missing as far as is known: the last pictures may turn out to be bad."""
        while not self._enough():
            self._note_bad()
            self._pause_point()
            shot = self._next()
            if shot is not None:
                self._take(shot, photographer, recovery)
            elif not self._choose(rig, photographer, recovery):
                return

    def _choose(self, rig: Rig, photographer: Photographer, recovery: Recovery) -> bool:
        """The most telling shot into the plan, if its order is adaptive; False when it is complete."""
        manifest = self._session.manifest
        if len(manifest.plan) == manifest.count:
            return False
        if not self._note_bad(NONE):
            shot = self._pipeline.choose()
            if manifest.preset.exposure == "test":
                angle_deg, thickness_mm = shot.angle_deg, manifest.thickness_mm
                recovery.insist(partial(rig.controller.move, angle_deg))
                lit = find_exposure(rig, recovery, shot.leds, thickness_mm, angle_deg)
                self._publish(events.ExposureFound(lit.leds, lit.exposure_us, lit.clipped))
                shot = replace(shot, exposure_us=lit.exposure_us)
            self._session.extend(shot)
            self._take_darks(photographer, recovery)
        return True

    def _take(self, shot: Shot, photographer: Photographer, recovery: Recovery) -> None:
        """One attempt; a failure is noted and recovered from."""
        self._report(shot, Step.PLANNED)
        try:
            photographer.position(shot)
            self._pipeline.wait_saved()
            taken = photographer.expose(shot, self._session.manifest.preset.bracketing)
        except (CameraError, RigError) as error:
            if self._control.stopping_now:
                raise
            self._failed(shot, error)
            recovery.recover(error)
            return
        if self._retakes[:1] == [shot.index]:
            self._retakes.pop(0)
        self._submitted.add(shot.index)
        self._skipped_in_a_row = 0
        self._pipeline.submit(taken)

    def _saved_dark(self, exposure: Exposure) -> Frame | None:
        record = self._session.dark_record(exposure)
        return self._session.dark_frame(record) if record else None

    def _next(self) -> Shot | None:
        self.retake(self._control.take_retakes())
        if self._retakes:
            return self._session.manifest.plan[self._retakes[0]]
        missing = self._session.manifest.missing
        return next((shot for shot in missing if shot.index not in self._submitted), None)

    def _enough(self) -> bool:
        return self._session.manifest.preset.stop_when_enough and self._pipeline.enough

    def _note_bad(self, at_most: float = MOST_WAITING) -> int:
        """How many unusable pictures the pipeline has found; each counts as a failed attempt.

        at_most: so many shots may still wait to be looked at.
        """
        unusable = list(self._pipeline.collect(at_most))
        for bad in unusable:
            self._submitted.discard(bad.shot.index)
            self._failed(bad.shot, ImageError(bad.cause))
        return len(unusable)

    def _failed(self, shot: Shot, error: TurnlightError) -> None:
        """Try again, or skip after the third attempt, which a retake does to no shot that is saved."""
        self._attempts[shot.index] += 1
        attempt, number = self._attempts[shot.index], shot.index + 1
        self._publish(events.ShotFailed(number, attempt, str(error)))
        if attempt < ATTEMPTS:
            return
        if self._retakes[:1] == [shot.index]:
            self._retakes.pop(0)
        if all(record.shot.index != shot.index for record in self._session.manifest.used):
            self._session.skip(shot.index, str(error))
        self._publish(events.ShotSkipped(number, str(error)))
        self._skipped_in_a_row += 1
        if self._skipped_in_a_row == MOST_SKIPPED_IN_A_ROW:
            self._skipped_in_a_row = 0
            raise error

    def _check_table(self, rig: Rig) -> None:
        """While the last pictures are encoded. Nothing depends on it, so a failure of it ends nothing."""
        try:
            self._publish(events.TableChecked(rig.controller.check(lambda: self._note_bad(ANY))))
        except (RigError, LinkError) as error:
            self._publish(events.TableChecked(None, str(error)))

    def _pause_point(self) -> None:
        """Where the operator's wishes are followed. Raises StoppedError, or RigError after a stop-now."""
        wish = self._control.take_wish()
        self.drop(self._control.take_drops())
        if wish is Wish.PAUSE:
            self._pipeline.wait_saved()
            self._control.enter(State.PAUSED)
            while wish not in (Wish.RESUME, Wish.STOP, Wish.STOP_NOW):
                wish = self._control.take_wish(wait=True)
                self.drop(self._control.take_drops())
        if wish is Wish.STOP:
            raise StoppedError
        if wish is Wish.STOP_NOW:
            raise RigError(STOPPED)

    def _report(self, shot: Shot, step: Step) -> None:
        at_s = time.monotonic() - self._began_s
        self._publish(events.ShotStep(shot.index + 1, step, at_s))
