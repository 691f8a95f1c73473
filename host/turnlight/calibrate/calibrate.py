"""A whole calibration: step after step, each verdict told, each good result on disk at once."""

from collections.abc import Collection, Iterator
from datetime import UTC, datetime
from pathlib import Path

from turnlight.calibrate.bench import Bench
from turnlight.calibrate.events import Calibrated, Event, StepDone
from turnlight.calibrate.steps import STEPS
from turnlight.calibrate.targets import Targets
from turnlight.calibration import Measured, StepName, encode_calibration
from turnlight.capture import durable
from turnlight.capture.shot import lights_off
from turnlight.errors import CalibrationError
from turnlight.rig.rig import Rig

ALL_STEPS: tuple[StepName, ...] = tuple(STEPS)


def calibrate(rig: Rig, targets: Targets, steps: Collection[str], path: Path) -> Iterator[Event]:
    """Do the steps in their order, starting from the rig's calibration, or its configuration.

    After a Place event, ask for the next event only once the target is on the table. Each step that
    passes replaces the file at `path`; the first that does not ends the calibration with
    CalibrationError. The LEDs are off however this ends.
    """
    bench = Bench(rig)
    config = rig.config
    try:
        rig.controller.home()
        for step in (s for s in ALL_STEPS if s in steps):
            outcome = yield from STEPS[step](bench, config, targets)
            failed = [c for c in outcome.criteria if not c.passed]
            yield StepDone(step, not failed, outcome.text, outcome.criteria)
            if failed:
                worst = failed[0]
                raise CalibrationError(
                    f"The step {step} did not pass: {worst.name} is {worst.value:.3g} {worst.unit} "
                    f"and must be at most {worst.limit:g}; check the target and the light, and run "
                    f"turnlight calibrate --only {step}."
                )
            measured = Measured(date=datetime.now(UTC), text=outcome.text)
            before = outcome.calibration
            calibration = before.model_copy(
                update={"measured": {**before.measured, step: measured}}
            )
            config = config.calibrated(calibration)
            durable.write(path, encode_calibration(calibration))
    finally:
        lights_off(rig)
    yield Calibrated(path, config.geometry)
