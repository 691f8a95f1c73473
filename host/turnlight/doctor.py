"""Is everything there that a capture needs? One check after the other, each with its remedy."""

import contextlib
import math
import shutil
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

from turnlight.app import SIMULATED, Connection, Sample, build_camera, connect, model_sha256
from turnlight.calibrate.check import judge
from turnlight.config import RigConfig
from turnlight.errors import CameraError, ImageError, RigError, SessionError, TurnlightError
from turnlight.estimate.estimator import Estimator
from turnlight.frame import Exposure, Frame
from turnlight.picture.rectify import rectify
from turnlight.rig import usb
from turnlight.rig.camera.camera import Camera
from turnlight.rig.camera.oak import OakCamera

SHOTS_THAT_SHOULD_FIT = 50
BYTES_PER_PIXEL = 4
"""Of a stored picture: three colours of 16 bits, compressed."""
_ENOUGH_PX = 64
_LED = 0
_BOOTED_US = 5_000_000
_ON_USB = {"oak": "OAK camera", "uvc": "UVC camera"}


@dataclass(frozen=True)
class Check:
    """One thing looked at. text: what was found, or what is wrong and what to do."""

    name: str
    ok: bool
    text: str


def doctor(rig_file: Path) -> Iterator[Check]:
    """Look at everything in turn; lights one LED and does not turn the table."""
    with contextlib.ExitStack() as parts:
        patient = _Patient(rig_file, parts)
        for name, look in _CHECKS.items():
            try:
                yield Check(name, True, look(patient))
            except TurnlightError as error:
                yield Check(name, False, str(error))


@dataclass
class _Patient:
    """What has been found so far, for the checks that build on it."""

    rig_file: Path
    parts: contextlib.ExitStack
    config: RigConfig | None = None
    connection: Connection | None = None
    frame: Frame | None = None


class _NotTriedError(TurnlightError):
    """A check whose ground is missing."""

    def __init__(self, missing: str) -> None:
        super().__init__(f"Not tried, because the check of the {missing} failed.")


def _rig_file(patient: _Patient) -> str:
    patient.config = RigConfig.load(patient.rig_file)
    return f"{patient.rig_file} describes the rig {patient.config.name}"


def _usb(patient: _Patient) -> str:
    if patient.config is None:
        raise _NotTriedError("rig file")
    if patient.config.camera.driver == SIMULATED:
        return "board and camera are simulated"
    found = usb.devices()
    camera = next((d for d in found if d.name == _ON_USB[patient.config.camera.driver]), None)
    if camera is None:
        others = ", ".join(map(str, found)) or "neither board nor camera"
        raise CameraError(
            f"No {_ON_USB[patient.config.camera.driver]} is plugged in (found: {others}); "
            "check its cable and its power."
        )
    if camera.slow:
        raise CameraError(
            f"The {camera} is connected slowly; plug it into a USB 3 port with a USB 3 cable."
        )
    if patient.config.camera.driver == "oak" and not camera.permitted:
        raise CameraError(camera.not_permitted)
    return ", ".join(map(str, found))


def _controller(patient: _Patient) -> str:
    if patient.config is None:
        raise _NotTriedError("rig file")
    patient.connection = patient.parts.enter_context(connect(patient.config))
    hello = patient.connection.hello
    if hello.parameters == "corrupt":
        raise RigError(
            "What the controller kept of its parameters is damaged, and it goes by the defaults; "
            "set this rig's own again with turnlight firmware parameters --set."
        )
    answer = f"firmware {hello.firmware} on {hello.board} with {hello.led_count} LEDs answers"
    if patient.connection.board is None and _just_booted(patient.connection):
        answer += "; it restarts when its port is opened, so every capture homes the table first"
    return answer


def _just_booted(connection: Connection) -> bool:
    return connection.controller.status().time_us < _BOOTED_US


def _camera(patient: _Patient) -> str:
    if patient.config is None or patient.connection is None:
        raise _NotTriedError("controller")
    config, connection = patient.config, patient.connection
    sample = Sample("doctor", config.sample.reference_thickness_mm)
    camera = build_camera(config, sample, connection)
    patient.parts.callback(camera.close)
    connection.controller.light([_LED])
    connection.clock.sleep(config.controller.settle_ms / 1000)
    asked = Exposure(config.camera.exposure_us, config.camera.gain)
    frame = camera.capture(asked)
    connection.controller.off()
    if frame.exposure != asked:
        raise CameraError("The camera does not expose as asked; close what else uses it.")
    patient.frame = frame
    height, width = frame.pixels.shape[:2]
    answer = f"a frame of {width} x {height} pixels at {asked.exposure_us} us arrives"
    return f"{answer} from the {camera.description}{_field_of_view(camera, config)}"


def _field_of_view(camera: Camera, config: RigConfig) -> str:
    """What the camera's own calibration says, beside the rig file."""
    if not isinstance(camera, OakCamera) or camera.info.focal_px is None:
        return ""
    half_height = config.camera.height_px / 2
    degrees = 2 * math.degrees(math.atan(half_height / camera.info.focal_px[1]))
    return (
        f"; it says of itself that it sees {degrees:.1f} degrees in height, "
        f"and the rig file {config.camera.vertical_fov_deg:.1f}"
    )


def _markers(patient: _Patient) -> str:
    if patient.config is None or patient.frame is None:
        raise _NotTriedError("camera")
    config = patient.config
    thickness_mm = config.sample.reference_thickness_mm
    seen = rectify(patient.frame, None, config, thickness_mm, _ENOUGH_PX)
    count = len(config.platter.marker_corners_mm())
    if not seen.picture.valid.all():
        raise ImageError("The camera does not see the whole sample; point it at the table's axis.")
    return (
        f"{seen.markers_seen} of {count} seen, {seen.marker_residual_px:.2f} px from their places"
    )


def _calibration(patient: _Patient) -> str:
    if patient.config is None:
        raise _NotTriedError("rig file")
    if patient.config.calibration is None:
        return "none: the configured geometry is used; run turnlight calibrate to measure it"
    if patient.frame is None:
        raise _NotTriedError("camera")
    return judge(patient.config, patient.frame, _LED, datetime.now(UTC))


def _disk(patient: _Patient) -> str:
    if patient.config is None:
        raise _NotTriedError("rig file")
    camera = patient.config.camera
    needed = SHOTS_THAT_SHOULD_FIT * camera.width_px * camera.height_px * BYTES_PER_PIXEL
    free = shutil.disk_usage(Path.cwd()).free
    if free < needed:
        raise SessionError(
            f"{Path.cwd()} has {free / 1e9:.1f} GB free and {SHOTS_THAT_SHOULD_FIT} shots may take "
            f"{needed / 1e9:.1f} GB; free some space, or capture to another disk with --out."
        )
    return f"{free / 1e9:.0f} GB free, and {SHOTS_THAT_SHOULD_FIT} shots take {needed / 1e9:.1f} GB"


def _model(_: _Patient) -> str:
    Estimator()
    hashes = (f"{name} {digest[:12]}" for name, digest in model_sha256().items())
    return f"the weights match their card ({', '.join(hashes)})"


_CHECKS: dict[str, Callable[[_Patient], str]] = {
    "rig file": _rig_file,
    "usb": _usb,
    "controller": _controller,
    "camera": _camera,
    "markers": _markers,
    "calibration": _calibration,
    "disk": _disk,
    "model": _model,
}
