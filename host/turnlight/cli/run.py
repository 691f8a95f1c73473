"""Capture a sample, go on with it, and fit its maps to the photographs."""

import contextlib
import json
from collections.abc import Generator
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.progress import Progress

from turnlight import app
from turnlight.capture.events import Event, as_json
from turnlight.cli.options import JsonOption, OutOption, RigOption, one_sentence
from turnlight.config import RigConfig
from turnlight.progress import show

REFINED = 256
"""Side in pixels of maps that are refined unless another is asked for: the network's."""


def capture(
    rig: RigOption = app.DEFAULT_RIG,
    sample: Annotated[str | None, typer.Option(help="What the sample is called.")] = None,
    material: Annotated[
        Path | None, typer.Option(metavar="DIR", help="The simulated rig's sample: a map folder.")
    ] = None,
    thickness_mm: Annotated[
        float | None, typer.Option(min=0, max=50, help="Default: as the rig was measured with.")
    ] = None,
    preset: Annotated[
        str | None, typer.Option(metavar="NAME", help="One of the rig file's; default: the first.")
    ] = None,
    shots: Annotated[
        int | None, typer.Option(min=1, help="How many pictures; default: the preset's.")
    ] = None,
    out: OutOption = None,
    barcode: Annotated[str | None, typer.Option(help="The sample's barcode.")] = None,
    refined: Annotated[
        bool, typer.Option("--refine", help="Fit the maps to the photographs afterwards.")
    ] = False,
    as_json_lines: JsonOption = False,
) -> None:
    """Turn, light and photograph a sample; the maps get better with every picture."""
    with one_sentence(as_json_lines):
        config = RigConfig.load(rig)
        if thickness_mm is None:
            thickness_mm = config.sample.reference_thickness_mm
        name = sample or (material.resolve().name if material else "sample")
        chosen = config.preset_named(preset)
        if shots is not None:
            chosen = chosen.model_copy(update={"shots": shots})
        folder = out or app.default_folder(name)
        told = app.capture(
            config, app.Sample(name, thickness_mm, material, barcode), chosen, folder
        )
        _follow(told, as_json_lines)
        if refined:
            _refine(folder, True, REFINED, as_json_lines)


def resume(
    session: Annotated[Path, typer.Argument(metavar="SESSION", show_default=False)],
    retake: Annotated[
        list[int] | None,
        typer.Option(metavar="SHOT", help="Take this shot again; may be repeated."),
    ] = None,
    drop: Annotated[
        list[int] | None, typer.Option(metavar="SHOT", help="Leave this shot out of the maps.")
    ] = None,
    finish: Annotated[bool, typer.Option("--finish", help="Make do with what there is.")] = False,
    as_json_lines: JsonOption = False,
) -> None:
    """Go on with a capture that was interrupted: shots that are safe stay, missing ones are taken."""
    with one_sentence(as_json_lines):
        _follow(app.resume(session, retake or (), drop or (), finish), as_json_lines)


def refine(
    session: Annotated[Path, typer.Argument(metavar="SESSION", show_default=False)],
    resolution: Annotated[
        int, typer.Option(min=16, max=8192, help="Side of the maps in pixels.")
    ] = REFINED,
    no_prior: Annotated[
        bool, typer.Option("--no-prior", help="The classical optimisation, as a baseline.")
    ] = False,
    as_json_object: JsonOption = False,
) -> None:
    """Fit a session's maps to its photographs under the known lights."""
    with one_sentence(as_json_object):
        _refine(session, not no_prior, resolution, as_json_object)


def _follow(told: Generator[Event, None, None], as_json_lines: bool) -> None:
    with contextlib.closing(told):
        try:
            if as_json_lines:
                for event in told:
                    print(json.dumps(as_json(event)), flush=True)
            else:
                show(told, Console(markup=False, highlight=False))
        except KeyboardInterrupt as stop:
            told.throw(stop)  # Ctrl-C fell between two events


def _refine(session: Path, prior: bool, resolution: int, as_json_object: bool) -> None:
    console = Console(markup=False, highlight=False)
    hidden = as_json_object or not console.is_terminal
    with Progress(console=console, transient=True, disable=hidden) as progress:
        bar = progress.add_task("Refining", total=1.0)
        done = app.refine(session, prior, resolution, lambda s: progress.update(bar, completed=s))
    if as_json_object:
        print(json.dumps({"session": str(session)} | done.model_dump(mode="json")))
        return
    print(f"Refined maps, {resolution} x {resolution}, are in {session / 'maps'}")
    if done.relighting_error is not None:
        print(
            f"Each shot is predicted by the others to {100 * done.relighting_error:.1f} % of white."
        )
    if done.highlight_reachable is not None:
        print(
            f"This rig can catch the highlight of {100 * done.highlight_reachable:.0f} % of the sample."
        )
    for shot in done.bad_shots:
        print(
            f"Shot {shot} contradicts the others and was left out: see that its light was on, nothing "
            f"shaded it and it is sharp; at a rig, turnlight resume {session} --retake {shot}"
        )
