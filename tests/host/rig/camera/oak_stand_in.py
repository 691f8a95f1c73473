"""A host-only depthai pipeline in an OAK's place, run as a process of its own.

The real library carries its frames and controls; only the node is ours. The option `device` names a file
that says how it behaves: "good", or the name of a fault. A file of the same name with `.raw` at its end
is what it sees; without one it sees a single colour.
"""

import datetime
import os
import time
from pathlib import Path

import depthai as dai
import numpy as np

from turnlight.errors import CameraError
from turnlight.rig.camera.oak_process import CameraNode, OakOptions, run
from turnlight.rig.camera.still import CameraInfo

FRAMES_LATE = 3
FRAMES_PER_S = 30.0
RGB = (800, 401, 203)
FIRST = (1_000, 100, 0, 4_000)


class Sensor(dai.node.ThreadedHostNode):
    """Streams raw pictures of one colour; applies what it is told three frames late."""

    def set_up(self, options: OakOptions) -> "Sensor":
        self.raw = self.createOutput(name="raw")
        self.control = self.createInput(name="control", blocking=False)
        self._told = Path(options.device)
        self._behaviour = self._told.read_text()
        self._period_s = 1 / options.frames_per_s(FRAMES_PER_S)
        self._size = (options.width_px, options.height_px)
        self._data = packed(mosaic(*self._size))
        return self

    def run(self) -> None:
        settings, waiting = FIRST, []
        while self.isRunning():
            time.sleep(self._period_s)
            self._behaviour = self._told.read_text()
            message = self.control.tryGet()
            if isinstance(message, dai.CameraControl):
                waiting = [told(message)] * (1 if self._behaviour == "deaf" else FRAMES_LATE)
                self._misbehave()
            if waiting and self._behaviour != "deaf":
                settings = waiting.pop()
                settings = settings if not waiting else FIRST
            self.raw.send(self._frame(settings))

    def _misbehave(self) -> None:
        if self._behaviour == "unplugged":
            os._exit(1)
        if self._behaviour == "aborts":
            raise ValueError("an error that escapes a node")
        if self._behaviour == "stalled":
            time.sleep(60)
        if self._behaviour == "hangs":
            os.kill(os.getpid(), 19)

    def _frame(self, settings: tuple[int, int, int, int]) -> dai.ImgFrame:
        frame = dai.ImgFrame()
        frame.setTimestamp(dai.Clock.now())  # before it looks, so that it sees no older scene
        frame.setType(dai.ImgFrame.Type.RAW10)
        frame.setWidth(self._size[0])
        frame.setHeight(self._size[1])
        data = self._look()
        frame.setStride(data.shape[1])
        torn = self._behaviour == "torn"
        frame.setData(data.ravel()[: data.size // 2 if torn else None])
        camera = frame.cam
        camera.exposureTimeUs, camera.sensitivityIso = settings[:2]
        camera.lensPosition, camera.wbColorTemp = settings[2:]
        frame.cam = camera
        return frame

    def _look(self) -> np.ndarray:
        scene = self._told.with_suffix(".raw")
        if not scene.exists():
            return self._data
        return np.fromfile(scene, np.uint8).reshape(self._data.shape)


def told(control: dai.CameraControl) -> tuple[int, int, int, int]:
    exposure_us = control.getExposureTime() // datetime.timedelta(microseconds=1)
    return exposure_us, control.getSensitivity(), control.getLensPosition(), control.wbColorTemp


def mosaic(width: int, height: int) -> np.ndarray:
    """BGGR of one colour."""
    pixels = np.full((height, width), RGB[1], np.uint16)
    pixels[::2, ::2], pixels[1::2, 1::2] = RGB[2], RGB[0]
    return pixels


def packed(pixels: np.ndarray) -> np.ndarray:
    """Rows of ten-bit pixels, four in five bytes, padded at their ends as a sensor pads them."""
    height, width = pixels.shape
    groups = np.zeros((height, width // 4, 5), np.uint8)
    fours = pixels.reshape(height, width // 4, 4)
    groups[..., :4] = fours >> 2
    groups[..., 4] = np.bitwise_or.reduce((fours & 3) << (2 * np.arange(4)), axis=-1)
    return np.pad(groups.reshape(height, -1), ((0, 0), (0, 6)))


def open_stand_in(options: OakOptions) -> CameraNode:
    if not Path(options.device).exists():
        raise CameraError("No OAK camera answers; plug it in.")
    pipeline = dai.Pipeline(createImplicitDevice=False)
    sensor = pipeline.create(Sensor).set_up(options)
    frames_per_s = options.frames_per_s(FRAMES_PER_S)
    info = CameraInfo("stand-in", "SUPER", (3080.0, 3080.0), frames_per_s)
    return CameraNode(pipeline, sensor.raw, sensor.control, info)


if __name__ == "__main__":
    run(open_stand_in)
