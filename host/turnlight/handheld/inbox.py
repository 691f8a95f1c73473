"""Where photos arrive, from however many hands, and wait for their turn."""

import itertools
import logging
import os
import re
import shutil
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager, suppress
from dataclasses import dataclass, replace
from enum import StrEnum
from pathlib import Path
from typing import BinaryIO, Self

from turnlight.capture import durable
from turnlight.errors import ImageError, RunError, SessionError, TurnlightError
from turnlight.handheld.handheld import Handheld
from turnlight.handheld.verdict import Verdict

MOST_WAITING = 60
MOST_REFUSALS = 20
INCOMING = "incoming"
_PARTIAL = ".partial"
_LONGEST_NAME = 80
_LOG = logging.getLogger(__name__)


class Turn(StrEnum):
    WAITING = "waiting"
    CHECKING = "checking"
    REFUSED = "refused"


@dataclass(frozen=True)
class Arrival:
    """A file that has no verdict yet, or gets none. number: from 1. sentence: why it was refused."""

    number: int
    name: str
    turn: Turn = Turn.WAITING
    sentence: str | None = None


@dataclass(frozen=True)
class News:
    """All that a page shows. version: grows with every change."""

    version: int
    arrivals: tuple[Arrival, ...]
    verdicts: tuple[Verdict, ...]


class Inbox:
    """Hands photos to a `Handheld` one by one, in the order in which they came.

    What was received is on disk, in the session's folder, before it counts as received; what a program
    that ended left there is taken up by the next. Use as a context manager; at its end everything that
    waits has had its turn, unless a second interruption comes meanwhile.
    """

    def __init__(
        self, handheld: Handheld, tell: Callable[[Verdict | Arrival], None] = lambda _: None
    ) -> None:
        """tell: called with every verdict and every refusal, from the thread that works."""
        self._handheld = handheld
        self._tell = tell
        self._incoming = handheld.folder / INCOMING
        self._numbers = itertools.count(1)
        self._arrivals: dict[int, Arrival] = {}
        self._news = News(0, (), handheld.verdicts)
        self._lock = threading.Lock()
        self._hand = ThreadPoolExecutor(1, "photos")

    def __enter__(self) -> Self:
        for half in self._incoming.glob(f"*/{_PARTIAL}"):
            shutil.rmtree(half.parent)
        for path in sorted(self._incoming.glob("*/*"), key=lambda left: left.stat().st_mtime_ns):
            self._wait(path, keep=False)
        return self

    def __exit__(self, *_: object) -> None:
        self._hand.shutdown()
        with suppress(OSError):  # what could not be used stays
            self._incoming.rmdir()

    @property
    def folder(self) -> Path:
        return self._handheld.folder

    @property
    def sample(self) -> str:
        return self._handheld.manifest.sample

    @property
    def news(self) -> News:
        return self._news

    @contextmanager
    def receive(self, name: str) -> Iterator[BinaryIO]:
        """A file to write a photo into; it has been received when the block ends without an error.

        name: what the sender calls it. Raises RunError if too many photos wait, SessionError if the disk
        refuses.
        """
        with self._lock:
            waiting = sum(a.turn is not Turn.REFUSED for a in self._arrivals.values())
        if waiting >= MOST_WAITING:
            raise RunError(f"{waiting} photos wait already; send this one again in a minute.")
        folder = self._new_folder()
        partial = folder / _PARTIAL
        path = folder / _safe(name)
        try:
            with partial.open("wb") as file:
                yield file
                file.flush()
                os.fsync(file.fileno())
            partial.rename(path)
            durable.sync_folder(folder)
        except OSError as error:
            shutil.rmtree(folder, ignore_errors=True)
            reason = (error.strerror or str(error)).lower()
            raise SessionError(f"The photo cannot be saved: {reason}; free some space.") from error
        except BaseException:
            shutil.rmtree(folder, ignore_errors=True)
            raise
        self._wait(path, keep=False)

    def take(self, path: Path) -> None:
        """A file that stays where it is."""
        self._wait(path, keep=True)

    def force(self, number: int) -> tuple[Verdict, ...]:
        """As `Handheld.force`, when its turn comes."""
        return self._change(lambda: self._handheld.force(number))

    def leave_out(self, number: int) -> tuple[Verdict, ...]:
        """As `Handheld.leave_out`, when its turn comes."""
        return self._change(lambda: self._handheld.leave_out(number))

    def dismiss(self, number: int) -> None:
        """Forget a refusal."""
        with self._lock:
            found = self._arrivals.get(number)
            if found is not None and found.turn is Turn.REFUSED:
                del self._arrivals[number]
                self._publish()

    def wait(self) -> None:
        """Until everything that has come so far has had its turn."""
        self._hand.submit(lambda: None).result()

    def _wait(self, path: Path, keep: bool) -> None:
        arrival = Arrival(next(self._numbers), path.name)
        self._set(arrival)
        self._hand.submit(self._add, path, arrival, keep)

    def _add(self, path: Path, arrival: Arrival, keep: bool) -> None:
        self._set(replace(arrival, turn=Turn.CHECKING))
        try:
            verdicts = self._handheld.add([path])
        except TurnlightError as error:
            self._refuse(arrival, str(error))
            keep = keep or not isinstance(error, ImageError)
        except Exception:
            _LOG.exception("Cannot use %s", path)
            self._refuse(arrival, f"The program failed at {path.name}, which stays at {path}.")
            keep = True
        else:
            self._set(arrival, gone=True)
            for verdict in verdicts:
                self._tell(verdict)
        if not keep:
            shutil.rmtree(path.parent, ignore_errors=True)

    def _refuse(self, arrival: Arrival, sentence: str) -> None:
        refused = replace(arrival, turn=Turn.REFUSED, sentence=sentence)
        self._set(refused)
        self._tell(refused)

    def _change(self, work: Callable[[], tuple[Verdict, ...]]) -> tuple[Verdict, ...]:
        verdicts = self._hand.submit(work).result()
        with self._lock:
            self._publish()
        for verdict in verdicts:
            self._tell(verdict)
        return verdicts

    def _set(self, arrival: Arrival, gone: bool = False) -> None:
        with self._lock:
            self._arrivals[arrival.number] = arrival
            if gone:
                del self._arrivals[arrival.number]
            refused = [a.number for a in self._arrivals.values() if a.turn is Turn.REFUSED]
            for number in refused[:-MOST_REFUSALS]:
                del self._arrivals[number]
            self._publish()

    def _publish(self) -> None:
        """With the lock held."""
        self._news = News(
            self._news.version + 1, tuple(self._arrivals.values()), self._handheld.verdicts
        )

    def _new_folder(self) -> Path:
        for number in itertools.count(1):
            folder = self._incoming / f"{number:04d}"
            with suppress(FileExistsError):
                folder.mkdir(parents=True)
                return folder
        raise AssertionError


def _safe(name: str) -> str:
    """A plain file name, whatever a sender calls its file."""
    plain = re.sub(r"[^\w. ()-]+", "_", Path(name.replace("\\", "/")).name).strip(". ")
    stem, dot, suffix = plain.rpartition(".")
    return (stem[: _LONGEST_NAME - 10] + dot + suffix[:9]) or "photo"
