"""The OAK driver with the real depthai library, on a pipeline whose camera node is a stand-in."""

import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from turnlight.config import CameraConfig, RigConfig
from turnlight.errors import CameraError
from turnlight.frame import Exposure
from turnlight.rig.camera.oak import OakCamera

RIG = Path(__file__).parents[4] / "rig_config/oak.toml"
STAND_IN = (str(Path(__file__).with_name("oak_stand_in.py")),)
BUSY_S = 6.0
"""What a machine that is busy with something else may add."""
RGB = (800, 401, 203)
EXPOSURE = Exposure(20_000, 2.0)


class Controller:
    """Its clock began to run 1000 s before ours."""

    def __init__(self) -> None:
        self.asked = 0

    def time_us(self) -> int:
        self.asked += 1
        return int((time.monotonic() + 1000) * 1e6)


@pytest.fixture
def controller() -> Controller:
    return Controller()


@pytest.fixture
def behaviour(tmp_path: Path) -> Path:
    path = tmp_path / "behaviour"
    path.write_text("good")
    return path


@pytest.fixture
def config(behaviour: Path) -> CameraConfig:
    small = {"device": str(behaviour), "width_px": 64, "height_px": 48}
    return RigConfig.load(RIG).camera.model_copy(update=small)


@pytest.fixture
def camera(config: CameraConfig, controller: Controller) -> Iterator[OakCamera]:
    camera = OakCamera(config, controller.time_us, STAND_IN)
    yield camera
    camera.close()


def test_a_still_is_the_one_that_was_asked_for(camera: OakCamera, controller: Controller) -> None:
    assert camera.description == "stand-in, USB SUPER"
    assert camera.info.focal_px == (3080.0, 3080.0)
    for exposure in (EXPOSURE, Exposure(5_000, 1.0), EXPOSURE):
        before_us = controller.time_us()
        frame = camera.capture(exposure)
        assert before_us < frame.started_us
        assert frame.started_us + exposure.exposure_us < controller.time_us()
        assert frame.exposure == exposure
        assert (frame.bit_depth, frame.gamma) == (10, 1.0)
        assert frame.pixels.shape == (48, 64, 3)
        assert np.array_equal(frame.pixels, np.broadcast_to(RGB, (48, 64, 3)))


def test_a_longer_exposure_streams_more_slowly(camera: OakCamera, controller: Controller) -> None:
    assert camera.info.frames_per_s == 30
    assert camera.capture(Exposure(300_000, 1.0)).exposure.exposure_us == 300_000
    assert camera.info.frames_per_s == pytest.approx(3)


@pytest.mark.parametrize(
    ("fault", "cause"),
    [
        ("stalled", "sends no pictures|The camera hangs"),  # the latter on a busy machine
        ("unplugged", "was unplugged"),
        ("aborts", "was unplugged or its driver has failed"),
        ("hangs", "The camera hangs"),
        ("deaf", "are exposed for 1000 us instead of 20000"),
        ("torn", "are torn"),
    ],
)
def test_a_fault_is_seen_within_two_seconds_and_recovered_from(
    behaviour: Path, config: CameraConfig, controller: Controller, fault: str, cause: str
) -> None:
    behaviour.write_text(fault)
    camera = OakCamera(config, controller.time_us, STAND_IN)
    asked, began = controller.asked, time.monotonic()
    with pytest.raises(CameraError, match=cause) as caught:
        camera.capture(EXPOSURE)
    assert time.monotonic() - began < 2 + BUSY_S
    assert ". " not in str(caught.value)
    assert str(caught.value).endswith(".")
    if fault in ("stalled", "hangs", "deaf", "torn"):
        assert controller.asked - asked >= 5  # the controller has heard from us meanwhile
    behaviour.write_text("good")
    camera.recover()
    assert camera.capture(EXPOSURE).exposure == EXPOSURE
    camera.close()
    camera.close()


def test_no_camera(behaviour: Path, config: CameraConfig, controller: Controller) -> None:
    camera = OakCamera(config, controller.time_us, STAND_IN)
    behaviour.unlink()
    with pytest.raises(CameraError, match="plug it in"):
        camera.recover()
    with pytest.raises(CameraError):
        camera.capture(EXPOSURE)
    behaviour.write_text("good")
    camera.recover()
    camera.capture(EXPOSURE)
    camera.close()
    with pytest.raises(CameraError, match="not connected"):
        camera.capture(EXPOSURE)


def test_another_size_than_the_rig_file_says(config: CameraConfig, controller: Controller) -> None:
    camera = OakCamera(config, controller.time_us, STAND_IN)
    camera._config = config.model_copy(update={"width_px": 128})
    with pytest.raises(CameraError, match="64 x 48 pixels and the rig file says 128 x 48"):
        camera.capture(EXPOSURE)
    camera.close()


def test_the_camera_is_free_again_when_its_host_was_killed(behaviour: Path) -> None:
    script = f"""
import time
from pathlib import Path
from turnlight.config import RigConfig
from turnlight.rig.camera.oak import OakCamera
config = RigConfig.load(Path({str(RIG)!r})).camera
config = config.model_copy(update=dict(device={str(behaviour)!r}, width_px=64, height_px=48))
camera = OakCamera(config, lambda: 0, ({STAND_IN[0]!r},))
print(camera._process.pid, flush=True)
time.sleep(60)
"""
    command = [sys.executable, "-c", script]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as host:
        assert host.stdout is not None
        process = Path(f"/proc/{host.stdout.readline().strip()}")
        assert process.exists()
        host.kill()
    until_s = time.monotonic() + 20
    while process.exists() and "Z" not in (process / "stat").read_text().split()[2]:
        assert time.monotonic() < until_s
        time.sleep(0.05)


def test_without_a_device(config: CameraConfig, controller: Controller) -> None:
    """The program that a rig runs, on a machine without an OAK."""
    with pytest.raises(CameraError, match="No OAK camera answers"):
        OakCamera(config.model_copy(update={"device": ""}), controller.time_us)
