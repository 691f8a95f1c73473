"""What one shot costs on this machine: `make bench`. Ratios are within one run; seconds are this machine's."""

import statistics
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from svbrdf import procedural
from svbrdf.onnx_model import OnnxModel
from turnlight.config import RigConfig
from turnlight.frame import Exposure, Frame
from turnlight.picture.front_end import network_input
from turnlight.picture.rectify import rectify
from turnlight.simulation.camera import develop
from turnlight.simulation.optics import scene, sensor_radiance

RIG = Path(__file__).parents[2] / "rig_config/simulated.toml"
RUNS = 7
THICKNESS_MM = 2.0


@pytest.mark.bench
def test_one_shot():
    config = RigConfig.load(RIG)
    exposure = Exposure(config.camera.exposure_us, config.camera.gain)
    simulated = scene(config, procedural.material(procedural.TEST_SEEDS[0], 512), THICKNESS_MM)
    radiance = sensor_radiance(
        simulated, 40.0, tuple(255 * (i == 3) for i in range(config.led_count))
    )
    pixels = develop(radiance, config.camera, exposure, np.random.default_rng(0))
    frame = Frame(pixels, config.camera.bit_depth, config.camera.gamma, exposure, 0)
    model = OnnxModel(threads=2)
    picture = rectify(frame, None, config, THICKNESS_MM, 512).picture
    seen = network_input(picture)
    state = model.encode(model.empty(), seen)
    steps: dict[str, Callable[[], object]] = {
        "rectify": lambda: rectify(frame, None, config, THICKNESS_MM, 512),
        "front end": lambda: network_input(picture),
        "encode + max": lambda: model.encode(state, seen),
        "decode": lambda: model.decode(state),
    }
    seconds = {name: _median(step) for name, step in steps.items()}
    total = sum(seconds.values())
    print(f"\none shot, {config.camera.width_px}x{config.camera.height_px}, two threads")
    for name, value in [*seconds.items(), ("total", total)]:
        print(f"  {name:<14}{value * 1000:8.1f} ms   {value / total:6.1%}")


def _median(step: Callable[[], object]) -> float:
    step()
    times = []
    for _ in range(RUNS):
        start = time.perf_counter()
        step()
        times.append(time.perf_counter() - start)
    return statistics.median(times)
