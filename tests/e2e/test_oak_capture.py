"""Whole captures through the OAK driver: simulated optics, and the real depthai in a process of its own."""

import importlib.util
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

from svbrdf import materials
from turnlight import app
from turnlight.capture.events import Finished, ShotFailed
from turnlight.config import RigConfig
from turnlight.frame import Exposure, Frame
from turnlight.rig.camera.oak import OakCamera
from turnlight.simulation.board import SimulatedBoard
from turnlight.simulation.camera import SimulatedCamera

from .conftest import THICKNESS_MM, Bench, rig_file

STAND_IN = Path(__file__).parents[1] / "host/rig/camera/oak_stand_in.py"
BLACK_LEVEL = 64 / 1023
RAW = {
    "bit_depth": 10,
    "gamma": 1.0,
    "bayer": "BGGR",
    "lens_position": 130,
    "white_balance_k": 5000,
}


@pytest.fixture(scope="module")
def stand_in() -> ModuleType:
    spec = importlib.util.spec_from_file_location("oak_stand_in", STAND_IN)
    assert spec is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


class SimulatedOak:
    """An OAK that looks at the simulated table: each scene is laid before the stand-in's lens."""

    def __init__(self, optics: SimulatedCamera, oak: OakCamera, told: Path, stand_in: ModuleType):
        self.optics, self.oak, self.told, self.stand_in = optics, oak, told, stand_in
        self.faults: dict[int, str] = {}
        self.taken = 0

    @property
    def description(self) -> str:
        return self.oak.description

    def capture(self, exposure: Exposure) -> Frame:
        rgb = self.optics.capture(exposure).pixels
        mosaic = rgb[..., 1].copy()
        mosaic[::2, ::2], mosaic[1::2, 1::2] = rgb[::2, ::2, 2], rgb[1::2, 1::2, 0]
        scene = self.told.with_suffix(".new")
        self.stand_in.packed(mosaic).tofile(scene)
        scene.replace(self.told.with_suffix(".raw"))
        self.told.write_text(self.faults.pop(self.taken, "good"))
        self.taken += 1
        return self.oak.capture(exposure)

    def recover(self) -> None:
        self.told.write_text("good")
        self.oak.recover()

    def close(self) -> None:
        self.oak.close()


@pytest.fixture
def bench(tmp_path: Path, stand_in: ModuleType) -> Iterator[Bench]:
    told = tmp_path / "behaviour"
    told.write_text("good")
    config = RigConfig.load(rig_file(tmp_path / "rig.toml", 676, 508))
    raw = config.camera.model_copy(update=RAW | {"device": str(told)})
    dark = config.geometry.dark.model_copy(update={"level": (BLACK_LEVEL,) * 3})
    geometry = config.geometry.model_copy(update={"dark": dark})
    config = config.model_copy(update={"camera": raw, "geometry": geometry})
    with SimulatedBoard() as board:
        bench = Bench(config, tmp_path / "session", board)
        optics = SimulatedCamera(config, app.simulated_material(), THICKNESS_MM, board, 0)
        oak = OakCamera(raw, lambda: board.state().time_us, (str(STAND_IN),))
        bench.camera = SimulatedOak(optics, oak, told, stand_in)
        yield bench
        bench.engine.close()
        oak.close()


def test_a_capture_through_depthai(bench: Bench) -> None:
    bench.start()
    events = bench.until(Finished)
    assert not [event for event in events if isinstance(event, ShotFailed)]
    records = bench.session.manifest.used
    assert len(records) == 3
    assert {(r.frame.bit_depth, r.frame.gamma) for r in records} == {(10, 1.0)}
    assert all(record.marker_residual_px < 0.5 for record in records)
    bench.assert_maps_are_those_of_the_frames()
    through_oak = materials.load(bench.folder / "maps")
    assert np.isfinite(through_oak.diffuse).all()
    assert through_oak.diffuse.std() > 0.01


def test_an_oak_that_was_unplugged_costs_one_shot_taken_again(bench: Bench) -> None:
    bench.camera.faults[2] = "unplugged"  # number 0 is the dark frame
    bench.start()
    events = bench.until(Finished)
    (failed,) = [event for event in events if isinstance(event, ShotFailed)]
    assert (failed.number, failed.attempt) == (2, 1)
    assert len(bench.session.manifest.used) == 3
    bench.assert_maps_are_those_of_the_frames()
