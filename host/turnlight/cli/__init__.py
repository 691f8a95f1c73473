"""The commands, thin: each asks app or doctor and shows the answer to a person or a script."""

import signal
import sys
from typing import NoReturn

import typer

from turnlight.cli import calibrate, doctor, export, firmware, look, phone, photos, run, serve

commands = typer.Typer(
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
    help="Material maps (normal, diffuse, roughness, specular) from pictures of a flat sample.",
)
for command in (
    run.capture,
    run.resume,
    run.refine,
    photos.infer,
    photos.frame,
    phone.handheld,
    export.export,
    look.plan,
    look.sessions,
    calibrate.calibrate,
    doctor.doctor,
    serve.serve,
    serve.install_service,
):
    commands.command()(command)

controller = typer.Typer(no_args_is_help=True, help="The controller's firmware.")
controller.command()(firmware.flash)
controller.command()(firmware.parameters)
commands.add_typer(controller, name="firmware")


def main() -> None:
    """The `turnlight` program."""
    signal.signal(signal.SIGTERM, _end)
    commands()


def _end(number: int, _frame: object) -> NoReturn:
    """Ends as any other way does, so that the LEDs go off."""
    sys.exit(128 + number)
