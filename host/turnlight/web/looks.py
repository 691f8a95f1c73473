"""What is seen of the rig at rest: the live view, and the lights of the Ready screen."""

import shutil
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
import numpy.typing as npt

from turnlight.app import model_sha256
from turnlight.capture.exposure import sample_mask
from turnlight.errors import CameraError, ImageError, RigError, SessionError, TurnlightError
from turnlight.estimate.estimator import Estimator
from turnlight.frame import Exposure, Frame
from turnlight.picture.platter import locate
from turnlight.picture.radiometry import clipped, linear
from turnlight.rig.rig import Rig
from turnlight.standby import Standby
from turnlight.web.images import jpeg, screen

VIEW_PX = 960
LEAST_LIGHT = 0.002
"""Mean linear reading on the sample, of full scale, that a LED must add."""
BYTES_PER_SHOT_PX = 4
SHOTS_THAT_SHOULD_FIT = 50
_ZEBRA = (255, 45, 85)


@dataclass(frozen=True)
class Light:
    """One light of the Ready screen. text: what was found, or the cause and what to do."""

    name: str
    ok: bool
    text: str


@dataclass(frozen=True)
class View:
    """A live frame. clipped: share of the sample's pixels at full scale; focus: variance of the
    Laplacian of the sample's brightness over its mean squared; image: JPEG, clipped pixels in pink."""

    image: bytes
    clipped: float
    focus: float
    markers_seen: int
    trouble: str | None


def lights(standby: Standby, root: Path, estimator: Callable[[], Estimator]) -> Iterator[Light]:
    """Look at rig, camera, light, disk and model; lights one LED and does not turn the table."""
    looks: dict[str, Callable[[], str]] = {
        "rig": lambda: standby.look(_rig),
        "camera": lambda: standby.look(_camera),
        "light": lambda: standby.look(_light),
        "disk": lambda: _disk(root, standby),
        "model": lambda: _model(estimator),
    }
    for name, look in looks.items():
        try:
            yield Light(name, True, look())
        except TurnlightError as error:
            yield Light(name, False, str(error))


def view(rig: Rig, led: int, thickness_mm: float) -> View:
    """A frame under one LED. Raises CameraError, RigError or LinkError."""
    if not 0 <= led < rig.config.led_count:
        raise RigError(f"There is no LED {led}; the rig has 0 to {rig.config.led_count - 1}.")
    frame = _lit(rig, [led])
    mask = sample_mask(rig.config, 0.0, thickness_mm)
    full = clipped(frame, frame.pixels)
    shown = screen(frame.pixels, frame.bit_depth, frame.gamma, VIEW_PX)
    rows, columns = (np.arange(n) * m // n for n, m in zip(shown.shape, full.shape, strict=False))
    shown[full[np.ix_(rows, columns)]] = _ZEBRA
    grey = linear(frame, np.ascontiguousarray(frame.pixels[..., 1]))
    curvature = np.asarray(cv2.Laplacian(grey, cv2.CV_32F))[mask]
    focus = float(curvature.var() / max(float(np.square(grey[mask]).mean()), 1e-9))
    try:
        seen, trouble = len(locate(frame, rig.config).ids), None
    except ImageError as error:
        seen, trouble = 0, str(error)
    return View(jpeg(shown), float(full[mask].mean()), focus, seen, trouble)


def _rig(rig: Rig) -> str:
    hello = rig.controller.hello()
    state = rig.controller.status().state
    if state == "estop":
        raise RigError("The emergency stop is pressed; release it.")
    return f"firmware {hello.firmware} on {hello.board} answers, {hello.led_count} LEDs"


def _camera(rig: Rig) -> str:
    frame = _lit(rig, [])
    height, width = frame.pixels.shape[:2]
    return f"{width} x {height} pixels from the {rig.camera.description}"


def _light(rig: Rig) -> str:
    thickness_mm = rig.config.sample.reference_thickness_mm
    mask = sample_mask(rig.config, 0.0, thickness_mm)
    dark, lit = (_brightness(_lit(rig, leds), mask) for leds in ([], [0]))
    if lit - dark < LEAST_LIGHT:
        raise RigError(
            "LED 0 does not light the sample; check the LEDs' supply and plugs, and that the lens "
            "is uncovered."
        )
    return f"LED 0 lights the sample; {dark:.1%} of full scale without it"


def _disk(root: Path, standby: Standby) -> str:
    camera = standby.config.camera
    needed = SHOTS_THAT_SHOULD_FIT * camera.width_px * camera.height_px * BYTES_PER_SHOT_PX
    free = shutil.disk_usage(root).free
    if free < needed:
        raise SessionError(
            f"{free / 1e9:.1f} GB are free and {SHOTS_THAT_SHOULD_FIT} shots may take "
            f"{needed / 1e9:.1f} GB; delete old sessions, or name another folder with --out."
        )
    return f"{free / 1e9:.0f} GB free; {SHOTS_THAT_SHOULD_FIT} shots take {needed / 1e9:.1f} GB"


def _model(estimator: Callable[[], Estimator]) -> str:
    estimator()
    digest = next(iter(model_sha256().values()))
    return f"the weights are whole ({digest[:12]})"


def _lit(rig: Rig, leds: list[int]) -> Frame:
    asked = Exposure(rig.config.camera.exposure_us, rig.config.camera.gain)
    if leds:
        rig.controller.light(leds)
        rig.clock.sleep(rig.config.controller.settle_ms / 1000)
    frame = rig.camera.capture(asked)
    rig.controller.off()
    if frame.exposure != asked:
        raise CameraError("The camera does not expose as asked; close what else uses it.")
    return frame


def _brightness(frame: Frame, mask: npt.NDArray[np.bool_]) -> float:
    return float(linear(frame, frame.pixels[::4, ::4][mask[::4, ::4]]).mean())
