"""What support needs to see of a rig, in one zip file; no picture of a sample unless it is asked for."""

import dataclasses
import json
import platform
import subprocess
import sys
import zipfile
from collections.abc import Iterable, Iterator, Sequence
from importlib import metadata
from pathlib import Path

from turnlight.doctor import Check
from turnlight.errors import SessionError
from turnlight.rig import usb

SESSIONS = 3
"""So many of the last sessions are told of."""
_LOG = ["journalctl", "--unit=turnlight", "--no-pager", "--lines=2000", "--output=short-iso"]


def write_bundle(
    path: Path, checks: Sequence[Check], rig_file: Path, sessions: Path, pictures: bool = False
) -> list[str]:
    """Write the zip file at `path`, which must not exist, and return the names of what is in it.

    rig_file: the rig's TOML; what lies beside it under the same name, as a calibration does, goes along.
    sessions: the folder of sessions, of the last of which the records are taken; pictures: and the rest.
    """
    try:
        with zipfile.ZipFile(path, "x", zipfile.ZIP_DEFLATED) as bundle:
            for name, content in _contents(checks, rig_file, sessions, pictures):
                if isinstance(content, Path):
                    bundle.write(content, name)
                else:
                    bundle.writestr(name, content)
            return bundle.namelist()
    except FileExistsError as error:
        raise SessionError(
            f"{path} is there already; choose another file with --bundle."
        ) from error
    except OSError as error:
        reason = (error.strerror or str(error)).lower()
        raise SessionError(f"Cannot write {path}: {reason}; choose another file.") from error


def _contents(
    checks: Sequence[Check], rig_file: Path, sessions: Path, pictures: bool
) -> Iterator[tuple[str, str | Path]]:
    yield "doctor.json", _json([dataclasses.asdict(check) for check in checks])
    yield "computer.json", _json(_computer())
    yield "usb.json", _json([str(device) for device in usb.devices()])
    yield "service.log", _log()
    if rig_file.is_file():
        beside = sorted(rig_file.parent.glob(f"{rig_file.stem}*"))
        yield from ((f"rig/{p.name}", p) for p in _wanted(beside, pictures))
    for folder in _last(sessions):
        files = sorted(folder.rglob("*"))
        for file in _wanted(files, pictures):
            yield f"sessions/{folder.name}/{file.relative_to(folder)}", file


def _wanted(files: Iterable[Path], pictures: bool) -> Iterator[Path]:
    for file in files:
        if file.is_file() and (pictures or file.suffix.lower() in {".json", ".toml"}):
            yield file


def _last(sessions: Path) -> list[Path]:
    manifests = sorted(sessions.glob("*/session.json"), key=lambda p: p.stat().st_mtime)
    return [manifest.parent for manifest in manifests[-SESSIONS:]]


def _computer() -> dict[str, object]:
    packages = {d.name: d.version for d in metadata.distributions()}
    return {
        "system": platform.platform(),
        "processor": platform.machine(),
        "python": sys.version,
        "packages": dict(sorted(packages.items())),
    }


def _log() -> str:
    try:
        return subprocess.run(_LOG, capture_output=True, text=True, check=False).stdout
    except OSError as error:
        return f"No journal: {error}"


def _json(value: object) -> str:
    return json.dumps(value, indent=2)
