"""What happens to a shot while the table moves on: saved, rectified, encoded, and the maps on disk."""

import time
from collections import deque
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

import numpy as np

from svbrdf.maps import Maps
from turnlight.capture import durable
from turnlight.capture.adaptive import Chooser
from turnlight.capture.contact_sheet import ContactSheet
from turnlight.capture.develop import Developer
from turnlight.capture.events import Enough, Event, Rebuilt, ShotDone
from turnlight.capture.manifest import ShotRecord
from turnlight.capture.plan import Shot, signed_turn_deg
from turnlight.capture.relight import relit
from turnlight.capture.session import SavedShot, Session, png_bytes
from turnlight.capture.shot import Taken
from turnlight.capture.state import Step
from turnlight.errors import ImageError, ModelError, TurnlightError
from turnlight.frame import Exposure, Frame
from turnlight.picture.picture import Picture
from turnlight.picture.rectify import Rectified

LOST_STEPS_DEG = 0.5
MOST_WAITING = 2
"""Shots that may wait to be encoded, each with its frame in memory."""


class Estimator(Protocol):
    """What turns pictures into maps, one at a time; the maps depend on the set of pictures alone."""

    def reset(self) -> None: ...
    def add(self, picture: Picture) -> Maps: ...


@dataclass(frozen=True)
class BadPicture:
    """A saved shot whose picture cannot be used, and why."""

    shot: Shot
    cause: str


class Pipeline:
    """Two workers, one that saves and one that encodes, so that a shot costs the run no time.

    The maps are always those of the session's used shots: a shot that is dropped or taken again
    rebuilds them from the saved frames, because a max cannot be undone.
    """

    def __init__(
        self,
        session: Session,
        estimator: Estimator,
        publish: Callable[[Event], None],
        report: Callable[[Shot, Step], None],
    ) -> None:
        self._session = session
        self._developer = Developer(session)
        self._estimator = estimator
        self._publish = publish
        self._report = report
        self._saver = ThreadPoolExecutor(1, "save")
        self._encoder = ThreadPoolExecutor(1, "encode")
        self._last_save: Future[Any] | None = None
        self._jobs: deque[Future[list[BadPicture]]] = deque()
        self._pace = _Pace()
        self._sound = True
        self._drawn: dict[int, str] = {}
        """What was encoded when the contact sheet was drawn."""
        self._forget()

    @property
    def enough(self) -> bool:
        """Have the last two pictures changed the maps by less than the preset's threshold?"""
        threshold = self._session.manifest.preset.enough_change
        return len(self._changes) > 1 and max(self._changes[-2:]) < threshold

    def submit(self, taken: Taken) -> None:
        """Save and encode a shot in the background."""
        self._pace.begin()
        save = self._saver.submit(self._save, taken)
        self._last_save = save
        self._jobs.append(self._encoder.submit(lambda: self._encode(save.result())))

    def submit_dark(self, frame: Frame) -> None:
        """Save a frame without LEDs in the background, and make it ready for the shots."""
        save = self._saver.submit(self._session.save_dark, frame)
        self._last_save = save
        self._jobs.append(self._encoder.submit(self._prepare_dark, save, frame.exposure))

    def rebuild(self) -> None:
        """Make the maps anew of the saved frames, in the background."""
        self._jobs.append(self._encoder.submit(self._rebuild))

    def wait_saved(self) -> None:
        """Until everything submitted so far is durable. Raises SessionError if one cannot be."""
        if self._last_save is not None:
            self._last_save.result()

    def collect(self, at_most: float = MOST_WAITING) -> Iterator[BadPicture]:
        """The unusable pictures found since last asked; waits while more than `at_most` shots wait.

        Raises SessionError, ModelError: what ended a worker's job.
        """
        while self._jobs and (len(self._jobs) > at_most or self._jobs[0].done()):
            job = self._jobs.popleft()
            self._sound = job.exception() is None and self._sound
            yield from job.result()

    def choose(self) -> Shot:
        """The shot to add to an adaptive plan; everything submitted must have been collected."""
        return self._chooser.choose(self._session.manifest.plan)

    def settle(self) -> None:
        """Wait for everything, whatever comes of it, and begin to rebuild the maps if a job has failed."""
        for job in self._jobs:
            self._sound = job.exception() is None and self._sound
        self._jobs.clear()
        self._last_save = None
        if not self._sound:
            self._sound = True
            self.rebuild()

    def draw_contact_sheet(self) -> None:
        """Draw the capture at a glance, in the background, when every shot submitted so far is in it."""
        self._jobs.append(self._encoder.submit(self._draw))

    @property
    def contact_sheet(self) -> Path | None:
        """Where it has been drawn; None if there was no picture to draw."""
        return self._session.folder / "contact_sheet.png" if self._drawn else None

    def close(self) -> None:
        """End the workers when they are done."""
        self._saver.shutdown()
        self._encoder.shutdown()

    def _forget(self) -> None:
        self._estimator.reset()
        self._sheet = ContactSheet(self._session.manifest.sample)
        self._maps: Maps | None = None
        self._encoded: dict[int, str] = {}
        """The hash of each shot's frame, by index."""
        self._changes: list[float] = []
        self._said_enough = False
        self._chooser = Chooser(self._session.manifest)

    def _save(self, taken: Taken) -> SavedShot:
        shot = taken.shot
        record = self._session.save_shot(shot, taken.frame, taken.reported_angle_deg, taken.short)
        self._report(shot, Step.SAVED)
        return SavedShot(record, taken.frame, taken.short)

    def _prepare_dark(self, save: Future[None], exposure: Exposure) -> list[BadPicture]:
        save.result()
        self._developer.without_leds(exposure)
        return []

    def _encode(self, saved: SavedShot) -> list[BadPicture]:
        shot, sha256 = saved.record.shot, saved.record.frame.sha256
        if self._encoded.get(shot.index, sha256) != sha256:
            bad = self._rebuild()
            record = self._current(shot)
        elif shot.index in self._encoded:
            bad, record = [], self._current(shot)
        else:
            bad, record = self._add(saved)
            if self._maps is not None and record is not None:
                self._session.save_maps(self._maps, relit(self._maps))
        if record is None:
            return bad
        self._report(shot, Step.ENCODED)
        done, count = len(self._encoded), self._session.manifest.count
        left_s = self._pace.seconds_left(len(self._session.manifest.missing))
        self._publish(ShotDone(shot.index + 1, done, count, record, record.change, left_s))
        if self.enough and not self._said_enough:
            self._said_enough = True
            self._publish(Enough(done, self._session.manifest.preset.enough_change))
        return bad

    def _rebuild(self) -> list[BadPicture]:
        self._forget()
        unusable = [bad for saved in self._session.saved() for bad in self._add(saved)[0]]
        if self._maps is not None:
            self._session.save_maps(self._maps, relit(self._maps))
        numbers = tuple(sorted(index + 1 for index in self._encoded))
        self._publish(Rebuilt(numbers, tuple(self._changes)))
        return unusable

    def _add(self, saved: SavedShot) -> tuple[list[BadPicture], ShotRecord | None]:
        """Into the maps in memory with one shot, and what was seen into its record."""
        shot = saved.record.shot
        try:
            seen = self._developer.develop(saved)
        except ImageError as error:
            self._session.discard(shot.index)
            return [BadPicture(shot, str(error))], None
        before, self._maps = self._maps, self._estimate(shot, seen.picture)
        self._encoded[shot.index] = saved.record.frame.sha256
        self._chooser.add(seen.picture, self._maps)
        self._sheet.add(seen.picture, self._maps)
        changed = None if before is None else change(before, self._maps)
        if changed is not None:
            self._changes.append(changed)
        measured = _measured(saved.record, seen, changed)
        record = saved.record if measured == saved.record else self._session.save_record(measured)
        return [], record

    def _draw(self) -> list[BadPicture]:
        if self._encoded == self._drawn:
            return []
        for count, maps in self._sheet.history.items():
            self._session.save_history(count, maps, relit(maps))
        durable.write(self._session.folder / "contact_sheet.png", png_bytes(self._sheet.draw()))
        self._drawn = dict(self._encoded)
        return []

    def _current(self, shot: Shot) -> ShotRecord | None:
        used = self._session.manifest.used
        return next((r for r in used if r.shot.index == shot.index), None)

    def _estimate(self, shot: Shot, picture: Picture) -> Maps:
        try:
            return self._estimator.add(picture)
        except TurnlightError:
            raise
        except Exception as error:
            raise ModelError(
                f"The network failed on shot {shot.index + 1} ({error}); its picture is saved, so "
                "resume, and run turnlight doctor if it happens again."
            ) from error


class _Pace:
    """How long the rest will take, at the pace since the first shot of this run."""

    def __init__(self) -> None:
        self._began_s: float | None = None
        self._done = 0

    def begin(self) -> None:
        self._began_s = self._began_s or time.monotonic()

    def seconds_left(self, shots: int) -> float:
        if self._began_s is None:
            return 0.0
        self._done += 1
        return (time.monotonic() - self._began_s) / self._done * shots


def change(before: Maps, after: Maps) -> float:
    """Mean absolute difference of two map sets, over all values of all four maps."""
    names = ("normal", "diffuse", "roughness", "specular")
    apart = [np.abs(getattr(after, n) - getattr(before, n)).ravel() for n in names]
    return float(np.concatenate(apart).mean())


def _measured(record: ShotRecord, seen: Rectified, changed: float | None) -> ShotRecord:
    """What the picture shows; and a table that is not where it says it is, named."""
    lost_deg = signed_turn_deg(record.reported_angle_deg, seen.measured_angle_deg)
    warning = None
    if abs(lost_deg) > LOST_STEPS_DEG:
        warning = (
            f"Lost steps: the table stands {lost_deg:+.1f} degrees from where the controller thinks "
            "it is; check the belt and that the table turns freely."
        )
    measured = {
        "measured_angle_deg": seen.measured_angle_deg % 360,
        "markers_seen": seen.markers_seen,
        "marker_residual_px": seen.marker_residual_px,
        "clipped": float(seen.picture.clipped.mean()),
        "change": changed,
        "warning": warning,
    }
    return record.model_copy(update=measured)
