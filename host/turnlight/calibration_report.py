"""A calibration's events as a person follows them on a terminal, and as scripts read them."""

from collections.abc import Callable, Iterable
from typing import Any

import cv2
import numpy as np
import numpy.typing as npt
from rich.console import Console, Group
from rich.live import Live
from rich.text import Text

from turnlight.calibrate.events import Calibrated, Criterion, Event, Place, Seen, StepDone

COLUMNS = 56


def show(events: Iterable[Event], console: Console, confirm: Callable[[], None]) -> None:
    """The live picture while a step looks, a line a verdict. confirm: waits for the operator."""
    with Live(console=console, transient=True, auto_refresh=False) as screen:
        for event in events:
            match event:
                case Place():
                    screen.update("", refresh=True)
                    console.print(f"{event.step}: {event.instruction}", soft_wrap=True)
                    confirm()
                case Seen() if console.is_terminal:
                    count = Text(f"{event.step}: frame {event.number}/{event.count}")
                    screen.update(Group(_blocks(event.picture), count), refresh=True)
                case StepDone():
                    screen.update("", refresh=True)
                    verdict = "PASS" if event.passed else "FAIL"
                    console.print(f"{verdict}  {event.step}: {event.text}", soft_wrap=True)
                    for criterion in event.criteria:
                        console.print(f"        {_line(criterion)}", soft_wrap=True)
                case Calibrated():
                    console.print(f"The calibration is in {event.path}", soft_wrap=True)
                case _:
                    pass


def as_json(event: Event) -> dict[str, Any]:
    """One event for one line of JSON, without pictures."""
    match event:
        case Place():
            return {
                "event": "place",
                "step": event.step,
                "target": event.target,
                "instruction": event.instruction,
            }
        case Seen():
            return {
                "event": "seen",
                "step": event.step,
                "number": event.number,
                "count": event.count,
            }
        case StepDone():
            return {
                "event": "step",
                "step": event.step,
                "passed": event.passed,
                "text": event.text,
                "criteria": [
                    {"name": c.name, "value": c.value, "limit": c.limit, "unit": c.unit}
                    for c in event.criteria
                ],
            }
        case Calibrated():
            return {"event": "calibrated", "path": str(event.path)}


def _line(criterion: Criterion) -> str:
    sign = "ok  " if criterion.passed else "FAIL"
    unit = criterion.unit if criterion.unit in ("", "°") else f" {criterion.unit}"
    return f"{sign}  {criterion.name} {criterion.value:.3g}{unit} (at most {criterion.limit:g})"


def _blocks(picture: npt.NDArray[np.uint8]) -> Text:
    """The picture in half blocks, two pixels a character."""
    height, width = picture.shape[:2]
    rows = round(COLUMNS * height / width / 2) * 2
    small = cv2.resize(picture, (COLUMNS, rows), interpolation=cv2.INTER_AREA)
    text = Text()
    for upper, lower in zip(small[0::2], small[1::2], strict=True):
        for top, bottom in zip(upper.tolist(), lower.tolist(), strict=True):
            text.append("▀", f"rgb({_rgb(top)}) on rgb({_rgb(bottom)})")
        text.append("\n")
    return text


def _rgb(pixel: list[int]) -> str:
    return ",".join(map(str, pixel))
