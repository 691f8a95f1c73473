"""A capture's events as a person follows them on a terminal, and as scripts read them."""

from collections.abc import Iterable
from typing import Any

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn

from turnlight.app import Event, Finished, Started
from turnlight.capture.sequencer import ShotDone


def show(events: Iterable[Event], console: Console) -> None:
    """A bar with shot number, time left and change of the maps; a line a shot where there is no bar."""
    columns = TextColumn("{task.description}"), BarColumn(), TextColumn("{task.fields[state]}")
    hidden = not console.is_terminal
    with Progress(*columns, console=console, transient=True, disable=hidden) as progress:
        bar = progress.add_task("Getting ready", total=None, state="")
        for event in events:
            match event:
                case Started():
                    console.print(
                        f"Capturing {event.count} shots into {event.folder}", soft_wrap=True
                    )
                    progress.update(bar, total=event.count, description=f"Shot 1/{event.count}")
                case ShotDone():
                    _show_shot(event, console)
                    following = min(event.number + 1, event.count)
                    progress.update(
                        bar,
                        completed=event.number,
                        description=f"Shot {following}/{event.count}",
                        state=_state(event),
                    )
                case Finished():
                    console.print(f"The maps are in {event.folder / 'maps'}", soft_wrap=True)
                    console.print(f"Look at {event.contact_sheet}", soft_wrap=True)


def as_json(event: Event) -> dict[str, Any]:
    """One event for one line of JSON; arrays stay on disk, where `folder` says."""
    match event:
        case Started():
            return {
                "event": "started",
                "folder": str(event.folder),
                "count": event.count,
                "total_turn_deg": event.total_turn_deg,
            }
        case ShotDone():
            return {
                "event": "shot",
                "number": event.number,
                "count": event.count,
                "change": event.change,
                "seconds_left": event.seconds_left,
                **event.record.model_dump(mode="json"),
            }
        case Finished():
            return {
                "event": "finished",
                "folder": str(event.folder),
                "count": event.count,
                "maps": str(event.folder / "maps"),
                "contact_sheet": str(event.contact_sheet),
            }


def _show_shot(event: ShotDone, console: Console) -> None:
    if not console.is_terminal:
        console.print(f"Shot {event.number}/{event.count}  {_state(event)}", soft_wrap=True)
    if event.record.warning:
        console.print(
            f"Shot {event.number}: {event.record.warning}", style="yellow", soft_wrap=True
        )


def _state(event: ShotDone) -> str:
    changed = "first maps" if event.change is None else f"maps changed {event.change:.1%}"
    return f"{changed}, {event.seconds_left:.0f} s left"
