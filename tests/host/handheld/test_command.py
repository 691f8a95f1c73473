import json
from pathlib import Path

import cv2
import numpy as np
import pytest
from typer.testing import CliRunner

from turnlight import app
from turnlight.cli import commands
from turnlight.handheld.folder import is_handheld
from turnlight.handheld.handheld import Handheld


def run(*arguments: object) -> tuple[int, dict[str, object]]:
    result = CliRunner().invoke(commands, [*map(str, arguments), "--json"])
    return result.exit_code, json.loads(result.output)


@pytest.fixture
def desk(tmp_path: Path) -> Path:
    """A photo without a frame."""
    pixels = np.random.default_rng(0).integers(0, 255, (240, 320, 3), np.uint8)
    cv2.imwrite(str(tmp_path / "desk.jpg"), cv2.GaussianBlur(pixels, (0, 0), 3))
    return tmp_path / "desk.jpg"


def test_the_frame_is_written(tmp_path: Path) -> None:
    path = tmp_path / "frame.pdf"
    code, told = run("frame", "--size", "80x80mm", "--paper", "letter", "--out", path)
    assert code == 0
    assert told == {"path": str(path), "side_mm": 80, "markers": [480, 487]}
    assert path.read_bytes().startswith(b"%PDF")


def test_a_frame_that_cannot_be(tmp_path: Path) -> None:
    code, told = run("frame", "--size", "100x80mm", "--out", tmp_path / "frame.pdf")
    assert code == 1
    assert told["error"] == "The maps are square, so the opening is; make it 80mm."
    assert not list(tmp_path.iterdir())


def test_a_photo_without_a_frame_is_kept_and_the_sentence_says_what_to_do(
    desk: Path, tmp_path: Path
) -> None:
    out = tmp_path / "session"
    code, told = run("infer", desk, "--out", out)
    assert code == 1
    assert "turnlight frame" in str(told["error"])
    assert is_handheld(out)
    assert (out / "photos/001.jpg").read_bytes() == desk.read_bytes()
    assert not list((out / "maps").iterdir())


def test_what_is_no_photo_leaves_nothing(desk: Path, tmp_path: Path) -> None:
    (tmp_path / "notes.jpg").write_text("not a photo")
    out = tmp_path / "session"
    code, told = run("infer", desk, tmp_path / "notes.jpg", "--out", out)
    assert code == 1
    assert "notes.jpg" in str(told["error"])
    assert not out.exists()


def test_a_session_of_no_use_says_so(desk: Path, tmp_path: Path) -> None:
    out = tmp_path / "session"
    run("infer", desk, "--out", out)
    for command in (("refine", out), ("export", out, "--format", "gltf")):
        code, told = run(*command)
        assert code == 1
        assert str(told["error"]).endswith(".")
        assert "photo" in str(told["error"])


def test_a_folder_to_watch_that_is_not_there_leaves_nothing(tmp_path: Path) -> None:
    out = tmp_path / "session"
    asked = ("handheld", "--host", "127.0.0.1", "--port", 0, "--watch", tmp_path / "no")
    code, told = run(*asked, "--out", out)
    assert code == 1
    assert str(told["error"]).startswith(f"Cannot watch {tmp_path / 'no'}")
    assert not out.exists()
    begun = app.new_handheld("oak", 0.9, out)
    assert run(*asked, "--out", out)[0] == 1
    assert Handheld.open(out).manifest == begun.manifest
