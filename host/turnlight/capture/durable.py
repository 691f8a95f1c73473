"""Files that are on disk when the call returns, and that are whole whenever they can be seen."""

import errno
import os
from collections.abc import Iterable
from pathlib import Path

from turnlight.errors import SessionError

_REMEDY = {
    errno.ENOSPC: "the disk is full; free some space, or choose another folder with --out",
    errno.EDQUOT: "the quota is used up; free some space, or choose another folder with --out",
    errno.EACCES: "you may not write there; choose another folder with --out",
    errno.EROFS: "the disk is read-only; choose another folder with --out",
    errno.ENOTDIR: "a part of its path is a file; choose another folder with --out",
}


def create_folder(path: Path) -> None:
    """Make a folder and its parents; SessionError if it is there already with something in it."""
    try:
        path.mkdir(parents=True, exist_ok=True)
        taken = any(path.iterdir())
        sync_folder(path.parent)
    except FileExistsError as error:
        raise SessionError(f"{path} is a file; choose another folder with --out.") from error
    except OSError as error:
        raise _cannot_write(path, error) from error
    if taken:
        raise SessionError(
            f"The folder {path} is not empty and nothing in it will be overwritten; "
            "choose a new one with --out."
        )


def write(path: Path, content: bytes | Iterable[bytes]) -> None:
    """Write a file under a temporary name, sync it, rename it into place and sync its folder.

    content: the whole, or one part after the other as they are made. A reader sees the old file or
    the new one, never a part. SessionError says what the disk said, and then nothing of the new file
    is left.
    """
    partial = path.with_name(f".{path.name}.partial")
    try:
        try:
            with partial.open("wb") as file:
                file.writelines([content] if isinstance(content, bytes) else content)
                file.flush()
                os.fsync(file.fileno())
            partial.replace(path)
        except BaseException:
            partial.unlink(missing_ok=True)
            raise
        sync_folder(path.parent)
    except OSError as error:
        raise _cannot_write(path, error) from error


def sync_folder(path: Path) -> None:
    """Have what a folder lists on disk; OSError says what the disk said."""
    descriptor = os.open(path, os.O_RDONLY | os.O_DIRECTORY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def _cannot_write(path: Path, error: OSError) -> SessionError:
    known = _REMEDY.get(error.errno or 0)
    return SessionError(f"Cannot write {path}: {known or (error.strerror or str(error)).lower()}.")
