"""An OAK camera, from the host's side of the process that it lives in."""

import contextlib
import json
import os
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from multiprocessing import Pipe

from turnlight.config import CameraConfig
from turnlight.errors import CameraError
from turnlight.frame import Exposure, Frame
from turnlight.rig.camera import raw10
from turnlight.rig.camera.moment import Moment
from turnlight.rig.camera.still import CameraInfo, Request, Settings, Still

PROGRAM = ("-m", "turnlight.rig.camera.oak_device")
_START_LIMIT_S = 20.0
_WAIT_S = 1.4
"""For a still, on top of its exposure."""
_FRAMES_LATE = 5
_GRACE_S = 0.5
_CLOCKS_APART_S = 0.005
"""How far the camera's clock, which depthai keeps in step with ours, may be off."""
_BEAT_S = 0.25
_LEAVE_S = 2.5
_ISO_AT_GAIN_1 = 100
_HANGS = "The camera hangs; unplug it and plug it in again, or run turnlight doctor --reset-camera."
_ENDED = "The camera was unplugged or its driver has failed; check its cable and plug it in again."


class OakCamera:
    """A Camera. Its pixels are the sensor's, linear; `info` is what the camera says of itself.

    A frame carries the exposure that was asked for, which the sensor keeps to within half a percent or
    one of its lines.
    """

    info: CameraInfo

    def __init__(
        self,
        config: CameraConfig,
        controller_time_us: Callable[[], int],
        program: Sequence[str] = PROGRAM,
    ) -> None:
        """Start the camera. Raises CameraError if it is not there.

        controller_time_us: asks the controller for its time, which also tells it that we are alive;
        called every quarter of a second while waiting.
        """
        self._config = config
        self._controller_time_us = controller_time_us
        self._program = program
        self._longest_us = config.exposure_us
        self._process: subprocess.Popen[bytes] | None = None
        self.recover()

    @property
    def description(self) -> str:
        return f"{self.info.name}, USB {self.info.usb_speed}"

    def capture(self, exposure: Exposure) -> Frame:
        if exposure.exposure_us > self.info.longest_us:  # it has to stream more slowly
            self._longest_us = exposure.exposure_us
            self.recover()
        now = Moment.now(self._controller_time_us)
        wait_s = max(_WAIT_S, _FRAMES_LATE / self.info.frames_per_s) + exposure.exposure_us / 1e6
        settings = Settings(
            exposure_us=exposure.exposure_us,
            iso=round(exposure.gain * _ISO_AT_GAIN_1),
            lens_position=self._config.lens_position,
            white_balance_k=self._config.white_balance_k,
        )
        answer = self._ask(Request(settings, now.host_s + _CLOCKS_APART_S, now.host_s + wait_s))
        return self._frame(answer, exposure, now.controller_us_at(answer.started_s))

    def recover(self) -> None:
        """See Camera. Starts the process anew, which takes an OAK some 5 s."""
        self.close()
        options = {
            "device": self._config.device,
            "width_px": self._config.width_px,
            "height_px": self._config.height_px,
            "longest_us": self._longest_us,
        }
        self._connection, theirs = Pipe()
        self._process = subprocess.Popen(
            [sys.executable, *self._program, str(theirs.fileno()), json.dumps(options)],
            pass_fds=[theirs.fileno()],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            env=os.environ | {"DEPTHAI_SEARCH_TIMEOUT": "1000"},
        )
        theirs.close()
        info = self._receive(time.monotonic() + _START_LIMIT_S)
        if isinstance(info, CameraError):
            self.close()
            raise info
        assert isinstance(info, CameraInfo)
        self.info = info

    def close(self) -> None:
        self._end(_LEAVE_S)

    def _end(self, patience_s: float) -> None:
        """Let the process give the camera back by itself, for so long."""
        if self._process is not None:
            self._connection.close()
            with contextlib.suppress(subprocess.TimeoutExpired):
                self._process.wait(patience_s)
            self._process.kill()
            self._process.wait()
            self._process = None

    def _ask(self, request: Request) -> Still:
        if self._process is None:
            raise CameraError("The camera is not connected; plug it in and resume.")
        try:
            self._connection.send(request)
        except OSError as error:
            self._end(0)
            raise CameraError(_ENDED) from error
        answer = self._receive(request.until_s + _GRACE_S)
        if isinstance(answer, CameraError):
            raise answer
        assert isinstance(answer, Still)
        return answer

    def _receive(self, until_s: float) -> CameraInfo | Still | CameraError:
        """What the process sends next; the controller's lease is renewed meanwhile.

        Whatever else comes in between ends the process, so that no answer waits there for the next one.
        """
        try:
            while not self._connection.poll(_BEAT_S):
                if time.monotonic() > until_s:
                    raise CameraError(_HANGS)
                self._controller_time_us()
            answer: CameraInfo | Still | CameraError = self._connection.recv()
        except (EOFError, OSError) as error:
            self._end(0)
            raise CameraError(_ENDED) from error
        except BaseException:
            self._end(0)
            raise
        return answer

    def _frame(self, still: Still, exposure: Exposure, started_us: int) -> Frame:
        size, asked = (
            (still.width_px, still.height_px),
            (self._config.width_px, self._config.height_px),
        )
        if size != asked:
            raise CameraError(
                f"The camera's pictures have {size[0]} x {size[1]} pixels and the rig file says "
                f"{asked[0]} x {asked[1]}; correct width_px and height_px."
            )
        assert self._config.bayer is not None
        mosaic = raw10.unpack(still.data, *size, still.stride_bytes)
        return Frame(
            pixels=raw10.demosaic(mosaic, self._config.bayer),
            bit_depth=10,
            gamma=1.0,
            exposure=exposure,
            started_us=started_us,
        )
