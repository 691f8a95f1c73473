"""The rig's calibration from the page: a step at a time, its live picture, and its verdict."""

import contextlib
import functools
import threading
from collections.abc import Callable
from contextlib import AbstractContextManager
from datetime import datetime
from pathlib import Path
from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field

from turnlight import calibrating
from turnlight.calibrate.events import Criterion, Event, Seen, StepDone
from turnlight.calibrate.targets import TARGET_OF, Target, Targets
from turnlight.calibration import Calibration, StepName
from turnlight.errors import RunError, SessionError, TurnlightError
from turnlight.rig.rig import Rig
from turnlight.web.images import jpeg

STOPPED = "Stopped; nothing has changed."
_DEFECT = "A defect of the program has ended this step; its log says more."


class AtHand(BaseModel):
    """The targets at hand. square_mm: side of the board's squares; white_reflectance: of the white board;
    thickness_mm: of white board and chart."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    square_mm: Annotated[float, Field(ge=1, le=100, allow_inf_nan=False)] = 12.0
    ball_mm: Annotated[float, Field(ge=5, le=200, allow_inf_nan=False)] = 30.0
    white_reflectance: Annotated[float, Field(ge=0.5, le=1, allow_inf_nan=False)] = 0.95
    thickness_mm: Annotated[float, Field(ge=0, le=50, allow_inf_nan=False)] = 2.0

    def targets(self) -> Targets:
        return Targets(
            square_mm=self.square_mm,
            ball_diameter_mm=self.ball_mm,
            white_reflectance=self.white_reflectance,
            thickness_mm=self.thickness_mm,
        )


class Limit(BaseModel):
    """One number that a step must reach: `value` at most `limit`."""

    name: str
    value: float
    limit: float
    unit: str
    passed: bool


class StepShape(BaseModel):
    """A step. text: what was measured, or why it failed; number: frames taken of `count`."""

    name: StepName
    target: Target
    instruction: str
    state: Literal["open", "measuring", "passed", "failed"] = "open"
    measured: datetime | None = None
    """When what the calibration file has was measured."""
    text: str = ""
    limits: tuple[Limit, ...] = ()
    number: int = 0
    count: int = 0


class CalibrationShape(BaseModel):
    """picture: counts the live pictures, the latest of which is to be had; 0 if there is none."""

    kind: Literal["calibration"] = "calibration"
    running: StepName | None = None
    at_hand: AtHand = AtHand()
    picture: int = 0
    steps: tuple[StepShape, ...]


class Calibrator:
    """Does one step after the other, each as somebody asks for it.

    lend: gives the rig for as long as a step takes; changed: called when the calibration file has changed,
    gives what is in it.
    """

    def __init__(
        self,
        rig_file: Path,
        known: Calibration,
        lend: Callable[[], AbstractContextManager[Rig]],
        changed: Callable[[], Calibration],
    ) -> None:
        self._rig_file = rig_file
        self._lend = lend
        self._changed = changed
        self._lock = threading.Lock()
        self._wakes: set[Callable[[], None]] = set()
        self._rig: Rig | None = None
        self.stopping = False
        """Has somebody stopped the step that is, or was, being measured?"""
        self._picture = b""
        self._thread: threading.Thread | None = None
        self._now = CalibrationShape(steps=tuple(_step(name, known) for name in TARGET_OF))

    @property
    def now(self) -> CalibrationShape:
        """Replaced, not changed, whenever something happens."""
        return self._now

    @property
    def running(self) -> bool:
        return self._now.running is not None

    def picture(self) -> bytes:
        """JPEG of the latest frame. Raises SessionError if there is none."""
        if not self._picture:
            raise SessionError("There is no picture yet; start a step.")
        return self._picture

    def listen(self, wake: Callable[[], None]) -> Callable[[], None]:
        """`wake` is called, from any thread, after every change, until the returned function is."""
        self._wakes.add(wake)
        return lambda: self._wakes.discard(wake)

    def start(self, name: StepName, at_hand: AtHand) -> None:
        """Do this step; its target is on the table. Raises RunError while another is being done."""
        with self._lock:
            if self.running:
                raise RunError("A step is being measured; wait until it is done, or stop it.")
            self.stopping = False
            self._picture = b""
            targets = at_hand.targets()
            steps = tuple(
                s.model_copy(update={"instruction": targets.instruction(s.target)})
                for s in self._now.steps
            )
            self._tell(
                CalibrationShape(running=name, at_hand=at_hand, steps=steps),
                name, state="measuring", text="", limits=(), number=0, count=0,
            )  # fmt: skip
            work = functools.partial(self._measure, name, targets)
            self._thread = threading.Thread(target=work, name="calibrate", daemon=True)
            self._thread.start()

    def stop(self) -> None:
        """Stop table and LEDs at once, and leave the calibration as it was."""
        if not self.running:
            raise RunError("No step is being measured.")
        self.stopping = True
        rig = self._rig
        if rig is not None:
            with contextlib.suppress(TurnlightError):
                rig.controller.stop()

    def close(self) -> None:
        with contextlib.suppress(RunError):
            self.stop()
        if self._thread is not None:
            self._thread.join()

    def _measure(self, name: StepName, targets: Targets) -> None:
        end: dict[str, object] = {"state": "failed", "text": _DEFECT}
        try:
            with self._lend() as self._rig:
                self._go_on()
                for event in calibrating.on(self._rig, self._rig_file, targets, [name]):
                    self._go_on()
                    self._heard(event)
            measured = self._changed().measured[name]
            end = {"state": "passed", "text": measured.text, "measured": measured.date}
        except TurnlightError as error:
            cause = str(error).replace(f"run turnlight calibrate --only {name}", "try again")
            end["text"] = STOPPED if self.stopping else cause
        finally:
            self._rig = None
            self._tell(self._now.model_copy(update={"running": None}), name, **end)

    def _go_on(self) -> None:
        """Raises RunError once somebody has stopped it."""
        if self.stopping:
            raise RunError(STOPPED)

    def _heard(self, event: Event) -> None:
        match event:
            case Seen():
                self._picture = jpeg(event.picture)
                now = self._now.model_copy(update={"picture": self._now.picture + 1})
                self._tell(now, event.step, number=event.number, count=event.count)
            case StepDone():
                limits = tuple(_limit(criterion) for criterion in event.criteria)
                self._tell(self._now, event.step, text=event.text, limits=limits)
            case _:
                pass

    def _tell(self, now: CalibrationShape, name: StepName, **changes: object) -> None:
        """The state is `now`, with these changes to one of its steps."""
        steps = (s.model_copy(update=changes) if s.name == name else s for s in now.steps)
        self._now = now.model_copy(update={"steps": tuple(steps)})
        for wake in tuple(self._wakes):
            wake()


def _step(name: StepName, known: Calibration) -> StepShape:
    target = TARGET_OF[name]
    step = StepShape(name=name, target=target, instruction=AtHand().targets().instruction(target))
    if (measured := known.measured.get(name)) is not None:
        step = step.model_copy(
            update={"state": "passed", "measured": measured.date, "text": measured.text}
        )
    return step


def _limit(criterion: Criterion) -> Limit:
    return Limit(
        name=criterion.name,
        value=criterion.value,
        limit=criterion.limit,
        unit=criterion.unit,
        passed=criterion.passed,
    )
