"""turnlight capture --refine and turnlight refine, on the simulated rig with a small sensor."""

import json
from pathlib import Path

import cv2
import pytest
from typer.testing import CliRunner

from turnlight.capture.session import Session
from turnlight.cli import commands

from .conftest import rig_file

RUN = CliRunner()


@pytest.fixture(scope="module")
def session(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("refine")
    rig = rig_file(folder / "rig.toml", 676, 507)
    out = folder / "session"
    command = [
        "capture",
        "--rig",
        str(rig),
        "--shots",
        "4",
        "--refine",
        "--json",
        "--out",
        str(out),
    ]
    done = RUN.invoke(commands, command)
    assert done.exit_code == 0, done.output
    return out


@pytest.mark.timeout(300)
def test_a_refined_session_says_how_good_it_is(session: Path) -> None:
    record = Session.open(session).manifest.refinement
    assert record is not None
    assert record.relighting_error is not None
    assert 0 < record.relighting_error < 0.1
    assert set(record.relighting_error_by_shot) == {1, 2, 3, 4}
    assert record.bad_shots == ()
    assert record.highlight_reachable is not None
    for name in ("normal", "diffuse", "roughness", "specular"):
        image = cv2.imread(str(session / f"uncertainty/{name}.png"), cv2.IMREAD_UNCHANGED)
        assert image is not None
        assert image.shape[:2] == (256, 256)


@pytest.mark.timeout(300)
def test_refining_again_at_another_resolution(session: Path) -> None:
    done = RUN.invoke(commands, ["refine", str(session), "--resolution", "64", "--json"])
    assert done.exit_code == 0, done.output
    assert json.loads(done.output)["resolution"] == 64
    assert cv2.imread(str(session / "maps/roughness.png")).shape[:2] == (64, 64)


@pytest.mark.timeout(300)
def test_without_a_prior(session: Path) -> None:
    done = RUN.invoke(commands, ["refine", str(session), "--resolution", "32", "--no-prior"])
    assert done.exit_code == 0, done.output
    record = Session.open(session).manifest.refinement
    assert record is not None
    assert not record.prior


def test_a_folder_that_is_no_session(tmp_path: Path) -> None:
    done = RUN.invoke(commands, ["refine", str(tmp_path / "nothing"), "--json"])
    assert done.exit_code == 1
    assert "error" in json.loads(done.output)
