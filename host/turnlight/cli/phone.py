"""Photograph a sample with a phone: the page it opens, and the maps that come of it."""

import dataclasses
import json
from pathlib import Path
from typing import Annotated

import segno
import typer

from turnlight import app
from turnlight.cli.options import HostNameOption, JsonOption, OutOption, PortOption, one_sentence
from turnlight.cli.photos import WhiteOption
from turnlight.errors import TurnlightError
from turnlight.handheld.handheld import Handheld
from turnlight.handheld.inbox import Arrival
from turnlight.handheld.record import WHITE
from turnlight.handheld.verdict import Verdict
from turnlight.web.phone_server import PORT, Told, serve_phone
from turnlight.web.server import Address


def handheld(
    sample: Annotated[str, typer.Option(help="What the sample is called.")] = "sample",
    watch: Annotated[
        Path | None,
        typer.Option(metavar="DIR", help="Take photos from this folder too, as they come."),
    ] = None,
    white: WhiteOption = WHITE,
    out: OutOption = None,
    host: Annotated[
        str, typer.Option(help="Address to serve at; 127.0.0.1 is this computer alone.")
    ] = "0.0.0.0",
    port: PortOption = PORT,
    token_file: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Keeps the token, so that the link stays the same."),
    ] = None,
    name: HostNameOption = None,
    as_json_lines: JsonOption = False,
) -> None:
    """Photograph a sample in the printed frame with a phone: open the link on it, no app needed.

    With the folder of a session that was begun before as --out, go on with it.
    """
    with one_sentence(as_json_lines):
        begun = out if out is not None and (out / "session.json").exists() else None
        session = Handheld.open(begun) if begun else app.new_handheld(sample, white, out)
        told = _in_json(session) if as_json_lines else _in_words(session)
        try:
            serve_phone(session, Address(host, port, token_file, tuple(name or ())), watch, told)
        except TurnlightError:
            if not begun:
                session.discard()
            raise
        sheet = session.finish()
        if as_json_lines:
            print(json.dumps({"session": str(session.folder), "maps": sheet is not None}))
        elif sheet is not None:
            print(f"The maps are in {session.folder / 'maps'}")


def _in_words(session: Handheld) -> Told:
    def link(address: str) -> None:
        segno.make(address, error="m").terminal(compact=True, border=2)
        print(f"Point the phone's camera at this, or open {address}")
        print(
            "Whoever listens on this network can see the photos; for an open network put a reverse "
            "proxy with TLS before it."
        )
        print(f"The session is {session.folder}. End with Ctrl-C.", flush=True)

    def news(what: Verdict | Arrival) -> None:
        if isinstance(what, Arrival):
            print(what.sentence, flush=True)
        else:
            use = "" if what.used else "not used. "
            print(f"{what.number:3}  {what.name}: {use}{what.sentence}", flush=True)

    return Told(link, news)


def _in_json(session: Handheld) -> Told:
    def link(address: str) -> None:
        print(json.dumps({"link": address, "session": str(session.folder)}), flush=True)

    def news(what: Verdict | Arrival) -> None:
        kind = "refused" if isinstance(what, Arrival) else "photo"
        about = dataclasses.asdict(what) | {"sentence": what.sentence}
        print(json.dumps({kind: about}), flush=True)

    return Told(link, news)
