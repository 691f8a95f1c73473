"""Nothing calls out: every process is watched from below, with telemetry asked for in the environment."""

import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

HERE = Path(__file__).parent
STAND_IN = HERE.parent / "host/rig/camera/oak_stand_in.py"
PHONING_S = 8
"""By then depthai, left alone, has tried to phone home."""
OAK = """
import time
from pathlib import Path
from turnlight.config import RigConfig
from turnlight.frame import Exposure
from turnlight.rig.camera.oak import OakCamera
config = RigConfig.load(Path({rig!r})).camera
config = config.model_copy(update=dict(device={device!r}, width_px=64, height_px=48))
camera = OakCamera(config, lambda: 0, ({stand_in!r},))
camera.capture(Exposure(20_000, 1.0))
time.sleep({seconds})
camera.capture(Exposure(20_000, 1.0))
camera.close()
"""
Watch = Callable[..., str]


@pytest.fixture(scope="module")
def guard(tmp_path_factory: pytest.TempPathFactory) -> Path:
    library = tmp_path_factory.mktemp("guard") / "network_guard.so"
    source = HERE / "network_guard.c"
    subprocess.run(
        ["gcc", "-shared", "-fPIC", "-Wall", "-Wextra", "-Werror", "-o", library, source, "-ldl"],
        check=True,
    )
    return library


@pytest.fixture
def watch(guard: Path, tmp_path: Path) -> Watch:
    """Runs a program and returns what it, and all it has started, tried to reach."""
    log = tmp_path / "network.log"

    def run(*command: object) -> str:
        asked_for = {"DEPTHAI_TELEMETRY": "1", "ORT_DISABLE_TELEMETRY": "0"}
        watched = {"LD_PRELOAD": str(guard), "NETWORK_LOG": str(log)}
        done = subprocess.run(
            [str(word) for word in command],
            cwd=tmp_path, env=os.environ | asked_for | watched,
            capture_output=True, text=True, check=False,
        )  # fmt: skip
        assert done.returncode == 0, done.stderr
        return log.read_text() if log.exists() else ""

    return run


def test_the_guard_sees_depthai_phone_home(watch: Watch) -> None:
    bare = f"import time, depthai as d; d.Pipeline(createImplicitDevice=False); time.sleep({PHONING_S})"
    assert "getaddrinfo" in watch(sys.executable, "-c", bare)


def test_the_process_of_an_oak_keeps_quiet(watch: Watch, tmp_path: Path) -> None:
    (tmp_path / "behaviour").write_text("good")
    script = OAK.format(
        rig=str(HERE.parents[1] / "rig_config/oak.toml"), device=str(tmp_path / "behaviour"),
        stand_in=str(STAND_IN), seconds=PHONING_S,
    )  # fmt: skip
    assert watch(sys.executable, "-c", script) == ""


def test_a_whole_capture_keeps_quiet(watch: Watch, small_rig: Path, tmp_path: Path) -> None:
    program = Path(sys.executable).with_name("turnlight")
    heard = watch(program, "capture", "--rig", small_rig, "--shots", 1, "--out", tmp_path / "s")
    assert heard == ""


def test_depthai_stays_in_its_own_process() -> None:
    script = "import sys, turnlight.cli; print('depthai' in sys.modules)"
    done = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, check=True
    )
    assert done.stdout == "False\n"


def test_the_method_alone_keeps_quiet(watch: Watch) -> None:
    script = "import os, svbrdf.onnx_model"
    assert (
        watch(sys.executable, "-c", f"{script}; assert os.environ['ORT_DISABLE_TELEMETRY'] == '1'")
        == ""
    )
