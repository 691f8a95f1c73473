"""The process that an OAK camera lives in: depthai aborts a process that its errors escape from.

Started by `OakCamera` with the number of a pipe's file descriptor and the camera's options as JSON.
It sends CameraInfo once the camera streams, then a Still or a CameraError for every Request, and ends
when the pipe does, as it does when the host dies.
"""

import contextlib
import json
import os
import signal
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from datetime import timedelta
from multiprocessing.connection import Connection

import depthai as dai
import numpy as np

from turnlight.errors import CameraError
from turnlight.rig.camera.still import (
    LONGEST_SHARE,
    CameraInfo,
    Request,
    Settings,
    Still,
    objection,
)

_FRAMES_MISSED = 4
_PATIENCE_S = 2
_MICROSECOND = timedelta(microseconds=1)


@dataclass(frozen=True)
class OakOptions:
    """device: the camera's id, empty for the only one. longest_us: no exposure will be longer."""

    device: str
    width_px: int
    height_px: int
    longest_us: int

    def frames_per_s(self, fastest: float) -> float:
        """How fast to stream, so that the longest exposure fits."""
        return min(fastest, LONGEST_SHARE * 1e6 / self.longest_us)


@dataclass(frozen=True)
class CameraNode:
    """A camera in a pipeline that is not started yet: all that differs between an OAK and a test."""

    pipeline: dai.Pipeline
    raw: dai.Node.Output
    control: dai.Node.Input
    info: CameraInfo


def run(open_node: Callable[[OakOptions], CameraNode]) -> None:
    """The whole life of the process; does not return."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for the host
    connection = Connection(int(sys.argv[1]))
    try:
        node = open_node(OakOptions(**json.loads(sys.argv[2])))
        _serve(connection, node)
    except EOFError:  # the host is done with the camera, or dead
        signal.alarm(_PATIENCE_S)
        node.pipeline.stop()
        os._exit(0)
    except Exception as error:
        with contextlib.suppress(OSError):
            connection.send(error if isinstance(error, CameraError) else _lost(error))
        os._exit(1)  # here and now: outside this block the pipeline is destroyed, which may hang


def _serve(connection: Connection, node: CameraNode) -> None:
    frames = node.raw.createOutputQueue(maxSize=2, blocking=False)
    control = node.control.createInputQueue()
    node.pipeline.start()
    connection.send(node.info)
    silence_s = _FRAMES_MISSED / node.info.frames_per_s
    while True:
        request: Request = connection.recv()
        control.send(_control(request.settings))
        try:
            answer: Still | CameraError = _expose(request, frames, silence_s)
        except CameraError as error:
            answer = error
        connection.send(answer)


def _expose(request: Request, frames: dai.MessageQueue, silence_s: float) -> Still:
    heard_s, reason = time.monotonic(), ""
    while (now_s := time.monotonic()) < request.until_s:
        frame = frames.get(timedelta(seconds=request.until_s - now_s))
        if not isinstance(frame, dai.ImgFrame):
            break
        still = _read(frame)
        heard_s, reason = time.monotonic(), objection(request, still) or ""
        if not reason:
            return still
    if time.monotonic() - heard_s > silence_s:
        raise CameraError(
            "The camera sends no pictures; unplug it and plug it in again, "
            "or run turnlight doctor --reset-camera."
        )
    raise CameraError(f"The camera's pictures {reason}; run turnlight doctor to check the camera.")


def _read(frame: dai.ImgFrame) -> Still:
    return Still(
        settings=Settings(
            exposure_us=frame.getExposureTime() // _MICROSECOND,
            iso=frame.getSensitivity(),
            lens_position=frame.getLensPosition(),
            white_balance_k=frame.getColorTemperature(),
        ),
        started_s=frame.getTimestamp(dai.CameraExposureOffset.START).total_seconds(),
        width_px=frame.getWidth(),
        height_px=frame.getHeight(),
        stride_bytes=frame.getStride(),
        data=np.asarray(frame.getData(), np.uint8),
    )


def _control(settings: Settings) -> dai.CameraControl:
    control = dai.CameraControl()
    control.setManualExposure(settings.exposure_us, settings.iso)
    if settings.lens_position is not None:
        control.setManualFocus(settings.lens_position)
    if settings.white_balance_k is not None:
        control.setManualWhiteBalance(settings.white_balance_k)
    return control


def _lost(error: Exception) -> CameraError:
    return CameraError(
        f"The connection to the camera was lost ({str(error).splitlines()[0].rstrip('.')}); "
        "check its cable and plug it in again."
    )
