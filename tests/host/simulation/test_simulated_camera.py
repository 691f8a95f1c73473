import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from svbrdf.maps import flat
from turnlight.config import RigConfig
from turnlight.frame import Exposure, Frame
from turnlight.rig.camera.camera import Camera
from turnlight.simulation.camera import SimulatedCamera, develop

ROOT = Path(__file__).parents[3]
TEN_MS = Exposure(10_000, 1.0)


@dataclass(frozen=True)
class State:
    time_us: int
    angle_deg: float
    leds: tuple[int, ...]


class Board:
    """Lights one LED until `drop_us`, when something puts it out."""

    def __init__(self, led_count: int, drop_us: int = 1_000_000) -> None:
        self.lit = (0,) * 6 + (255,) + (0,) * (led_count - 7)
        self.time_us = 5_000
        self.drop_us = drop_us

    def state(self) -> State:
        lit = self.lit if self.time_us < self.drop_us else (0,) * len(self.lit)
        return State(self.time_us, 0.0, lit)

    def advance(self, ms: float) -> State:
        self.time_us += round(ms * 1000)
        return self.state()


def rig(width: int = 507, height: int = 380) -> RigConfig:
    config = RigConfig.load(ROOT / "rig_config/simulated.toml")
    camera = config.camera.model_copy(update={"width_px": width, "height_px": height})
    return config.model_copy(update={"camera": camera})


def capture(exposure: Exposure = TEN_MS, seed: int = 0, drop_us: int = 1_000_000) -> Frame:
    config = rig()
    board = Board(config.led_count, drop_us)
    camera: Camera = SimulatedCamera(config, flat(64, 64), 2.0, board, seed)
    return camera.capture(exposure)


def linear_mean(frame: Frame) -> float:
    full_scale = (1 << frame.bit_depth) - 1
    return float(((frame.pixels / full_scale) ** frame.gamma).mean())


def test_frame_says_what_was_taken() -> None:
    frame = capture(Exposure(2_000, 2.0))
    assert frame.pixels.shape == (380, 507, 3)
    assert frame.pixels.dtype == np.uint16
    assert frame.pixels.max() <= 4095
    assert (frame.bit_depth, frame.gamma) == (12, 2.2)
    assert frame.exposure == Exposure(2_000, 2.0)
    assert frame.started_us == 5_000


def test_virtual_time_passes_by_the_exposure() -> None:
    config = rig()
    board = Board(config.led_count)
    camera = SimulatedCamera(config, flat(64, 64), 2.0, board, 0)
    camera.capture(Exposure(2_500, 1.0))
    assert camera.capture(TEN_MS).started_us == 7_500
    camera.close()


def test_noise_repeats_with_the_seed_only() -> None:
    first = capture(seed=1)
    np.testing.assert_array_equal(first.pixels, capture(seed=1).pixels)
    assert (first.pixels != capture(seed=2).pixels).any()


def test_exposure_and_gain_scale_the_reading() -> None:
    short = linear_mean(capture(Exposure(2_000, 1.0)))
    assert linear_mean(capture(Exposure(4_000, 1.0))) == pytest.approx(2 * short, rel=0.01)
    assert linear_mean(capture(Exposure(2_000, 2.0))) == pytest.approx(2 * short, rel=0.01)


def test_a_led_that_drops_during_the_exposure_is_seen() -> None:
    whole, dropped = linear_mean(capture()), linear_mean(capture(drop_us=9_000))
    assert 0.45 < dropped / whole < 0.6


def test_noise_grows_with_the_light_and_the_gain() -> None:
    camera = rig().camera.model_copy(update={"gamma": 1.0, "bit_depth": 16})
    random = np.random.default_rng(0)

    def spread(reading: float, gain: float) -> float:
        radiance = np.full((128, 128, 3), reading, np.float32)
        return float((develop(radiance, camera, Exposure(10_000, gain), random) / 65535).std())

    assert spread(0.25, 1.0) == pytest.approx((0.25 / 10_000) ** 0.5, rel=0.03)
    assert spread(0.25, 2.0) == pytest.approx(2 * (0.25 / 10_000) ** 0.5, rel=0.03)


def test_bright_light_clips() -> None:
    camera = rig().camera
    radiance = np.full((8, 8, 3), 3.0, np.float32)
    assert (develop(radiance, camera, TEN_MS, np.random.default_rng(0)) == 4095).all()


@pytest.mark.bench
@pytest.mark.parametrize(("width", "height", "limit_s"), [(1014, 760, 0.5), (4056, 3040, 5.0)])
def test_a_frame_is_quick(width: int, height: int, limit_s: float) -> None:
    """Measured on one free core: 0.09 s and 0.85 s; the limits leave room for a busy machine."""
    config = rig(width, height)
    camera = SimulatedCamera(config, flat(256, 256), 2.0, Board(config.led_count), 0)
    camera.capture(TEN_MS)
    start = time.perf_counter()
    camera.capture(TEN_MS)
    seconds = time.perf_counter() - start
    print(f"one {width}x{height} frame: {seconds:.3f} s")
    assert seconds < limit_s
