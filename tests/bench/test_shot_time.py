"""What one shot costs on this machine: `make bench`. Ratios are within one run; seconds are this machine's.

The clock on the wall says how long a step takes alone; its share of the processor is what the others lack.
"""

import statistics
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from svbrdf import procedural
from svbrdf.onnx_model import OnnxModel
from turnlight.capture.develop import RESOLUTION
from turnlight.capture.png import encode16
from turnlight.capture.relight import relit
from turnlight.capture.session import save_maps
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
def test_one_shot(tmp_path: Path) -> None:
    (tmp_path / "maps").mkdir()
    config = RigConfig.load(RIG)
    exposure = Exposure(config.camera.exposure_us, config.camera.gain)
    simulated = scene(config, procedural.material(procedural.TEST_SEEDS[0], 512), THICKNESS_MM)
    radiance = sensor_radiance(
        simulated, 40.0, tuple(255 * (i == 3) for i in range(config.led_count))
    )
    pixels = develop(radiance, config.camera, exposure, np.random.default_rng(0))
    frame = Frame(pixels, config.camera.bit_depth, config.camera.gamma, exposure, 0)
    model = OnnxModel(threads=2)
    picture = rectify(frame, None, config, THICKNESS_MM, RESOLUTION).picture
    seen = network_input(picture)
    state = model.encode(model.empty(), seen)
    maps = model.decode(state)
    steps: dict[str, Callable[[], object]] = {
        "frame as PNG": lambda: sum(map(len, encode16(frame.pixels))),
        "rectify": lambda: rectify(frame, None, config, THICKNESS_MM, RESOLUTION),
        "front end": lambda: network_input(picture),
        "encode + max": lambda: model.encode(state, seen),
        "decode": lambda: model.decode(state),
        "maps on disk": lambda: save_maps(tmp_path, maps, relit(maps)),
    }
    costs = {name: _medians(step) for name, step in steps.items()}
    total = np.sum(list(costs.values()), axis=0)
    print(f"\none shot, {config.camera.width_px}x{config.camera.height_px}, two threads")
    print(f"  {'':<14}{'wall':>11}{'processor':>14}")
    for name, (wall_s, work_s) in [*costs.items(), ("total", total)]:
        print(
            f"  {name:<14}{wall_s * 1000:8.1f} ms{work_s * 1000:11.1f} ms   {work_s / total[1]:6.1%}"
        )


def _medians(step: Callable[[], object]) -> tuple[float, float]:
    """Seconds by the clock on the wall, and of a processor."""
    step()
    walls, works = [], []
    for _ in range(RUNS):
        wall, work = time.perf_counter(), time.process_time()
        step()
        walls.append(time.perf_counter() - wall)
        works.append(time.process_time() - work)
    return statistics.median(walls), statistics.median(works)
