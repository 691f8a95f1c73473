"""A V4L2 camera (UVC, as most USB cameras are) through OpenCV, everything automatic switched off.

Such a camera says of a frame only when it came. So its settings are read back from the driver, and after
a change of exposure the first frames are left out.
"""

import time
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from concurrent.futures import TimeoutError as NotYetError
from typing import Any, Protocol

import cv2
import numpy as np

from turnlight.config import CameraConfig
from turnlight.errors import CameraError
from turnlight.frame import Exposure, Frame
from turnlight.rig.camera.moment import Moment
from turnlight.rig.camera.still import EXPOSURE_SHARE

FRAMES_LATE = 4
"""After a change of exposure, until every camera tried by others shows it."""
STEP_US = 100
"""V4L2 counts exposures in this unit."""
_MANUAL_EXPOSURE = 1
_WAIT_S = 1.6
_BEAT_S = 0.25
_OLDEST_S = 10.0
_RAW = cv2.VideoWriter.fourcc(*"YUYV")


class Source(Protocol):
    """The part of cv2.VideoCapture that is used: the seam for tests."""

    def isOpened(self) -> bool: ...  # noqa: N802 (OpenCV's name)
    def set(self, propId: int, value: float) -> bool: ...  # noqa: N803
    def get(self, propId: int) -> float: ...  # noqa: N803
    def grab(self) -> bool: ...
    def retrieve(self) -> tuple[bool, Any]: ...
    def release(self) -> None: ...


def open_v4l2(path: str) -> Source:
    """The camera at a path such as /dev/v4l/by-id/...-index0."""
    return cv2.VideoCapture(path, cv2.CAP_V4L2)


class UvcCamera:
    """A Camera of eight bits and a gamma that the rig file names; used at its lowest gain alone."""

    def __init__(
        self,
        config: CameraConfig,
        controller_time_us: Callable[[], int],
        open_source: Callable[[str], Source] = open_v4l2,
    ) -> None:
        """Open the camera. Raises CameraError if it is not there or cannot be set by hand."""
        self._config = config
        self._controller_time_us = controller_time_us
        self._open_source = open_source
        self._source: Source | None = None
        self.recover()

    @property
    def description(self) -> str:
        return f"UVC camera {self._config.device}"

    def capture(self, exposure: Exposure) -> Frame:
        if self._source is None:
            raise CameraError("The camera is not connected; plug it in and resume.")
        if exposure.gain != 1:
            raise CameraError("A UVC camera is used at its lowest gain; set gain = 1.0.")
        now = Moment.now(self._controller_time_us)
        until_s = (
            now.host_s + max(_WAIT_S, FRAMES_LATE * self._period_s) + exposure.exposure_us / 1e6
        )
        work = self._worker.submit(self._take, self._source, exposure, now.host_s, until_s)
        started_s, image = self._await(work, until_s)
        if image.shape != (self._config.height_px, self._config.width_px, 3):
            raise CameraError("The camera's pictures are torn; run turnlight doctor to check it.")
        return Frame(
            pixels=np.ascontiguousarray(image[..., ::-1], np.uint16),
            bit_depth=8,
            gamma=self._config.gamma,
            exposure=exposure,
            started_us=now.controller_us_at(started_s),
        )

    def recover(self) -> None:
        """See Camera."""
        self.close()
        source = self._open_source(self._config.device)
        if not source.isOpened():
            raise CameraError(
                f"The camera {self._config.device} is not there or in use; plug it in, close what else "
                "uses it, or correct `device` in the rig's file."
            )
        self._source = source
        self._worker = ThreadPoolExecutor(1, "uvc camera")
        self._exposure_us = 0
        try:
            self._set_up(source)
        except BaseException:
            self.close()
            raise

    def close(self) -> None:
        if self._source is not None:
            self._worker.submit(self._source.release)  # after a grab that may hang
            self._worker.shutdown(wait=False)
            self._source = None

    def _set_up(self, source: Source) -> None:
        config = self._config
        source.set(cv2.CAP_PROP_FOURCC, _RAW)
        self._put(source, "width", cv2.CAP_PROP_FRAME_WIDTH, config.width_px)
        self._put(source, "height", cv2.CAP_PROP_FRAME_HEIGHT, config.height_px)
        self._put(source, "manual exposure", cv2.CAP_PROP_AUTO_EXPOSURE, _MANUAL_EXPOSURE)
        source.set(cv2.CAP_PROP_GAIN, 0)  # many have none
        if config.white_balance_k is not None:
            self._put(source, "manual white balance", cv2.CAP_PROP_AUTO_WB, 0)
            self._put(source, "white balance", cv2.CAP_PROP_WB_TEMPERATURE, config.white_balance_k)
        if config.lens_position is not None:
            self._put(source, "manual focus", cv2.CAP_PROP_AUTOFOCUS, 0)
            self._put(source, "focus", cv2.CAP_PROP_FOCUS, config.lens_position)
        frames_per_s = source.get(cv2.CAP_PROP_FPS)
        self._period_s = 1 / frames_per_s if frames_per_s > 0 else 0.2

    def _put(self, source: Source, name: str, key: int, value: float, tolerance: float = 0) -> None:
        source.set(key, value)
        if not abs(source.get(key) - value) <= tolerance:
            raise CameraError(
                f"The camera does not take a {name} of {value:g} (it says {source.get(key):g}); "
                "correct the rig's file, or use another camera."
            )

    def _take(
        self, source: Source, exposure: Exposure, not_before_s: float, until_s: float
    ) -> tuple[float, Any]:
        """When the first good frame began, at the earliest, and its picture, BGR."""
        late = 0
        if exposure.exposure_us != self._exposure_us:
            steps = round(exposure.exposure_us / STEP_US)
            self._exposure_us = 0
            self._put(
                source, "exposure in 0.1 ms", cv2.CAP_PROP_EXPOSURE, steps, EXPOSURE_SHARE * steps
            )
            self._exposure_us = exposure.exposure_us
            late = FRAMES_LATE
        while time.monotonic() < until_s:
            if not source.grab():
                raise CameraError(
                    "The camera was unplugged or has failed; check its cable and plug it in again."
                )
            started_s = self._started_s(source, exposure)
            late -= 1
            if late < 0 and started_s >= not_before_s:
                whole, image = source.retrieve()
                if whole:
                    return started_s, image
        raise CameraError(
            "The camera's pictures are late or torn; run turnlight doctor to check it."
        )

    def _started_s(self, source: Source, exposure: Exposure) -> float:
        """When the frame last grabbed began, at the earliest: a camera may hold one back."""
        read_s = source.get(cv2.CAP_PROP_POS_MSEC) / 1000
        if not -_OLDEST_S < read_s - time.monotonic() <= 0:
            raise CameraError(
                "The camera's driver does not say when a picture was taken; use another."
            )
        return read_s - self._period_s - exposure.exposure_us / 1e6

    def _await(self, work: "Future[tuple[float, Any]]", until_s: float) -> tuple[float, Any]:
        """The work's result; the controller's lease is renewed meanwhile."""
        try:
            while True:
                try:
                    return work.result(_BEAT_S)
                except NotYetError:
                    if time.monotonic() > until_s + _BEAT_S:
                        raise CameraError(
                            "The camera sends no pictures; unplug it and plug it in again, "
                            "or run turnlight doctor --reset-camera."
                        ) from None
                self._controller_time_us()
        except BaseException:
            self.close()
            raise
