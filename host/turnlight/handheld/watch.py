"""A folder into which photos come: from a cable, a card, or a program that keeps phone and computer alike."""

import os
import threading
from collections.abc import Callable
from pathlib import Path

from turnlight.errors import SessionError

SUFFIXES = frozenset({".jpg", ".jpeg", ".png", ".tif", ".tiff", ".heic", ".heif", ".dng"})
LOOK_EVERY_S = 0.5

Stamp = tuple[int, int]
"""Time of the last change in ns, and size."""


class Watch:
    """Tells of every photo in a folder, those that lie there first; of each as soon as it no longer grows.

    It looks, and asks no one to be told, which works on a network's disk as well.
    """

    def __init__(self, folder: Path, take: Callable[[Path], None]) -> None:
        """Raises SessionError if the folder cannot be read."""
        self._folder = folder
        self._take = take
        self._taken: dict[Path, Stamp] = {}
        self._seen = self._look()
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._run, name="watch", daemon=True)

    def __enter__(self) -> "Watch":
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._ended.set()
        self._thread.join()

    def _run(self) -> None:
        while not self._ended.wait(LOOK_EVERY_S):
            try:
                now = self._look()
            except SessionError:
                continue  # a disk that is away for a moment
            still = [p for p, stamp in now.items() if self._seen.get(p) == stamp and stamp[1]]
            for path in sorted(still, key=lambda p: (now[p][0], p.name)):
                if self._taken.get(path) != now[path]:
                    self._taken[path] = now[path]
                    self._take(path)
            self._seen = now

    def _look(self) -> dict[Path, Stamp]:
        try:
            with os.scandir(self._folder) as entries:
                return {
                    Path(entry.path): (entry.stat().st_mtime_ns, entry.stat().st_size)
                    for entry in entries
                    if _is_photo(entry) and entry.is_file()
                }
        except OSError as error:
            reason = (error.strerror or str(error)).lower()
            raise SessionError(f"Cannot watch {self._folder}: {reason}; name another.") from error


def _is_photo(entry: os.DirEntry[str]) -> bool:
    return Path(entry.name).suffix.lower() in SUFFIXES and not entry.name.startswith(".")
