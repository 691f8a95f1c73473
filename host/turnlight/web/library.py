"""The folder of sessions, as the page may touch it: by a name that is checked, and by nothing else."""

import shutil
import threading
import time
from collections.abc import Sequence
from pathlib import Path

from turnlight.capture.manifest import Manifest
from turnlight.capture.session import Session
from turnlight.catalogue import Catalogue, Entry
from turnlight.errors import SessionError
from turnlight.handheld.folder import is_handheld

TRASH = ".deleted"
KEPT_DAYS = 7


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

    def search(self, words: str) -> Sequence[Entry]:
        """The newest first, those that have every word in name, folder or barcode."""
        with self._lock:
            return self._catalogue.search(words)

    def folder(self, name: str) -> Path:
        """The session's folder. SessionError unless it is a folder directly under the root."""
        return self._inside(self.root, name)

    def manifest(self, name: str) -> Manifest:
        """Raises SessionError if there is none, it is damaged, or no rig captured it."""
        folder = self.folder(name)
        if is_handheld(folder):
            raise SessionError(
                f"{name} was photographed by hand; see it with: turnlight handheld --out {folder}"
            )
        return Session.open(folder).manifest

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
