"""What a calibration tells whoever watches it: a terminal, a page, a script."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt

from turnlight.calibrate.targets import Target
from turnlight.calibration import Calibration, StepName


@dataclass(frozen=True)
class Place:
    """The target must be on the table before the calibration is asked to go on."""

    step: StepName
    target: Target
    instruction: str


@dataclass(frozen=True)
class Seen:
    """A frame was taken. picture: (h, w, 3) uint8 RGB as a screen shows it, reduced."""

    step: StepName
    number: int
    count: int
    picture: npt.NDArray[np.uint8]


@dataclass(frozen=True)
class Criterion:
    """One number that a step must reach: `value` at most `limit`."""

    name: str
    value: float
    limit: float
    unit: str

    @property
    def passed(self) -> bool:
        return self.value <= self.limit


@dataclass(frozen=True)
class StepDone:
    """A step has come to its end; where it passed, its numbers are in the calibration file.

    text: what was measured, in a sentence.
    """

    step: StepName
    passed: bool
    text: str
    criteria: tuple[Criterion, ...]


@dataclass(frozen=True)
class Calibrated:
    """Every step passed."""

    path: Path
    calibration: Calibration


Event = Place | Seen | StepDone | Calibrated
