"""The bundle for support: everything about the rig, nothing of the sample's looks."""

import json
import zipfile
from pathlib import Path

import cv2
import numpy as np
import pytest
from typer.testing import CliRunner

from turnlight import bundle, cli
from turnlight.doctor import Check
from turnlight.errors import SessionError

CHECKS = [Check("camera", False, "The camera hangs; unplug it.")]
PICTURES = {"dark.png", "contact_sheet.png", "shots/000.png", "maps/normal.png"}


@pytest.fixture
def rig(tmp_path: Path) -> Path:
    (tmp_path / "bench.calibration.json").write_text("{}")
    (tmp_path / "other.toml").write_text("")
    rig = tmp_path / "bench.toml"
    rig.write_text('name = "bench"')
    return rig


@pytest.fixture
def sessions(tmp_path: Path) -> Path:
    picture = np.zeros((8, 8, 3), np.uint8)
    for number in range(5):
        folder = tmp_path / f"sessions/s{number}"
        for name in PICTURES:
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            cv2.imwrite(str(folder / name), picture)
        (folder / "shots/000.json").write_text("{}")
        (folder / "session.json").write_text(json.dumps({"sample": f"s{number}"}))
    return tmp_path / "sessions"


def is_picture(content: bytes) -> bool:
    return cv2.imdecode(np.frombuffer(content, np.uint8), cv2.IMREAD_UNCHANGED) is not None


def test_no_picture_unless_asked(tmp_path: Path, rig: Path, sessions: Path) -> None:
    path = tmp_path / "support.zip"
    bundle.write_bundle(path, CHECKS, rig, sessions)
    with zipfile.ZipFile(path) as file:
        names = set(file.namelist())
        assert not any(is_picture(file.read(name)) for name in names if file.read(name))
        assert json.loads(file.read("doctor.json"))[0]["text"] == CHECKS[0].text
        assert "depthai" in json.loads(file.read("computer.json"))["packages"]
        assert isinstance(json.loads(file.read("usb.json")), list)
    assert names == {
        "doctor.json", "computer.json", "usb.json", "service.log",
        "rig/bench.toml", "rig/bench.calibration.json",
        *(f"sessions/s{i}/{name}" for i in (2, 3, 4) for name in ("session.json", "shots/000.json")),
    }  # fmt: skip


def test_pictures_when_asked(tmp_path: Path, rig: Path, sessions: Path) -> None:
    names = bundle.write_bundle(tmp_path / "support.zip", CHECKS, rig, sessions, pictures=True)
    assert {f"sessions/s4/{name}" for name in PICTURES} <= set(names)


def test_a_file_that_is_there_is_left_alone(tmp_path: Path, rig: Path) -> None:
    path = tmp_path / "support.zip"
    path.write_text("mine")
    with pytest.raises(SessionError, match="is there already"):
        bundle.write_bundle(path, CHECKS, rig, tmp_path / "none")
    assert path.read_text() == "mine"
    with pytest.raises(SessionError, match="no such file or directory"):
        bundle.write_bundle(tmp_path / "none/support.zip", CHECKS, rig, tmp_path / "none")


def test_the_command(tmp_path: Path) -> None:
    """A rig file that cannot be read is exactly what support wants to see."""
    path = tmp_path / "support.zip"
    result = CliRunner().invoke(
        cli.commands,
        [
            "doctor",
            "--rig",
            str(tmp_path / "none.toml"),
            "--bundle",
            str(path),
            "--in",
            str(tmp_path),
        ],
    )
    assert result.exit_code == 1
    assert f"{path} has 4 files for support." in result.stderr
    with zipfile.ZipFile(path) as file:
        assert "none.toml" in json.loads(file.read("doctor.json"))[0]["text"]
