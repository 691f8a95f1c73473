"""Maps from photographs taken by hand, and the frame to take them in."""

import dataclasses
import json
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.progress import Progress, track

from turnlight import app
from turnlight.capture import durable
from turnlight.capture.events import as_json
from turnlight.cli.options import JsonOption, OutOption, one_sentence
from turnlight.errors import ImageError
from turnlight.handheld.record import WHITE
from turnlight.handheld.sheet import Paper, frame_of_size, pdf
from turnlight.handheld.verdict import Verdict
from turnlight.progress import show

WhiteOption = Annotated[
    float, typer.Option("--white", min=0.5, max=1, help="Reflectance of the frame's paper.")
]


def infer(
    images: Annotated[list[Path], typer.Argument(metavar="IMAGE...", show_default=False)],
    aligned: Annotated[
        bool, typer.Option("--aligned", help="The pictures are rectified and square.")
    ] = False,
    white: WhiteOption = WHITE,
    size: Annotated[
        str | None,
        typer.Option(
            "--size",
            help="Of the opening of a plain white frame, like 100x100mm; hold the phone the same way up "
            "each time. A marked frame says its size itself.",
        ),
    ] = None,
    force: Annotated[
        bool, typer.Option("--force", help="Use photos in spite of what the checks find.")
    ] = False,
    out: OutOption = None,
    as_json_object: JsonOption = False,
) -> None:
    """Make maps from photographs of a sample in the printed frame, in any order."""
    with one_sentence(as_json_object):
        if not aligned:
            plain_mm = None if size is None else frame_of_size(size).side_mm
            _infer_framed(images, white, force, plain_mm, out, as_json_object)
            return
        console = Console(markup=False, highlight=False)
        hidden = as_json_object or not console.is_terminal
        progress = track(images, "Estimating", console=console, transient=True, disable=hidden)
        finished = app.infer(progress, images[0].stem, out)
        if as_json_object:
            print(json.dumps(as_json(finished)))
        else:
            show([finished], console)


def frame(
    size: Annotated[str, typer.Option("--size", help="Of the opening, like 100x100mm.")],
    paper: Annotated[Paper, typer.Option("--paper", help="To print on.")] = Paper.A4,
    white: WhiteOption = WHITE,
    out: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="The new PDF; default: frame-100mm-a4.pdf or the like."),
    ] = None,
    as_json_object: JsonOption = False,
) -> None:
    """Write the frame to print, cut out and lay on a sample before it is photographed."""
    with one_sentence(as_json_object):
        marked = frame_of_size(size)
        path = out or Path(f"frame-{marked.side_mm}mm-{paper}.pdf")
        durable.write(path, pdf(marked, paper, white))
        if as_json_object:
            markers = [marked.ids[0], marked.ids[-1]]
            print(json.dumps({"path": str(path), "side_mm": marked.side_mm, "markers": markers}))
        else:
            print(f"Print {path} at 100 %, check its ruler, and cut out the inner square.")


def _infer_framed(
    images: list[Path],
    white: float,
    force: bool,
    plain_mm: int | None,
    out: Path | None,
    as_json_object: bool,
) -> None:
    console = Console(markup=False, highlight=False)
    with Progress(
        console=console, transient=True, disable=as_json_object or not console.is_terminal
    ) as progress:
        bar = progress.add_task("Looking at the photos", total=len(images) + 1)
        finished, verdicts = app.infer_framed(
            images, white, force, plain_mm, out, lambda _: progress.advance(bar)
        )
    if finished.count == 0:
        raise ImageError(verdicts[0].sentence if len(verdicts) == 1 else _none_used(verdicts))
    if as_json_object:
        photos = [dataclasses.asdict(v) | {"sentence": v.sentence} for v in verdicts]
        print(json.dumps(as_json(finished) | {"photos": photos}))
        return
    for verdict in verdicts:
        if verdict.faults:
            use = "used all the same" if verdict.used else "not used"
            print(f"{verdict.name} is {use}. {verdict.sentence}")
        elif verdict.warning:
            print(f"{verdict.name} is used. {verdict.warning}")
    print(f"{finished.count} of {len(verdicts)} photos are used.")
    show([finished], console)


def _none_used(verdicts: tuple[Verdict, ...]) -> str:
    names = "; ".join(f"{v.name}: {v.sentence}" for v in verdicts)
    return f"None of the {len(verdicts)} photos can be used. {names}"
