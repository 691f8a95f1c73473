"""A capture's events as a person follows them on a terminal."""

from collections.abc import Iterable

from rich.console import Console
from rich.progress import BarColumn, Progress, TaskID, TextColumn

from turnlight.capture import events
from turnlight.capture.events import Event, ShotDone
from turnlight.capture.state import State

_DOING = {
    State.HOMING: "Homing",
    State.RUNNING: "Capturing",
    State.PAUSING: "Pausing",
    State.PAUSED: "Paused",
    State.FINISHING: "Finishing",
}


def show(told: Iterable[Event], console: Console) -> None:
    """A bar with shot number, time left and change of the maps; a line a shot where there is no bar."""
    columns = TextColumn("{task.description}"), BarColumn(), TextColumn("{task.fields[state]}")
    hidden = not console.is_terminal
    with Progress(*columns, console=console, transient=True, disable=hidden) as progress:
        bar = progress.add_task("Getting ready", total=None, state="")
        for event in told:
            _move(progress, bar, event)
            for line, style in _lines(event, console.is_terminal):
                console.print(line, style=style, soft_wrap=True)


def _move(progress: Progress, bar: TaskID, event: Event) -> None:
    match event:
        case events.StateChanged():
            progress.update(bar, description=_DOING.get(event.state, "Getting ready"))
        case events.Started():
            progress.update(bar, total=event.count, completed=len(event.safe))
        case events.ExposureFound():
            progress.update(bar, description="Finding exposures")
        case events.ShotDone():
            following = f"Shot {min(event.done + 1, event.count)}/{event.count}"
            progress.update(bar, completed=event.done, description=following, state=_state(event))


def _lines(event: Event, has_bar: bool) -> Iterable[tuple[str, str | None]]:
    match event:
        case events.Started(safe=()):
            yield f"Capturing {event.count} shots into {event.folder}", None
        case events.Started():
            safe = len(event.safe)
            yield f"Going on with {event.folder}: {safe} of {event.count} shots are safe", None
        case events.ShotDone():
            if not has_bar:
                yield f"Shot {event.number}/{event.count}  {_state(event)}", None
            if event.record.warning:
                yield f"Shot {event.number}: {event.record.warning}", "yellow"
        case events.ShotFailed():
            yield f"Attempt {event.attempt}: {event.cause}", "yellow"
        case events.ShotSkipped():
            yield f"Shot {event.number} is skipped.", "yellow"
        case events.Enough():
            shots = event.done
            yield f"Enough: the last two of {shots} shots changed the maps by little", None
        case events.TableChecked() if event.steps_lost != 0:
            yield str(event), "yellow"
        case events.Finished():
            if event.contact_sheet is None:
                yield f"There are no shots in {event.folder}", None
            else:
                yield f"The maps are in {event.folder / 'maps'}", None
                yield f"Look at {event.contact_sheet}", None


def _state(event: ShotDone) -> str:
    changed = "first maps" if event.change is None else f"maps changed {event.change:.1%}"
    return f"{changed}, {event.seconds_left:.0f} s left"
