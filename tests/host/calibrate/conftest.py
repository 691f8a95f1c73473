"""A rig that is not as its file says, calibrated once for all tests here, without serial line."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
import pytest

from turnlight.app import DEFAULT_RIG
from turnlight.calibrate.bench import Bench
from turnlight.calibrate.events import Place
from turnlight.calibrate.steps import STEPS, Outcome
from turnlight.calibrate.targets import Targets
from turnlight.calibrating import _subject
from turnlight.calibration import StepName
from turnlight.config import RigConfig, SimulationConfig
from turnlight.frame import Exposure, Frame
from turnlight.simulation.camera import develop
from turnlight.simulation.optics import Subject, scene_of, sensor_radiance
from turnlight.simulation.targets import Nothing
from turnlight.simulation.truth import as_built

SEED = 3
TARGETS = Targets()


class SimulatedBench(Bench):
    """A bench whose table and LEDs are numbers."""

    def __init__(self, config: RigConfig, truth: RigConfig) -> None:
        self._config = config
        self._truth = truth
        self._angle_deg = 0.0
        self._random = np.random.default_rng(SEED)
        self._black = np.array(truth.geometry.dark.level, np.float32)
        self.place(Nothing())

    @property
    def exposure(self) -> Exposure:
        return Exposure(self._config.camera.exposure_us, self._config.camera.gain)

    def place(self, subject: Subject) -> None:
        self._scene = scene_of(self._truth, subject)

    def turn(self, angle_deg: float) -> float:
        self._angle_deg = angle_deg
        return angle_deg

    def frame(self, leds: Sequence[int], exposure: Exposure) -> Frame:
        camera = self._config.camera
        levels = [255 * (led in leds) for led in range(self._config.led_count)]
        radiance = sensor_radiance(self._scene, self._angle_deg, levels)
        pixels = develop(radiance, camera, exposure, self._random, self._black)
        return Frame(pixels, camera.bit_depth, camera.gamma, exposure, 0)


@dataclass(frozen=True)
class Calibrated:
    """config: with the calibration found; truth: what should have been found; outcomes: by step."""

    config: RigConfig
    truth: RigConfig
    bench: SimulatedBench
    outcomes: dict[StepName, Outcome] = field(default_factory=dict)


def workshop(width_px: int = 760, height_px: int = 570, seed: int = SEED) -> RigConfig:
    """Twelve LEDs and a small sensor, so that a calibration is quick."""
    config = RigConfig.load(DEFAULT_RIG).calibrated(None)
    camera = config.camera.model_copy(update={"width_px": width_px, "height_px": height_px})
    rings = [
        ring.model_copy(update={"count": n}) for ring, n in zip(config.ring, (8, 4), strict=True)
    ]
    simulation = SimulationConfig(truth_seed=seed)
    changed = {"name": "workshop", "camera": camera, "ring": rings, "simulation": simulation}
    return config.model_copy(update=changed)


def run_step(
    step: StepName, bench: SimulatedBench, config: RigConfig, nominal: RigConfig
) -> Outcome:
    """The step, with its target put where it belongs."""
    events = STEPS[step](bench, config, TARGETS)
    while True:
        try:
            event = next(events)
        except StopIteration as end:
            return end.value
        if isinstance(event, Place):
            bench.place(_subject(event.target, TARGETS, nominal))


def calibrate(seed: int) -> Calibrated:
    """All steps, on the rig that the seed draws."""
    nominal = workshop(seed=seed)
    truth = as_built(nominal, seed).config
    bench = SimulatedBench(nominal, truth)
    config, outcomes = nominal, {}
    for step in STEPS:
        outcomes[step] = run_step(step, bench, config, nominal)
        config = config.calibrated(outcomes[step].calibration)
    return Calibrated(config, truth, bench, outcomes)


@pytest.fixture(scope="session")
def calibrated() -> Calibrated:
    return calibrate(SEED)
