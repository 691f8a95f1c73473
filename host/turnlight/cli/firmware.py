"""The controller's firmware and its parameters."""

import dataclasses
import json
import sys
from typing import Annotated

import typer

from turnlight import app
from turnlight.cli.options import JsonOption, RigOption, one_sentence
from turnlight.config import RigConfig
from turnlight.flash import flash as write_firmware
from turnlight.rig.controller import PARAMETERS


def flash(
    rig: RigOption = app.DEFAULT_RIG,
    board: Annotated[
        str | None,
        typer.Option(help="atmega2560 or atmega328p, for a board that does not answer yet."),
    ] = None,
    as_json_object: JsonOption = False,
) -> None:
    """Write the firmware to the rig's controller, and have it confirm what it runs."""
    with one_sentence(as_json_object):
        quiet = as_json_object or not sys.stderr.isatty()
        image = write_firmware(RigConfig.load(rig), board, quiet=quiet)
        if as_json_object:
            print(json.dumps(dataclasses.asdict(image) | {"path": str(image.path)}))
        else:
            print(f"The controller runs {image}.")


def parameters(
    setting: Annotated[
        tuple[str, int] | None,
        typer.Option("--set", metavar="NAME VALUE", help="Set one; the controller keeps it."),
    ] = None,
    rig: RigOption = app.DEFAULT_RIG,
    as_json_object: JsonOption = False,
) -> None:
    """What the controller knows of this rig: motor, gears, speeds, LEDs. PROTOCOL.md explains them."""
    with one_sentence(as_json_object), app.connect(RigConfig.load(rig)) as connection:
        controller = connection.controller
        if setting is not None:
            known = [controller.set_parameter(*setting)]
        else:
            known = [controller.parameter(name) for name in PARAMETERS]
        if as_json_object:
            print(json.dumps([dataclasses.asdict(parameter) for parameter in known]))
        else:
            print(*known, sep="\n")
