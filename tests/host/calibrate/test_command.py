"""`turnlight calibrate` as a user types it."""

import json
from datetime import UTC, datetime
from pathlib import Path

import pytest
from typer.testing import CliRunner

from turnlight import calibrating
from turnlight.app import DEFAULT_RIG
from turnlight.calibration import Measured, load_calibration
from turnlight.cli import commands
from turnlight.config import RigConfig
from turnlight.rig.camera.oak import OakCamera
from turnlight.rig.camera.still import CameraInfo


@pytest.fixture
def rig_file(tmp_path: Path) -> Path:
    text = (DEFAULT_RIG.parent / "workshop.toml").read_text()
    file = tmp_path / "workshop.toml"
    file.write_text(text.replace("1014", "507").replace("760", "380"))
    return file


def run(*arguments: object) -> tuple[int, str]:
    result = CliRunner().invoke(commands, ["calibrate", *map(str, arguments)])
    return result.exit_code, result.output


def test_a_step_is_done_told_and_kept(rig_file: Path) -> None:
    code, output = run("--rig", rig_file, "--only", "dark", "--json")
    assert code == 0, output
    events = [json.loads(line) for line in output.splitlines()]
    assert [e["event"] for e in events] == ["place", *["seen"] * 5, "step", "calibrated"]
    assert events[-2]["passed"]
    kept = load_calibration(rig_file.with_name("workshop.calibration.toml"))
    assert list(kept.measured) == ["dark"]
    assert 0.0005 < kept.dark.level[1] < 0.005


def test_a_person_reads_pass_and_what_was_measured(rig_file: Path) -> None:
    code, output = run("--rig", rig_file, "--only", "dark")
    assert code == 0, output
    assert "PASS  dark: 0.2" in output
    assert "ok    room light" in output
    assert "The calibration is in" in output


def test_an_unknown_step_is_one_clear_sentence(rig_file: Path) -> None:
    code, output = run("--rig", rig_file, "--only", "lense")
    assert code == 1
    assert "no calibration step lense; choose among dark, geometry" in output


def test_a_step_that_fails_leaves_the_file_as_it_was(rig_file: Path) -> None:
    run("--rig", rig_file, "--only", "dark")
    file = rig_file.with_name("workshop.calibration.toml")
    before = file.read_bytes()
    code, output = run("--rig", rig_file, "--only", "lights", "--ball-mm", "5.0")
    assert code == 1
    assert "highlight" in output
    assert file.read_bytes() == before


def test_a_real_rig_asks_nobody_who_is_not_there(tmp_path: Path) -> None:
    text = (DEFAULT_RIG.parent / "workshop.toml").read_text()
    file = tmp_path / "real.toml"
    file.write_text(
        text.replace('driver = "simulated"', 'driver = "uvc"\ndevice = "/dev/video0"').replace(
            'port = "simulated"', 'port = "/dev/ttyUSB0"'
        )
    )
    code, output = run("--rig", file)
    assert code == 1
    assert "Nobody is there to put targets on the table" in output


def test_an_oaks_own_focal_length_is_the_start_until_it_is_measured() -> None:
    config = RigConfig.load(DEFAULT_RIG.parent / "workshop.toml").calibrated(None)
    camera = object.__new__(OakCamera)  # without a device
    camera.info = CameraInfo("OAK", "super", (1040.0, 1041.0), 30.0)
    started = calibrating.from_factory(config, camera)
    assert started.geometry.lens.focal_px == (1040.0, 1041.0)
    done = {"geometry": Measured(date=datetime.now(UTC), text="")}
    measured = config.calibrated(config.geometry.model_copy(update={"measured": done}))
    assert calibrating.from_factory(measured, camera) == measured
