"""Only a frame that is proven to show what its shot asks for is kept."""

from dataclasses import replace

import numpy as np
import pytest

from turnlight.capture.plan import Shot
from turnlight.capture.verify import looked_at, verify, verify_exposure, verify_lit, verify_rest
from turnlight.errors import CameraError, RigError
from turnlight.frame import Exposure, Frame
from turnlight.rig.controller import Status, Strobe

EXPOSURE = Exposure(10_000, 1.0)
SHOT = Shot(4, 30.0, (7,), 10_000, 1.0)
STROBE = Strobe(0, 30.0, (7,), 1000)
LIT, DARK = 800, 20


def frame(level: float, seed: int = 0, bit_depth: int = 12) -> Frame:
    noise = np.random.default_rng(seed).normal(level, 4, (120, 160, 3))
    pixels = np.clip(np.rint(noise), 0, (1 << bit_depth) - 1).astype(np.uint16)
    return Frame(pixels, bit_depth, 1.0, EXPOSURE, 1000)


def look(frame: Frame, dark: Frame | None = None, previous: Frame | None = None) -> None:
    seen = [looked_at(f) if f else None for f in (dark, previous)]
    verify(SHOT, looked_at(frame), *seen, STROBE)


def test_a_sound_frame_passes() -> None:
    look(frame(LIT), frame(DARK, 1), frame(LIT, 2))
    look(frame(LIT))


def test_a_frame_begun_before_the_strobe() -> None:
    with pytest.raises(CameraError, match="before the light had settled"):
        look(replace(frame(LIT), started_us=999), frame(DARK, 1))


@pytest.mark.parametrize("rest", ["black", "white", "before"])
def test_a_torn_frame(rest: str) -> None:
    before, torn, dark = frame(LIT, 2), frame(LIT), frame(DARK, 1)
    torn.pixels[100:] = {"black": 0, "white": 4095, "before": before.pixels[100:]}[rest]
    with pytest.raises(CameraError, match=r"Shot 5: .*torn \(17% of its rows"):
        look(torn, dark, before)


def test_a_frame_torn_against_the_dark_one() -> None:
    torn, dark = frame(LIT), frame(DARK, 1)
    torn.pixels[60:] = dark.pixels[60:]
    with pytest.raises(CameraError, match=r"torn \(50% of its rows"):
        look(torn, dark)


def test_rows_that_are_black_without_light_too_are_not_torn() -> None:
    """A camera of 8 bits that crushes blacks, and looks past the platter."""
    dark = replace(frame(0), pixels=np.zeros((120, 160, 3), np.uint16))
    first, second = frame(LIT, 1), frame(LIT, 2)
    for lit in (first, second):
        lit.pixels[:20] = 0
        lit.pixels[5, 32] = 1
    dark.pixels[5, 32] = 1
    look(second, dark, first)


def test_an_led_that_gives_no_light() -> None:
    with pytest.raises(RigError, match="Shot 5: LED 7 gives no light; check its plug"):
        look(frame(DARK), frame(DARK, 1))


def test_the_exposure_must_be_as_asked() -> None:
    verify_exposure(EXPOSURE, frame(LIT))
    with pytest.raises(CameraError, match="asked for 9000 us at gain 1 but exposed 10000 us"):
        verify_exposure(Exposure(9_000, 1.0), frame(LIT))


def test_table_and_leds_must_be_as_asked() -> None:
    rest = Status(0, 30.0, (7,), "ready", True, 0, 0)
    verify_rest(SHOT, rest)
    verify_lit(SHOT, (7,))
    with pytest.raises(RigError, match="the rig reports estop"):
        verify_rest(SHOT, replace(rest, state="estop"))
    with pytest.raises(RigError, match=r"sent to 30\.00 degrees but is at 31\.00"):
        verify_rest(SHOT, replace(rest, angle_deg=31.0))
    with pytest.raises(RigError, match="LEDs 7 were asked for but 0, 7 were lit"):
        verify_lit(SHOT, (0, 7))
