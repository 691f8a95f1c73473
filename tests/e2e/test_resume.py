"""`turnlight resume`: what a person does after an interruption, on the command line."""

import json
import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest
from typer.testing import CliRunner

from turnlight import cli
from turnlight.capture.session import Session

SHOTS = 15
PRESS_CTRL_C = """
import os, signal, sys
from turnlight import cli
signal.signal(signal.SIGINT, signal.default_int_handler)
write = sys.stdout.write
def watched(text):
    written = write(text)
    if text.startswith("Shot 2/"):
        os.kill(os.getpid(), signal.SIGINT)
    return written
sys.stdout.write = watched
cli.main()
"""
"""Presses it at the second shot, however fast the machine; another process could come late. What a shell
starts in the background is deaf to it, and so are the tests there, but for the handler."""


def turnlight(*arguments: object) -> tuple[int, str, str]:
    result = CliRunner().invoke(cli.commands, [str(a) for a in arguments])
    if result.exception is not None and not isinstance(result.exception, SystemExit):
        raise result.exception
    return result.exit_code, result.stdout, result.stderr


@pytest.fixture(scope="module")
def interrupted(tmp_path_factory: pytest.TempPathFactory, small_rig_file: Callable) -> Path:
    """A session that Ctrl-C has ended after two shots or three."""
    folder = tmp_path_factory.mktemp("interrupted")
    rig = small_rig_file(folder / "rig.toml")
    options = ["--rig", rig, "--preset", "standard", "--shots", str(SHOTS)]
    process = subprocess.run(
        [sys.executable, "-c", PRESS_CTRL_C, "capture", *options, "--out", folder / "session"],
        capture_output=True, text=True, timeout=60, check=False,
    )  # fmt: skip
    assert process.returncode == 1
    safe = len(Session.open(folder / "session").manifest.used)
    assert 2 <= safe < SHOTS
    assert process.stderr == (
        f"Stopped. {safe} shots safe. Go on with: turnlight resume {folder / 'session'}\n"
    )
    return folder / "session"


@pytest.fixture
def session(interrupted: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(interrupted, tmp_path / "session"))


def test_resume_takes_what_is_missing(session: Path, same_maps: Callable) -> None:
    before = {r.frame.sha256 for r in Session.open(session).manifest.used}
    code, stdout, stderr = turnlight("resume", session)
    assert code == 0, stderr
    assert f"{len(before)} of {SHOTS} shots are safe" in stdout
    manifest = Session.open(session).manifest
    assert len(manifest.used) == SHOTS
    assert before <= {r.frame.sha256 for r in manifest.used}
    assert manifest.finished is not None
    same_maps(session)


def test_retake_drop_and_finish(session: Path, same_maps: Callable) -> None:
    before = Session.open(session).manifest.used
    code, stdout, _ = turnlight("resume", session, "--drop", 1, "--finish", "--json")
    assert code == 0
    finished = json.loads(stdout.splitlines()[-1])
    assert (finished["kind"], finished["count"]) == ("finished", len(before) - 1)
    same_maps(session)
    code, _, stderr = turnlight("resume", session, "--retake", 2)
    assert code == 0, stderr
    used = Session.open(session).manifest.used
    assert [r.shot.index for r in used] == [*range(1, SHOTS)]
    assert used[0].frame.sha256 != before[1].frame.sha256
    same_maps(session)


def test_what_cannot_be_resumed_is_said(session: Path, tmp_path: Path) -> None:
    for arguments, because in (
        ((tmp_path,), "is not a session"),
        ((session, "--retake", 99), "There is no shot 99"),
        ((session, "--drop", 0), "There is no shot 0"),
    ):
        code, stdout, stderr = turnlight("resume", *arguments)
        assert (code, stdout) == (1, "")
        assert because in stderr
        assert stderr.count("\n") == 1
