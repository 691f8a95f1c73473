"""The UVC driver behind its seam: the few methods of cv2.VideoCapture that it calls."""

import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from turnlight.config import CameraConfig, RigConfig
from turnlight.errors import CameraError
from turnlight.frame import Exposure
from turnlight.rig.camera.uvc import FRAMES_LATE, UvcCamera, open_v4l2

RIG = Path(__file__).parents[4] / "rig_config/uvc.toml"
PERIOD_S = 0.02
BUSY_S = 6.0
"""What a machine that is busy with something else may add."""
EXPOSURE = Exposure(5_000, 1.0)


class Webcam:
    """Streams at 50 frames a second; a change of exposure shows three frames later."""

    def __init__(self) -> None:
        self.there = True
        self.properties: dict[int, float] = {cv2.CAP_PROP_FPS: 1 / PERIOD_S}
        self.stubborn: dict[int, float] = {}
        self.shown = [0.0] * FRAMES_LATE
        self.stalled = threading.Event()
        self.clock_off_s = 0.0
        self.opened = 0
        self.torn = False

    def open(self, _path: str) -> "Webcam":
        self.opened += 1
        return self

    def isOpened(self) -> bool:  # noqa: N802
        return self.there

    def set(self, propId: int, value: float) -> bool:  # noqa: N803
        self.properties[propId] = self.stubborn.get(propId, value)
        return True

    def get(self, propId: int) -> float:  # noqa: N803
        return self.properties.get(propId, 0.0)

    def grab(self) -> bool:
        if self.stalled.is_set():
            time.sleep(4)
        time.sleep(PERIOD_S)
        self.shown = [*self.shown[1:], self.properties[cv2.CAP_PROP_EXPOSURE]]
        self.properties[cv2.CAP_PROP_POS_MSEC] = (time.monotonic() + self.clock_off_s) * 1000
        return self.there

    def retrieve(self) -> tuple[bool, Any]:
        size = (
            int(self.properties[cv2.CAP_PROP_FRAME_HEIGHT]),
            int(self.properties[cv2.CAP_PROP_FRAME_WIDTH]),
        )
        return not self.torn, np.full((*size, 3), (0, self.shown[0], 255), np.uint8)

    def release(self) -> None: ...


@pytest.fixture
def config() -> CameraConfig:
    return RigConfig.load(RIG).camera.model_copy(update={"width_px": 64, "height_px": 48})


def time_us() -> int:
    return int((time.monotonic() + 1000) * 1e6)


def test_a_frame_shows_what_was_asked_and_nothing_before(config: CameraConfig) -> None:
    webcam = Webcam()
    camera = UvcCamera(config, time_us, webcam.open)
    for exposure_us in (5_000, 20_000, 20_000, 5_000):
        before_us = time_us()
        frame = camera.capture(Exposure(exposure_us, 1.0))
        assert before_us <= frame.started_us < time_us()
        assert (frame.bit_depth, frame.gamma) == (8, 2.2)
        red, green, blue = frame.pixels[0, 0]
        assert (red, green, blue) == (255, exposure_us / 100, 0)
    camera.close()
    assert webcam.properties[cv2.CAP_PROP_AUTO_EXPOSURE] == 1
    assert webcam.properties[cv2.CAP_PROP_AUTO_WB] == webcam.properties[cv2.CAP_PROP_AUTOFOCUS] == 0
    assert webcam.properties[cv2.CAP_PROP_WB_TEMPERATURE] == 5000
    assert webcam.properties[cv2.CAP_PROP_FOCUS] == 60


@pytest.mark.parametrize(
    ("key", "says", "cause"),
    [
        (cv2.CAP_PROP_AUTO_EXPOSURE, 3, "does not take a manual exposure"),
        (cv2.CAP_PROP_FRAME_WIDTH, 640, r"a width of 64 \(it says 640\)"),
        (cv2.CAP_PROP_WB_TEMPERATURE, 4600, "white balance of 5000"),
    ],
)
def test_a_camera_that_cannot_be_set_by_hand(
    config: CameraConfig, key: int, says: float, cause: str
) -> None:
    webcam = Webcam()
    webcam.stubborn[key] = says
    with pytest.raises(CameraError, match=cause):
        UvcCamera(config, time_us, webcam.open)


def unplug(webcam: Webcam) -> None:
    webcam.there = False


def stall(webcam: Webcam) -> None:
    webcam.stalled.set()


def tear(webcam: Webcam) -> None:
    webcam.torn = True


def ignore_exposure(webcam: Webcam) -> None:
    webcam.stubborn[cv2.CAP_PROP_EXPOSURE] = 77


def tell_another_time(webcam: Webcam) -> None:
    webcam.clock_off_s = 1e6


@pytest.mark.parametrize(
    ("fault", "cause"),
    [
        (unplug, "was unplugged"),
        (stall, "sends no pictures"),
        (tear, "late or torn"),
        (ignore_exposure, r"exposure in 0.1 ms of 50 \(it says 77\)"),
        (tell_another_time, "does not say when"),
    ],
)
def test_a_fault_is_seen_within_two_seconds_and_recovered_from(
    config: CameraConfig, fault: Callable[[Webcam], None], cause: str
) -> None:
    webcam = Webcam()
    camera = UvcCamera(config, time_us, webcam.open)
    fault(webcam)
    began = time.monotonic()
    with pytest.raises(CameraError, match=cause):
        camera.capture(EXPOSURE)
    assert time.monotonic() - began < 2 + BUSY_S
    with pytest.raises(CameraError, match="not connected"):
        camera.capture(EXPOSURE)
    mended = Webcam()
    camera._open_source = mended.open
    camera.recover()
    camera.capture(EXPOSURE)
    camera.close()


def test_gain_is_not_touched(config: CameraConfig) -> None:
    camera = UvcCamera(config, time_us, Webcam().open)
    with pytest.raises(CameraError, match="lowest gain"):
        camera.capture(Exposure(5_000, 2.0))
    camera.close()


def test_no_camera(config: CameraConfig) -> None:
    """OpenCV's own answer where there is no such device."""
    with pytest.raises(CameraError, match="is not there or in use"):
        UvcCamera(config, time_us, open_v4l2)
