"""What a capture would do, and what there is of captures: the plan and the sessions."""

import dataclasses
import json
from typing import Annotated

import typer
from pydantic import TypeAdapter
from rich.console import Console
from rich.table import Table

from turnlight import app
from turnlight.capture import plan as planning
from turnlight.catalogue import Catalogue
from turnlight.cli.options import (
    SESSIONS,
    DayOption,
    JsonOption,
    RigOption,
    SessionsOption,
    one_sentence,
)
from turnlight.config import RigConfig


def plan(
    rig: RigOption = app.DEFAULT_RIG,
    shots: Annotated[int, typer.Option("--shots", min=1, help="How many pictures.")] = 10,
    as_json_object: JsonOption = False,
) -> None:
    """Show the shots that a capture would take."""
    with one_sentence(as_json_object):
        config = RigConfig.load(rig)
        planned = planning.plan(config, shots, config.sample.reference_thickness_mm)
        turn_deg = planning.total_turn_deg(shot.angle_deg for shot in planned)
        minutes = planning.expected_s(planned) / 60
        if as_json_object:
            rows = [dataclasses.asdict(shot) for shot in planned]
            print(json.dumps({"shots": rows, "total_turn_deg": turn_deg, "minutes": minutes}))
            return
        table = Table("Shot", "Angle", "LEDs", "Exposure", box=None)
        for shot in planned:
            table.add_row(
                str(shot.index + 1),
                f"{shot.angle_deg:5.1f}°",
                ", ".join(map(str, shot.leds)),
                f"{shot.exposure_us / 1000:g} ms",
            )
        Console(markup=False, highlight=False).print(table)
        print(f"The table turns {turn_deg:.0f}° in all; about {minutes:.1f} minutes.")


def sessions(
    words: Annotated[list[str] | None, typer.Argument(metavar="WORD", show_default=False)] = None,
    root: SessionsOption = SESSIONS,
    barcode: Annotated[str | None, typer.Option(help="Only samples with this barcode.")] = None,
    since: DayOption = None,
    until: DayOption = None,
    as_json_object: JsonOption = False,
) -> None:
    """List the sessions, newest first; only those whose names have every WORD in them."""
    with one_sentence(as_json_object), Catalogue(root) as catalogue:
        found = catalogue.search(
            " ".join(words or ()), barcode, since and since.date(), until and until.date()
        )
        if as_json_object:
            rows = [dataclasses.asdict(e) | {"folder": e.folder, "state": e.state} for e in found]
            print(TypeAdapter(dict[str, object]).dump_json({"sessions": rows}).decode())
            return
        table = Table("Started", "Sample", "Barcode", "State", box=None)
        table.add_column("Folder", overflow="fold")
        for entry in found:
            started = f"{entry.started.astimezone():%Y-%m-%d %H:%M}"
            table.add_row(
                started, entry.sample, entry.barcode or "", entry.state, entry.folder.name
            )
        Console(markup=False, highlight=False).print(table)
