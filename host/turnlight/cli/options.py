"""What several commands share: their options, and how they end on an error a user can meet."""

import contextlib
import json
import sys
from collections.abc import Iterator
from datetime import datetime
from pathlib import Path
from typing import Annotated

import typer

from svbrdf.materials import MaterialError
from turnlight.errors import TurnlightError

RigOption = Annotated[
    Path, typer.Option("--rig", metavar="FILE", help="The rig's TOML file.", show_default=False)
]
OutOption = Annotated[
    Path | None,
    typer.Option("--out", metavar="DIR", help="The new folder; default: one under ./sessions."),
]
SessionsOption = Annotated[
    Path, typer.Option("--in", "--out", metavar="DIR", help="The folder that the sessions are in.")
]
DayOption = Annotated[
    datetime | None,
    typer.Option(
        formats=["%Y-%m-%d"], metavar="YYYY-MM-DD", help="Started from, or up to, this day."
    ),
]
HostNameOption = Annotated[
    list[str] | None,
    typer.Option(help="A host name that this computer is called by; may be repeated."),
]
PortOption = Annotated[int, typer.Option(min=0, max=65535, help="0: any free one.")]
JsonOption = Annotated[bool, typer.Option("--json", help="Answer in JSON, for scripts.")]

SESSIONS = Path("sessions")


@contextlib.contextmanager
def one_sentence(as_json_object: bool) -> Iterator[None]:
    """Every error a user can meet, as its one sentence and exit code 1."""
    try:
        yield
    except (TurnlightError, MaterialError) as error:
        if as_json_object:
            print(json.dumps({"error": str(error)}))
        else:
            print(error, file=sys.stderr)
        raise typer.Exit(1) from error
