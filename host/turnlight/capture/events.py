"""What the engine tells whoever listens: small, frozen, and ready for JSON; arrays stay on disk."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import Field, TypeAdapter

from turnlight.capture.manifest import ShotRecord
from turnlight.capture.state import State, Step


@dataclass(frozen=True)
class Snapshot:
    """Everything that a listener who comes now has missed.

    shots: numbers, from 1, of the shots that the maps are made of; skipped: why, by number.
    changes: how much the maps changed with each picture from the second on. cause: why the run is
    interrupted or faulted.
    """

    state: State
    folder: Path | None = None
    sample: str | None = None
    count: int = 0
    shots: tuple[int, ...] = ()
    skipped: dict[int, str] = field(default_factory=dict)
    changes: tuple[float, ...] = ()
    enough: bool = False
    cause: str | None = None
    kind: Literal["snapshot"] = "snapshot"


@dataclass(frozen=True)
class StateChanged:
    """The engine is in another state."""

    state: State
    kind: Literal["state"] = "state"


@dataclass(frozen=True)
class Started:
    """The session's folder is made, or is gone on with; `safe` are the numbers of the shots in it."""

    folder: Path
    sample: str
    count: int
    safe: tuple[int, ...]
    total_turn_deg: float
    kind: Literal["started"] = "started"


@dataclass(frozen=True)
class Refused:
    """The run could not be started, and nothing has been written."""

    cause: str
    kind: Literal["refused"] = "refused"


@dataclass(frozen=True)
class ExposureFound:
    """The exposure test has settled for these LEDs; clipped: share of the sample's pixels."""

    leds: tuple[int, ...]
    exposure_us: int
    clipped: float
    kind: Literal["exposure"] = "exposure"


@dataclass(frozen=True)
class ShotStep:
    """A shot has come as far as `step`, at_s seconds after the run began."""

    number: int
    step: Step
    at_s: float
    kind: Literal["step"] = "step"


@dataclass(frozen=True)
class ShotFailed:
    """This attempt, counted from 1, gave no usable picture; the shot is tried again or skipped."""

    number: int
    attempt: int
    cause: str
    kind: Literal["failed"] = "failed"


@dataclass(frozen=True)
class ShotSkipped:
    """The maps do without this shot."""

    number: int
    cause: str
    kind: Literal["skipped"] = "skipped"


@dataclass(frozen=True)
class ShotDone:
    """A shot is on disk and the maps on disk know of it.

    done: of `count` shots. change: mean absolute difference from the maps before, None for the first.
    seconds_left: at the pace so far.
    """

    number: int
    done: int
    count: int
    record: ShotRecord
    change: float | None
    seconds_left: float
    kind: Literal["shot"] = "shot"


@dataclass(frozen=True)
class Rebuilt:
    """The maps on disk have been made anew of the saved shots: their numbers, and how each changed them."""

    shots: tuple[int, ...]
    changes: tuple[float, ...]
    kind: Literal["rebuilt"] = "rebuilt"


@dataclass(frozen=True)
class Enough:
    """The last two pictures changed the maps by less than the preset's threshold."""

    done: int
    threshold: float
    kind: Literal["enough"] = "enough"


@dataclass(frozen=True)
class TableChecked:
    """The table was homed again behind the last shot; steps_lost since, negative if it was ahead.

    cause: why it could not be; the shots are safe all the same.
    """

    steps_lost: int | None
    cause: str | None = None
    kind: Literal["table"] = "table"

    def __str__(self) -> str:
        if self.cause is not None:
            return f"The table could not be checked for lost steps: {self.cause}"
        return (
            f"The table lost {self.steps_lost} steps in this run; check its load, the belt and the "
            "motor current. The pictures go by the markers and are good."
        )


@dataclass(frozen=True)
class Interrupted:
    """The run has stopped at shot `number`; `safe` shots are on disk. Resume, retake, or stop."""

    number: int
    count: int
    safe: int
    cause: str
    kind: Literal["interrupted"] = "interrupted"

    def __str__(self) -> str:
        return f"Interrupted at {self.number}/{self.count}: {self.cause} {self.safe} shots safe."


@dataclass(frozen=True)
class Faulted:
    """A defect of the program has ended the run; `safe` shots are on disk."""

    safe: int
    cause: str
    kind: Literal["faulted"] = "faulted"

    def __str__(self) -> str:
        return f"{self.cause} {self.safe} shots safe."


@dataclass(frozen=True)
class Finished:
    """Everything is on disk: maps of `count` shots, and a contact sheet unless there is no picture."""

    folder: Path
    count: int
    contact_sheet: Path | None
    kind: Literal["finished"] = "finished"


Event = Annotated[
    Snapshot
    | StateChanged
    | Started
    | Refused
    | ExposureFound
    | ShotStep
    | ShotFailed
    | ShotSkipped
    | ShotDone
    | Rebuilt
    | Enough
    | TableChecked
    | Interrupted
    | Faulted
    | Finished,
    Field(discriminator="kind"),
]
_ADAPTER: TypeAdapter[Event] = TypeAdapter(Event)


def as_json(event: Event) -> dict[str, Any]:
    """The event as JSON takes it, `kind` included."""
    fields: dict[str, Any] = _ADAPTER.dump_python(event, mode="json")
    return fields
