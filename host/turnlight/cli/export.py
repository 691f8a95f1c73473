"""Write maps for other programs."""

from pathlib import Path
from typing import Annotated

import typer
from pydantic import TypeAdapter

from turnlight.cli.options import JsonOption, one_sentence
from turnlight.export import export as exporting


def export(
    source: Annotated[Path, typer.Argument(metavar="SESSION", show_default=False)],
    kind: Annotated[exporting.Format, typer.Option("--format", help="What to write.")],
    out: Annotated[
        Path | None,
        typer.Option(
            metavar="PATH", help="A new file or folder; default: in the session's exports."
        ),
    ] = None,
    tileable: Annotated[bool, typer.Option("--tileable", help="Make the edges meet.")] = False,
    size: Annotated[
        int | None, typer.Option(metavar="N", help="Pixels along the longer side.")
    ] = None,
    height: Annotated[
        bool, typer.Option("--height", help="Add the height that the normals add up to.")
    ] = False,
    side_mm: Annotated[
        float | None, typer.Option(help="The sample's side, for maps that do not know it.")
    ] = None,
    as_json_object: JsonOption = False,
) -> None:
    """Write a session's maps, or a folder's, in the form that another program takes."""
    with one_sentence(as_json_object):
        options = exporting.Options(tileable, size, height, side_mm)
        done = exporting.export(source, kind, options, out)
        if as_json_object:
            print(TypeAdapter(exporting.Exported).dump_json(done).decode())
            return
        print(
            f"{done.path}, {done.bytes / 1e6:.1f} MB, {' x '.join(map(str, done.size_px))} pixels"
        )
        if done.size_mm is not None:
            print(f"It shows {done.size_mm[0]:.4g} x {done.size_mm[1]:.4g} mm.")
        if done.seam is not None:
            print(
                f"Its gradient is {done.seam.edge:.2f} of that inside where tiles meet, and "
                f"{done.seam.path:.2f} of that before where the sample was joined."
            )
