"""Calibrating the rig that a file describes; a simulated one puts its targets on itself."""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

from turnlight.app import Sample, build_rig
from turnlight.calibrate.calibrate import ALL_STEPS, calibrate
from turnlight.calibrate.events import Event, Place
from turnlight.calibrate.printable import sheets
from turnlight.calibrate.targets import Target, Targets
from turnlight.calibration import calibration_path
from turnlight.capture import durable
from turnlight.config import RigConfig
from turnlight.errors import ConfigError
from turnlight.rig.camera.camera import Camera
from turnlight.rig.camera.oak import OakCamera
from turnlight.rig.rig import Rig
from turnlight.simulation.camera import SimulatedCamera
from turnlight.simulation.optics import Subject
from turnlight.simulation.sample import FlatSample
from turnlight.simulation.targets import Chart, GlossyBall, LeaningBoard, Nothing, white_board
from turnlight.simulation.truth import as_built

MISPLACED_MM = (1.5, -1.0)
"""The simulated operator puts the ball down as a person would: not quite where he should."""


def run(rig_file: Path, targets: Targets, steps: Sequence[str]) -> Iterator[Event]:
    """`calibrate` on this rig; the result goes beside its file. Raises TurnlightError."""
    unknown = [step for step in steps if step not in ALL_STEPS]
    if unknown:
        raise ConfigError(
            f"There is no calibration step {unknown[0]}; choose among {', '.join(ALL_STEPS)}."
        )
    config = RigConfig.load(rig_file)
    sample = Sample("calibration", config.sample.reference_thickness_mm)
    with build_rig(config, sample) as rig:
        yield from on(rig, rig_file, targets, steps)


def on(rig: Rig, rig_file: Path, targets: Targets, steps: Sequence[str]) -> Iterator[Event]:
    """`run` on the rig of this file that is connected already; what lay on its table is gone then."""
    config = RigConfig.load(rig_file)
    begun = replace(rig, config=from_factory(config, rig.camera))
    for event in calibrate(begun, targets, steps, calibration_path(rig_file)):
        if isinstance(event, Place) and isinstance(rig.camera, SimulatedCamera):
            rig.camera.place(_subject(event.target, targets, config))
        yield event


def from_factory(config: RigConfig, camera: Camera) -> RigConfig:
    """The rig with the focal length that an OAK knows of itself, where none has been measured."""
    before = config.geometry
    if not isinstance(camera, OakCamera) or not camera.info.focal_px:
        return config
    if "geometry" in before.measured:
        return config
    lens = before.lens.model_copy(update={"focal_px": camera.info.focal_px})
    return config.calibrated(before.model_copy(update={"lens": lens}))


def print_targets(rig_file: Path, targets: Targets, folder: Path) -> list[Path]:
    """Write the printable targets as PDF into a new folder. Raises ConfigError or SessionError."""
    made = sheets(RigConfig.load(rig_file), targets)
    durable.create_folder(folder)
    paths = [folder / f"{name}.pdf" for name in made]
    for path, sheet in zip(paths, made.values(), strict=True):
        durable.write(path, sheet.pdf())
    return paths


def _subject(target: Target, targets: Targets, config: RigConfig) -> Subject:
    side = config.sample.side_mm
    match target:
        case Target.NOTHING:
            return Nothing()
        case Target.BOARD:
            return LeaningBoard(targets.square_mm)
        case Target.BALL:
            x, y = targets.ball_place_mm
            return GlossyBall(targets.ball_diameter_mm, (x + MISPLACED_MM[0], y + MISPLACED_MM[1]))
        case Target.WHITE:
            return FlatSample(white_board(targets.white_reflectance), targets.thickness_mm, side)
        case Target.CHART:
            seed = config.simulation.truth_seed if config.simulation else None
            return Chart(targets.thickness_mm, as_built(config, seed).warmth, side)
