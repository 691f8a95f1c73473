"""The commands: what they answer, and that every bad input gets one clear sentence."""

import json
import os
import subprocess
import sys
from pathlib import Path

import cv2
import numpy as np
import pytest
from typer.testing import CliRunner

from svbrdf import materials
from turnlight import cli
from turnlight.estimate.estimator import Estimator
from turnlight.handheld.aligned import load_aligned

REFERENCE = Path(__file__).parents[2] / "rig_config/simulated.toml"


def turnlight(*arguments: object) -> tuple[int, str, str]:
    result = CliRunner().invoke(cli.commands, [str(a) for a in arguments])
    if result.exception is not None and not isinstance(result.exception, SystemExit):
        raise result.exception
    return result.exit_code, result.stdout, result.stderr


@pytest.fixture
def photos(tmp_path: Path) -> list[Path]:
    random = np.random.default_rng(0)
    paths = [tmp_path / f"{name}.png" for name in "abc"]
    for path in paths:
        coarse = random.integers(0, 256, (16, 16, 3), dtype=np.uint8)
        cv2.imwrite(str(path), cv2.resize(coarse, (300, 300)))
    return paths


def maps_of(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in sorted((folder / "maps").iterdir())}


def test_infer_does_not_depend_on_order_nor_on_repetition(
    photos: list[Path], tmp_path: Path
) -> None:
    orders = [photos, photos[::-1], [*photos, photos[0]]]
    results = []
    for number, order in enumerate(orders):
        out = tmp_path / f"out{number}"
        code, stdout, stderr = turnlight("infer", "--aligned", *order, "--out", out)
        assert code == 0, stderr
        assert str(out / "contact_sheet.png") in stdout
        results.append(maps_of(out))
    assert all(result == results[0] for result in results)
    estimator = Estimator()
    for photo in photos:
        maps = estimator.add(load_aligned(photo))
    for name, png in materials.encode(maps).items():
        assert png == results[0][f"{name}.png"]


def test_infer_in_json(photos: list[Path], tmp_path: Path) -> None:
    code, stdout, _ = turnlight("infer", "--aligned", *photos, "--out", tmp_path / "o", "--json")
    assert code == 0
    answer = json.loads(stdout)
    assert answer["count"] == 3
    assert Path(answer["contact_sheet"]).exists()


def test_plan_shows_every_shot() -> None:
    code, stdout, _ = turnlight("plan", "--shots", 12)
    assert code == 0
    assert len(stdout.splitlines()) == 14
    assert "turns" in stdout.splitlines()[-1]
    answer = json.loads(turnlight("plan", "--shots", 12, "--json")[1])
    assert [shot["index"] for shot in answer["shots"]] == list(range(12))
    assert 0 < answer["minutes"] < 2
    assert answer["total_turn_deg"] > 0


def rig_file(folder: Path, *changes: tuple[str, str]) -> Path:
    text = REFERENCE.read_text()
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    path = folder / "rig.toml"
    path.write_text(text)
    return path


def assert_refused(out: Path, *arguments: object, because: str) -> None:
    """Exit code 1, one sentence on stderr, nothing in the output folder; the same in JSON."""
    code, stdout, stderr = turnlight(*arguments, "--out", out)
    assert (code, stdout) == (1, "")
    assert because in stderr
    assert stderr.count("\n") == 1
    assert stderr.endswith(".\n")
    assert ". " not in stderr
    assert not out.exists() or not any(out.iterdir())
    code, stdout, stderr = turnlight(*arguments, "--out", out, "--json")
    assert (code, stderr) == (1, "")
    assert because in json.loads(stdout.splitlines()[-1])["error"]


def test_bad_pictures(photos: list[Path], tmp_path: Path) -> None:
    out = tmp_path / "out"
    text = tmp_path / "notes.png"
    text.write_text("not an image")
    dot, wide = tmp_path / "dot.png", tmp_path / "wide.png"
    cv2.imwrite(str(dot), np.zeros((1, 1, 3), np.uint8))
    cv2.imwrite(str(wide), np.zeros((64, 128, 3), np.uint8))
    for bad, because in (
        (tmp_path / "missing.png", "missing.png"),
        (text, "notes.png"),
        (dot, "1x1"),
        (wide, "not square"),
        (tmp_path, "cannot be read"),
    ):
        assert_refused(out, "infer", "--aligned", photos[0], bad, because=because)
    code, stdout, stderr = turnlight("infer", photos[0], "--out", tmp_path / "kept")
    assert (code, stdout) == (1, "")
    assert "frame was not found" in stderr


def test_bad_rig_files(tmp_path: Path) -> None:
    out = tmp_path / "out"
    for change, because in (
        (("side_mm = 100.0", "side_inch = 4.0"), "perhaps side_mm is meant"),
        (("side_mm = 100.0\n", ""), "sample.side_mm is missing"),
        (('port = "simulated"', 'port = "/dev/ttyNOTHERE"'), "/dev/ttyNOTHERE"),
        (('driver = "simulated"', 'driver = "oak"'), "gives raw data"),
        (("count = 24", "count = 20"), "has 36 LEDs but the rig file describes 32"),
    ):
        rig = rig_file(tmp_path, change)
        assert_refused(out, "capture", "--rig", rig, because=because)
    assert_refused(out, "capture", "--rig", tmp_path / "no.toml", because="No such file")


def test_bad_samples(tmp_path: Path) -> None:
    out = tmp_path / "out"
    assert_refused(out, "capture", "--material", tmp_path / "none", because="does not exist")
    assert_refused(out, "capture", "--material", tmp_path, because="is not a material")
    assert_refused(out, "capture", "--shots", 865, because="ask for 1 to 864")


def test_an_existing_folder_is_left_alone(photos: list[Path], tmp_path: Path) -> None:
    (tmp_path / "out").mkdir()
    precious = tmp_path / "out/precious.txt"
    precious.write_text("mine")
    for command in (("infer", "--aligned", photos[0]), ("capture", "--shots", 1)):
        code, _, stderr = turnlight(*command, "--out", tmp_path / "out")
        assert code == 1
        assert "is not empty" in stderr
    assert list((tmp_path / "out").iterdir()) == [precious]


def test_doctor_names_what_fails(tmp_path: Path) -> None:
    rig = rig_file(tmp_path, ('port = "simulated"', 'port = "/dev/ttyNOTHERE"'))
    code, stdout, _ = turnlight("doctor", "--rig", rig)
    lines = stdout.splitlines()
    assert code == 1
    assert [line[:4] for line in lines] == ["OK  "] * 2 + ["FAIL"] * 3 + ["OK  "] * 3
    assert "/dev/ttyNOTHERE" in lines[2]
    assert "Not tried, because the check of the controller failed." in lines[3]
    code, stdout, _ = turnlight("doctor", "--rig", tmp_path / "no.toml", "--json")
    answer = json.loads(stdout)
    assert code == 1
    assert not answer["ok"]
    assert [check["ok"] for check in answer["checks"]] == [False] * 7 + [True]


def test_a_reset_without_a_camera_says_so() -> None:
    code, stdout, stderr = turnlight("doctor", "--reset-camera")
    assert (code, stdout) == (1, "")
    assert "No camera is plugged in" in stderr


def test_the_program_itself(tmp_path: Path) -> None:
    """No traceback, from any folder; the libraries that would phone home are told not to."""
    program = Path(sys.executable).with_name("turnlight")
    missing = subprocess.run(
        [program, "infer", "--aligned", "missing.png"],
        cwd=tmp_path, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert missing.returncode == 1
    assert missing.stderr.count("\n") == 1
    assert not list(tmp_path.iterdir())
    quiet = "import os, turnlight; print(*(os.environ[k] for k in "
    quiet += "('DEPTHAI_TELEMETRY', 'ORT_DISABLE_TELEMETRY')))"
    bare = {k: v for k, v in os.environ.items() if "TELEMETRY" not in k}
    answer = subprocess.run(
        [sys.executable, "-c", quiet], env=bare, capture_output=True, text=True, check=True
    )
    assert answer.stdout.split() == ["0", "1"]


def test_sessions_are_listed_and_found(tmp_path: Path) -> None:
    folder = tmp_path / "sessions/oak-1"
    folder.mkdir(parents=True)
    manifest = {"sample": "old oak", "barcode": "42", "started": "2026-11-22T12:00:00Z"}
    (folder / "session.json").write_text(json.dumps(manifest | {"plan": [{}, {}], "shots": [{}]}))
    root = ("--in", tmp_path / "sessions")
    code, stdout, _ = turnlight("sessions", *root)
    assert code == 0
    assert len(stdout.splitlines()) == 2
    assert "interrupted at 1/2" in stdout
    for search in (("oak", "old"), ("--barcode", 42), ("--since", "2026-11-21")):
        (found,) = json.loads(turnlight("sessions", *root, *search, "--json")[1])["sessions"]
        assert found["started"] == "2026-11-22T12:00:00Z"
    for search in (("elm",), ("--barcode", 4), ("--until", "2026-11-20")):
        assert json.loads(turnlight("sessions", *root, *search, "--json")[1])["sessions"] == []
    code, _, stderr = turnlight("sessions", "--in", tmp_path / "none")
    assert code == 1
    assert "There is no folder" in stderr
    assert stderr.count("\n") == 1
