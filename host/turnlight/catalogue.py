"""The catalogue: an index over a folder of sessions, so that thousands can be searched at once.

It holds nothing of its own. Every search is first brought up to date with the folders' session.json, so
an index that is lost, damaged or of an older version is simply made again. Who cannot wait for that reads
some, the latest first, and takes what is there.
"""

import contextlib
import os
import sqlite3
from collections.abc import Iterator
from dataclasses import dataclass
from datetime import UTC, date, datetime, time, timedelta
from pathlib import Path
from typing import Any, Self

from pydantic import BaseModel, ValidationError

from turnlight.errors import SessionError

INDEX = "catalogue.sqlite"
_VERSION = 2
_COLUMNS = "folder, sample, barcode, started, finished, planned, saved, problem"
_SCHEMA = f"""
    PRAGMA journal_mode = WAL;
    DROP TABLE IF EXISTS sessions;
    CREATE TABLE sessions (
        folder TEXT PRIMARY KEY, sample TEXT, barcode TEXT, started TEXT, finished TEXT,
        planned INTEGER, saved INTEGER, problem TEXT, words TEXT, stamp TEXT
    );
    CREATE INDEX by_start ON sessions (started DESC);
    PRAGMA user_version = {_VERSION};
"""


@dataclass(frozen=True)
class Entry:
    """One session. problem: why its session.json cannot be read, the rest then being a guess."""

    root: Path
    name: str
    sample: str
    barcode: str | None
    started: datetime
    finished: datetime | None
    planned: int
    saved: int
    problem: str | None

    @property
    def folder(self) -> Path:
        return self.root / self.name

    @property
    def state(self) -> str:
        """How far it got, in a few words."""
        if self.problem:
            return self.problem
        if self.finished:
            return f"{self.saved} shots"
        return f"interrupted at {self.saved}/{self.planned}"


class Catalogue:
    """The sessions in the subfolders of `root`; several processes may use it at once."""

    def __init__(self, root: Path) -> None:
        """Open the index in `root`, in memory if that is read-only. SessionError if there is no `root`."""
        if not root.is_dir():
            raise SessionError(
                f"There is no folder {root}; name the one that your sessions are in with --in."
            )
        self._root = root
        self._index = _open(root / INDEX)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        self._index.close()

    def search(
        self,
        text: str = "",
        barcode: str | None = None,
        since: date | None = None,
        until: date | None = None,
    ) -> list[Entry]:
        """The newest first. Every word of `text` must occur in sample name, folder or barcode.

        barcode: the whole one. since, until: days on which it was started, local time, both included.
        """
        self.refresh()
        where = _Where.words(text)
        if barcode is not None:
            where.add("barcode = ?", barcode)
        if since is not None:
            where.add("started >= ?", _utc(_midnight(since)))
        if until is not None:
            where.add("started < ?", _utc(_midnight(until + timedelta(days=1))))
        return self._entries(where)

    def part(self, text: str, offset: int, limit: int) -> tuple[int, list[Entry]]:
        """Of what `refresh` has read: how many sessions have these words, and `limit` of them."""
        where = _Where.words(text)
        count = f"SELECT count(*) FROM sessions WHERE {where.sql}"
        (total,) = self._index.execute(count, where.values).fetchone()
        return total, self._entries(where, offset, limit)

    def rebuild(self) -> None:
        """Forget everything and read the folders again."""
        with self._index:
            self._index.execute("DELETE FROM sessions")
        self.refresh()

    def refresh(self, most: int | None = None) -> bool:
        """Read what is new or has changed since last time, and forget what is gone.

        most: read no more than so many, the latest; True if that was all.
        """
        known = dict(self._index.execute("SELECT folder, stamp FROM sessions"))
        there = dict(_stamps(self._root))
        new = [name for name, stamp in there.items() if known.get(name) != stamp]
        changed = sorted(new, key=lambda name: _modified_ns(there[name]), reverse=True)[:most]
        gone = known.keys() - there.keys()
        if not changed and not gone:
            return True
        with self._index:
            self._index.executemany("DELETE FROM sessions WHERE folder = ?", [(n,) for n in gone])
            self._index.executemany(
                f"INSERT OR REPLACE INTO sessions ({_COLUMNS}, words, stamp) "
                "VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?)",
                (_row(self._root / name, there[name]) for name in changed),
            )
        return len(changed) == len(new)

    def _entries(self, where: "_Where", offset: int = 0, limit: int = -1) -> list[Entry]:
        query = (
            f"SELECT {_COLUMNS} FROM sessions WHERE {where.sql} "
            "ORDER BY started DESC, folder LIMIT ? OFFSET ?"
        )
        rows = self._index.execute(query, [*where.values, limit, offset])
        return [self._entry(row) for row in rows]

    def _entry(self, row: tuple[Any, ...]) -> Entry:
        name, sample, barcode, began, ended, planned, saved, problem = row
        started = datetime.fromisoformat(began)
        finished = datetime.fromisoformat(ended) if ended else None
        return Entry(self._root, name, sample, barcode, started, finished, planned, saved, problem)


@dataclass
class _Where:
    """Terms that all must hold, and the values in them."""

    terms: list[str]
    values: list[Any]

    @classmethod
    def words(cls, text: str) -> Self:
        words = text.casefold().split()
        return cls(["instr(words, ?) > 0"] * len(words), list(words))

    def add(self, term: str, value: Any) -> None:
        self.terms.append(term)
        self.values.append(value)

    @property
    def sql(self) -> str:
        return " AND ".join(self.terms) or "TRUE"


class _Head(BaseModel):
    """The part of session.json that is searched; whatever else is in there does not matter."""

    sample: str
    barcode: str | None = None
    started: datetime
    finished: datetime | None = None
    plan: list[Any] = []
    shots: list[Any] = []
    photos: list[Any] = []
    """Of a session that was photographed by hand, which plans nothing."""


def _open(path: Path) -> sqlite3.Connection:
    try:
        return _connect(path)
    except sqlite3.OperationalError:  # it cannot be written here
        return _connect(":memory:")
    except sqlite3.DatabaseError:  # it is no database, or a damaged one
        for name in (path, *(path.with_name(path.name + end) for end in ("-wal", "-shm"))):
            name.unlink(missing_ok=True)
        return _connect(path)


def _connect(where: Path | str) -> sqlite3.Connection:
    index = sqlite3.connect(where, timeout=10, check_same_thread=False)
    try:
        if index.execute("PRAGMA user_version").fetchone()[0] != _VERSION:
            index.executescript(_SCHEMA)
        if index.execute("PRAGMA quick_check").fetchone() != ("ok",):
            raise sqlite3.DatabaseError
    except BaseException:
        index.close()
        raise
    return index


def _stamps(root: Path) -> Iterator[tuple[str, str]]:
    """Each session's folder name, and what changes whenever its session.json does."""
    here = os.open(root, os.O_RDONLY | os.O_DIRECTORY)
    try:
        for name in os.listdir(here):  # noqa: PTH208 (of a descriptor)
            with contextlib.suppress(OSError):
                stat = os.stat(f"{name}/session.json", dir_fd=here)
                yield name, f"{stat.st_mtime_ns} {stat.st_size} {stat.st_ino}"
    finally:
        os.close(here)


def _modified_ns(stamp: str) -> int:
    return int(stamp.split(maxsplit=1)[0])


def _row(folder: Path, stamp: str) -> tuple[Any, ...]:
    try:
        head, problem = _Head.model_validate_json((folder / "session.json").read_bytes()), None
    except (OSError, ValidationError):
        started = datetime.fromtimestamp(_modified_ns(stamp) / 1e9, UTC)
        head, problem = _Head(sample=folder.name, started=started, plan=[]), "damaged session.json"
    words = " ".join((head.sample, folder.name, head.barcode or "")).casefold()
    finished = _utc(head.finished) if head.finished else None
    return (
        folder.name, head.sample, head.barcode, _utc(head.started), finished,
        len(head.plan or head.photos), len(head.shots or head.photos), problem, words, stamp,
    )  # fmt: skip


def _midnight(day: date) -> datetime:
    return datetime.combine(day, time())


def _utc(moment: datetime) -> str:
    """Text that sorts as time goes."""
    return moment.astimezone(UTC).isoformat(timespec="microseconds")
