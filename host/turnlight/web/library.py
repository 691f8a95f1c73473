"""The folder of sessions, as the page may touch it: by a name that is checked, and by nothing else."""

import shutil
import threading
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from turnlight.catalogue import Catalogue, Entry
from turnlight.errors import SessionError

TRASH = ".deleted"
KEPT_DAYS = 7
AT_ONCE = 100
"""Sessions that are read before a search is answered; the page shows fewer."""
MORE, BREATH_S = 300, 0.01
"""Sessions that are read one after the other in the background, and how long others then have their turn."""


@dataclass(frozen=True)
class Found:
    """Some of `total` sessions. complete: False while not all folders have been read."""

    total: int
    entries: Sequence[Entry]
    complete: bool


class Library:
    """The sessions directly under `root`. Made if it is not there; what was deleted long ago goes."""

    def __init__(self, root: Path) -> None:
        """Raises SessionError if the folder cannot be made or read."""
        try:
            (root / TRASH).mkdir(parents=True, exist_ok=True)
        except OSError as error:
            reason = (error.strerror or str(error)).lower()
            raise SessionError(
                f"Cannot use {root} for sessions: {reason}; name another."
            ) from error
        self.root = root.resolve()
        self._catalogue = Catalogue(self.root)
        self._lock = threading.Lock()
        _empty(self.root / TRASH)

    def close(self) -> None:
        self._catalogue.close()

    def search(self, words: str, offset: int, limit: int) -> Found:
        """The newest first, those that have every word in name, folder or barcode.

        Of a folder that is read for the first time it does not wait for more than the latest.
        """
        with self._lock:
            complete = self._catalogue.refresh(AT_ONCE)
            total, entries = self._catalogue.part(words, offset, limit)
        return Found(total, entries, complete)

    def read(self) -> None:
        """Read all that is new, and let searches in meanwhile."""
        complete = False
        while not complete:
            with self._lock:
                complete = self._catalogue.refresh(MORE)
            time.sleep(BREATH_S)

    def folder(self, name: str) -> Path:
        """The session's folder. SessionError unless it is a folder directly under the root."""
        return self._inside(self.root, name)

    def delete(self, name: str) -> None:
        """Put a session where `restore` finds it for some days."""
        folder = self.folder(name)
        shutil.rmtree(self.root / TRASH / name, ignore_errors=True)
        target = folder.rename(self.root / TRASH / name)
        (target / ".deleted").touch()

    def restore(self, name: str) -> None:
        """Undo `delete`. SessionError if it is not there, or its place is taken."""
        folder = self._inside(self.root / TRASH, name)
        if (self.root / name).exists():
            raise SessionError(f"There is a session {name} already; rename it first.")
        (folder / ".deleted").unlink(missing_ok=True)
        folder.rename(self.root / name)

    def _inside(self, root: Path, name: str) -> Path:
        folder = root / name
        plain = not name.startswith(".") and folder.parent == root and folder.name == name
        if not (plain and folder.is_dir() and not folder.is_symlink()):
            raise SessionError("There is no such session; it may have been deleted.")
        return folder


def _empty(trash: Path) -> None:
    oldest_s = time.time() - KEPT_DAYS * 86400
    for folder in trash.iterdir():
        mark = folder / ".deleted"
        if mark.exists() and mark.stat().st_mtime < oldest_s:
            shutil.rmtree(folder, ignore_errors=True)
