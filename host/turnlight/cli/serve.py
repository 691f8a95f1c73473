"""Own the rig: the page, and the service that runs it from the computer's start on."""

import json
from pathlib import Path
from typing import Annotated

import typer

from turnlight import app
from turnlight.cli.options import (
    SESSIONS,
    HostNameOption,
    JsonOption,
    PortOption,
    RigOption,
    SessionsOption,
    one_sentence,
)
from turnlight.service import Service, default_user, install
from turnlight.web.server import PORT, Address
from turnlight.web.server import serve as serve_page


def serve(
    rig: RigOption = app.DEFAULT_RIG,
    out: SessionsOption = SESSIONS,
    host: Annotated[
        str, typer.Option(help="Address to serve at; 0.0.0.0 is the whole network.")
    ] = "127.0.0.1",
    port: PortOption = PORT,
    token_file: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE", help="What a page must show; made if not there; needed on a network."
        ),
    ] = None,
    name: HostNameOption = None,
    material: Annotated[
        Path | None, typer.Option(metavar="DIR", help="The simulated rig's sample: a map folder.")
    ] = None,
    as_json_lines: JsonOption = False,
) -> None:
    """Own the rig: its page, and the button on it, which captures a sample. The service runs this."""
    with one_sentence(as_json_lines):
        address = Address(host, port, token_file, tuple(name or ()))

        def tell(sentence: str) -> None:
            print(json.dumps({"status": sentence}) if as_json_lines else sentence, flush=True)

        serve_page(rig, out, address, material, tell)


def install_service(
    rig: RigOption = app.DEFAULT_RIG,
    out: SessionsOption = Path("/var/lib/turnlight"),
    user: Annotated[
        str | None, typer.Option(help="Who runs the service; default: who calls this.")
    ] = None,
    rules_only: Annotated[
        bool, typer.Option("--rules-only", help="The udev rules, and no service.")
    ] = False,
    root: Annotated[
        Path, typer.Option(metavar="DIR", help="Write under this folder, and start nothing.")
    ] = Path("/"),
    as_json_object: JsonOption = False,
) -> None:
    """Let this computer run the rig from its start on: a systemd unit and udev rules."""
    with one_sentence(as_json_object):
        service = None if rules_only else Service(rig, out, user or default_user())
        written = [str(path) for path in install(service, root)]
        if as_json_object:
            print(json.dumps({"written": written}))
        else:
            print(*(f"Wrote {path}" for path in written), sep="\n")
