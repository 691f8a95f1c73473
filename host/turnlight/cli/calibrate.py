"""Measure the rig."""

import json
import sys
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from turnlight import app, calibrating, calibration_report
from turnlight.calibrate.calibrate import ALL_STEPS
from turnlight.calibrate.targets import Targets
from turnlight.cli.options import JsonOption, RigOption, one_sentence
from turnlight.config import RigConfig
from turnlight.errors import CalibrationError


def calibrate(
    rig: RigOption = app.DEFAULT_RIG,
    only: Annotated[
        list[str] | None,
        typer.Option(
            "--only",
            help=f"A step to do ({', '.join(ALL_STEPS)}), the others staying as they are; repeatable.",
        ),
    ] = None,
    square_mm: Annotated[float, typer.Option(min=1, help="Side of the board's squares.")] = 12.0,
    ball_mm: Annotated[float, typer.Option(min=5, help="Diameter of the glossy ball.")] = 30.0,
    white_reflectance: Annotated[
        float, typer.Option(min=0.5, max=1, help="Of the white board.")
    ] = 0.95,
    thickness_mm: Annotated[
        float, typer.Option(min=0, max=50, help="Of white board and chart.")
    ] = 2.0,
    yes: Annotated[
        bool, typer.Option("--yes", help="Every target is in place; do not ask.")
    ] = False,
    print_targets: Annotated[
        Path | None,
        typer.Option("--print-targets", metavar="DIR", help="Only write the targets to print."),
    ] = None,
    as_json_lines: JsonOption = False,
) -> None:
    """Measure where camera, axis, markers and lights are, how bright and of what colour they are."""
    with one_sentence(as_json_lines):
        targets = Targets(
            square_mm=square_mm,
            ball_diameter_mm=ball_mm,
            white_reflectance=white_reflectance,
            thickness_mm=thickness_mm,
        )
        if print_targets:
            paths = [str(p) for p in calibrating.print_targets(rig, targets, print_targets)]
            print(json.dumps({"targets": paths}) if as_json_lines else "\n".join(paths))
            return
        simulated = RigConfig.load(rig).camera.driver == app.SIMULATED
        asking = not (yes or simulated)
        if asking and not sys.stdin.isatty():
            raise CalibrationError(
                "Nobody is there to put targets on the table; run this on a terminal, or pass --yes "
                "with --only for the one step whose target lies ready."
            )
        events = calibrating.run(rig, targets, only or ALL_STEPS)
        if as_json_lines:
            for event in events:
                print(json.dumps(calibration_report.as_json(event)), flush=True)
        else:
            console = Console(markup=False, highlight=False)
            calibration_report.show(events, console, _wait_for_operator if asking else _go_on)


def _wait_for_operator() -> None:
    input("Press Enter when it is there. ")


def _go_on() -> None:
    """The simulated rig has put its target on the table."""
