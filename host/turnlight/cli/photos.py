"""Maps from photographs taken by hand."""

import json
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.progress import track

from turnlight import app
from turnlight.capture.events import as_json
from turnlight.cli.options import JsonOption, OutOption, one_sentence
from turnlight.errors import ImageError
from turnlight.progress import show


def infer(
    images: Annotated[list[Path], typer.Argument(metavar="IMAGE...", show_default=False)],
    aligned: Annotated[
        bool, typer.Option("--aligned", help="The pictures are rectified and square.")
    ] = False,
    out: OutOption = None,
    as_json_object: JsonOption = False,
) -> None:
    """Make maps from photographs, in any order."""
    with one_sentence(as_json_object):
        if not aligned:
            raise ImageError(
                "Photos that are not yet rectified need the printed frame, which this version does "
                "not read; crop them square to the sample and pass --aligned."
            )
        console = Console(markup=False, highlight=False)
        hidden = as_json_object or not console.is_terminal
        progress = track(images, "Estimating", console=console, transient=True, disable=hidden)
        finished = app.infer(progress, images[0].stem, out)
        if as_json_object:
            print(json.dumps(as_json(finished)))
        else:
            show([finished], console)
