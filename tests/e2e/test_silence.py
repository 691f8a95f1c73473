"""Nothing calls out: every process is watched from below, with telemetry asked for in the environment."""

import os
import re
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
IMPORT = """
import importlib, os, sys
off = {"depthai": ("DEPTHAI_TELEMETRY", "0"), "onnxruntime": ("ORT_DISABLE_TELEMETRY", "1")}
class AtTheDoor:
    def find_spec(self, name, path=None, target=None):
        if name in off:
            print(os.environ[off[name][0]] == off[name][1])
            sys.exit()
sys.meta_path.insert(0, AtTheDoor())
importlib.import_module(sys.argv[1])
"""
CALLERS = sorted(
    ".".join(file.relative_to(root).with_suffix("").parts)
    for root in (HERE.parents[1] / "host", HERE.parents[1] / "model")
    for file in root.rglob("*.py")
    if re.search(r"^(import|from) (onnxruntime|depthai)", file.read_text(), re.MULTILINE)
)
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


@pytest.mark.parametrize("module", CALLERS)
def test_telemetry_is_off_before_the_library_is_imported(module: str) -> None:
    asked_for = {"DEPTHAI_TELEMETRY": "1", "ORT_DISABLE_TELEMETRY": "0"}
    done = subprocess.run(
        [sys.executable, "-c", IMPORT, module],
        env=os.environ | asked_for, capture_output=True, text=True, check=True,
    )  # fmt: skip
    assert done.stdout == "True\n"


def test_every_process_that_telemetry_could_come_from_is_known() -> None:
    assert CALLERS == [
        "svbrdf.onnx_model",
        "svbrdf.quantize",
        "turnlight.rig.camera.oak_device",
        "turnlight.rig.camera.oak_process",
    ]
