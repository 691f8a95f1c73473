"""The simulated rig for `python -m svbrdf.evaluate --rig`: maps by every method of one drawn rig's pictures.

Registered in pyproject.toml as an entry point of the group svbrdf.rigs, because svbrdf does not know
turnlight.
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

from svbrdf.maps import Maps
from svbrdf.scores import no_model
from turnlight.capture.adaptive import next_best
from turnlight.capture.plan import FIRST_BLOCK, Shot, plan
from turnlight.config import RigConfig
from turnlight.estimate.classical import optimise
from turnlight.estimate.estimator import Estimator
from turnlight.estimate.observations import scaled
from turnlight.estimate.refine import Refinement, refine
from turnlight.picture.picture import Picture
from turnlight.simulation.photograph import Photographer
from turnlight.simulation.truth import perturbed

RIG = Path(__file__).parents[2] / "rig_config/simulated.toml"
SENSOR_DIVISOR = 2
"""The sensor has half the configured pixels each way, which is still 2.7 for one of the maps'."""
METHODS = ("no model", "network without poses", "network with poses", "classical", "refinement")
ADAPTIVE = "adaptive refinement"
"""Refinement whose shots are chosen one by one; the others take the plan's."""


def maps_by_method(
    material: Maps, resolution: int, counts: Sequence[int], seed: int, methods: Sequence[str]
) -> Iterator[tuple[str, int, Maps]]:
    """(method, number of shots, maps) for the first shots of the plan.

    The rig that takes the pictures differs from the one that the methods believe in by errors drawn
    from the calibration's tolerances: lights 1 degree and 2 %, axis 0.1 mm, camera 0.2 degrees.
    """
    planned = [method for method in methods if method != ADAPTIVE]
    if planned:
        yield from _planned(SimulatedRig(material, seed), resolution, counts, planned)
    if ADAPTIVE in methods:
        for count, done in _adaptively(SimulatedRig(material, seed), resolution, counts):
            yield ADAPTIVE, count, done.maps


class SimulatedRig:
    """One draw of the calibration's errors. config: what is believed."""

    def __init__(self, material: Maps, seed: int) -> None:
        config = RigConfig.load(RIG)
        camera = config.camera
        size = {
            "width_px": camera.width_px // SENSOR_DIVISOR,
            "height_px": camera.height_px // SENSOR_DIVISOR,
        }
        self.config = config.model_copy(update={"camera": camera.model_copy(update=size)})
        self.thickness_mm = config.sample.reference_thickness_mm
        truth = perturbed(self.config, seed)
        self._photographer = Photographer(self.config, truth, material, self.thickness_mm, seed)

    def plan(self, shots: int) -> tuple[Shot, ...]:
        return plan(self.config, shots, self.thickness_mm)

    def take(self, shot: Shot) -> Picture:
        return self._photographer.take(shot.angle_deg, shot.leds)


def _planned(
    rig: SimulatedRig, resolution: int, counts: Sequence[int], methods: Sequence[str]
) -> Iterator[tuple[str, int, Maps]]:
    blind, told = Estimator(), Estimator()
    taken: list[Picture] = []
    for shot in rig.plan(max(counts)):
        taken.append(rig.take(shot))
        without = blind.add(replace(taken[-1], lighting=None)) if METHODS[1] in methods else None
        with_poses = told.add(taken[-1])
        count = len(taken)
        if count not in counts:
            continue
        for method in methods:
            yield method, count, _maps(method, taken, resolution, without, with_poses)


def _adaptively(
    rig: SimulatedRig, resolution: int, counts: Sequence[int]
) -> Iterator[tuple[int, Refinement]]:
    told = Estimator()
    shots = list(rig.plan(FIRST_BLOCK))
    taken: list[Picture] = []
    while True:
        taken.append(rig.take(shots[len(taken)]))
        with_poses = told.add(taken[-1])
        if len(taken) < len(shots) and len(taken) not in counts:
            continue
        done = refine(taken, with_poses, resolution)
        if len(taken) in counts:
            yield len(taken), done
        if len(taken) == max(counts):
            return
        if len(taken) == len(shots):
            shots.append(next_best(rig.config, done.learned, shots, rig.thickness_mm))


def _maps(
    method: str, taken: Sequence[Picture], resolution: int, without: Maps | None, with_poses: Maps
) -> Maps:
    match method:
        case "no model":
            sized = [scaled(picture, resolution) for picture in taken]
            return no_model([picture.image * picture.gain for picture in sized])
        case "network without poses":
            assert without is not None
            return without
        case "network with poses":
            return with_poses
        case "classical":
            return optimise(taken, resolution)
        case _:
            return refine(taken, with_poses, resolution).maps
