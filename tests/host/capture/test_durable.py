"""A file is whole and synced, or it is not there."""

import errno
import os
from pathlib import Path

import pytest

from turnlight.capture import durable
from turnlight.errors import SessionError


def test_a_file_is_replaced_whole(tmp_path: Path) -> None:
    path = tmp_path / "maps.png"
    durable.write(path, b"old")
    durable.write(path, b"new")
    assert path.read_bytes() == b"new"
    assert list(tmp_path.iterdir()) == [path]


def test_file_and_folder_are_synced_around_the_rename(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    steps: list[str] = []
    sync, rename = os.fsync, Path.replace

    def note_sync(descriptor: int) -> None:
        steps.append(f"sync {Path(f'/proc/self/fd/{descriptor}').readlink().name}")
        sync(descriptor)

    def note_rename(source: Path, target: Path) -> Path:
        steps.append("rename")
        return rename(source, target)

    monkeypatch.setattr(os, "fsync", note_sync)
    monkeypatch.setattr(Path, "replace", note_rename)
    durable.write(tmp_path / "000.png", b"bits")
    assert steps == ["sync .000.png.partial", "rename", f"sync {tmp_path.name}"]


@pytest.mark.parametrize(
    ("code", "cause"),
    [
        (errno.ENOSPC, "the disk is full; free some space"),
        (errno.EACCES, "you may not write there"),
        (errno.EIO, "input/output error"),
    ],
)
def test_what_the_disk_refuses_leaves_the_old_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, code: int, cause: str
) -> None:
    path = tmp_path / "session.json"
    durable.write(path, b"old")

    def refuse(descriptor: int) -> None:
        raise OSError(code, os.strerror(code))

    monkeypatch.setattr(os, "fsync", refuse)
    with pytest.raises(SessionError, match=cause) as caught:
        durable.write(path, b"new")
    assert str(caught.value).count(". ") == 0
    assert str(path) in str(caught.value)
    assert path.read_bytes() == b"old"
    assert list(tmp_path.iterdir()) == [path]


def test_a_folder_with_something_in_it_is_refused(tmp_path: Path) -> None:
    (tmp_path / "precious.txt").touch()
    with pytest.raises(SessionError, match="not empty and nothing in it will be overwritten"):
        durable.create_folder(tmp_path)
    with pytest.raises(SessionError, match="is a file"):
        durable.create_folder(tmp_path / "precious.txt")
    with pytest.raises(SessionError, match="part of its path is a file"):
        durable.create_folder(tmp_path / "precious.txt/session")


def test_parents_are_made(tmp_path: Path) -> None:
    durable.create_folder(tmp_path / "sessions/oak")
    durable.create_folder(tmp_path / "sessions/oak")
    assert (tmp_path / "sessions/oak").is_dir()
