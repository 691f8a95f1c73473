"""The commands, thin: each asks app or doctor and shows the answer to a person or a script."""

import contextlib
import dataclasses
import json
import signal
import sys
import time
from collections.abc import Generator, Iterator
from datetime import datetime
from pathlib import Path
from typing import Annotated, NoReturn

import typer
from pydantic import TypeAdapter
from rich.console import Console
from rich.progress import Progress, track
from rich.table import Table

from svbrdf.materials import MaterialError
from turnlight import app, calibrating, calibration_report
from turnlight.bundle import write_bundle
from turnlight.calibrate.calibrate import ALL_STEPS
from turnlight.calibrate.targets import Targets
from turnlight.capture import plan as planning
from turnlight.capture.events import Event, as_json
from turnlight.catalogue import Catalogue
from turnlight.config import RigConfig
from turnlight.doctor import doctor as examine
from turnlight.errors import CalibrationError, ImageError, TurnlightError
from turnlight.export import export as exporting
from turnlight.flash import flash as write_firmware
from turnlight.progress import show
from turnlight.rig import usb
from turnlight.rig.controller import PARAMETERS
from turnlight.service import Service, default_user, install
from turnlight.web.server import PORT, Address
from turnlight.web.server import serve as serve_page

RigOption = Annotated[
    Path, typer.Option("--rig", metavar="FILE", help="The rig's TOML file.", show_default=False)
]
ShotsOption = Annotated[int, typer.Option("--shots", min=1, help="How many pictures.")]
REFINED = 256
"""Side in pixels of maps that are refined unless another is asked for: the network's."""

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
JsonOption = Annotated[bool, typer.Option("--json", help="Answer in JSON, for scripts.")]

SESSIONS = Path("sessions")
RESET_S = 5.0
"""What a camera takes to be back after a reset."""

commands = typer.Typer(
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
    help="Material maps (normal, diffuse, roughness, specular) from pictures of a flat sample.",
)


firmware = typer.Typer(no_args_is_help=True, help="The controller's firmware.")
commands.add_typer(firmware, name="firmware")


def main() -> None:
    """The `turnlight` program."""
    signal.signal(signal.SIGTERM, _end)
    commands()


@commands.command()
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
    with _one_sentence(as_json_lines):
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


@commands.command()
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
    with _one_sentence(as_json_lines):
        _follow(app.resume(session, retake or (), drop or (), finish), as_json_lines)


@commands.command()
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
    """Fit a session's maps to its photographs under the rig's known lights."""
    with _one_sentence(as_json_object):
        _refine(session, not no_prior, resolution, as_json_object)


@commands.command()
def infer(
    images: Annotated[list[Path], typer.Argument(metavar="IMAGE...", show_default=False)],
    aligned: Annotated[
        bool, typer.Option("--aligned", help="The pictures are rectified and square.")
    ] = False,
    out: OutOption = None,
    as_json_object: JsonOption = False,
) -> None:
    """Make maps from photographs, in any order."""
    with _one_sentence(as_json_object):
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


@commands.command()
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
    with _one_sentence(as_json_object):
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


@commands.command()
def plan(
    rig: RigOption = app.DEFAULT_RIG,
    shots: ShotsOption = 10,
    as_json_object: JsonOption = False,
) -> None:
    """Show the shots that a capture would take."""
    with _one_sentence(as_json_object):
        config = RigConfig.load(rig)
        planned = planning.plan(config, shots, config.sample.reference_thickness_mm)
        turn_deg = planning.total_turn_deg(shot.angle_deg for shot in planned)
        minutes = planning.expected_s(planned) / 60
        if as_json_object:
            rows = [dataclasses.asdict(shot) for shot in planned]
            print(json.dumps({"shots": rows, "total_turn_deg": turn_deg, "minutes": minutes}))
            return
        table = Table("Shot", "Angle", "LEDs", "Exposure", box=None)
        for shot in planned:
            table.add_row(
                str(shot.index + 1),
                f"{shot.angle_deg:5.1f}°",
                ", ".join(map(str, shot.leds)),
                f"{shot.exposure_us / 1000:g} ms",
            )
        Console(markup=False, highlight=False).print(table)
        print(f"The table turns {turn_deg:.0f}° in all; about {minutes:.1f} minutes.")


@commands.command()
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
    with _one_sentence(as_json_lines):
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


@commands.command()
def doctor(
    rig: RigOption = app.DEFAULT_RIG,
    reset_camera: Annotated[
        bool, typer.Option("--reset-camera", help="First do what unplugging the camera would.")
    ] = False,
    bundle: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Write what support needs into this zip file."),
    ] = None,
    root: SessionsOption = SESSIONS,
    pictures: Annotated[
        bool, typer.Option("--pictures", help="Pictures of samples go into the zip file too.")
    ] = False,
    as_json_object: JsonOption = False,
) -> None:
    """Check everything that a capture needs."""
    checks = []
    with _one_sentence(as_json_object):
        if reset_camera:
            for camera in usb.reset_cameras():
                print(f"Reset the {camera}.", file=sys.stderr)
            time.sleep(RESET_S)
        for check in examine(rig):
            checks.append(check)
            if not as_json_object:
                print(
                    f"{'OK  ' if check.ok else 'FAIL'}  {check.name:<11}  {check.text}", flush=True
                )
        if bundle is not None:
            names = write_bundle(bundle, checks, rig, root, pictures)
            print(f"{bundle} has {len(names)} files for support.", file=sys.stderr)
    ok = all(check.ok for check in checks)
    if as_json_object:
        print(json.dumps({"ok": ok, "checks": [dataclasses.asdict(check) for check in checks]}))
    if not ok:
        raise typer.Exit(1)


@commands.command()
def serve(
    rig: RigOption = app.DEFAULT_RIG,
    out: SessionsOption = SESSIONS,
    host: Annotated[
        str, typer.Option(help="Address to serve at; 0.0.0.0 is the whole network.")
    ] = "127.0.0.1",
    port: Annotated[int, typer.Option(min=0, max=65535, help="0: any free one.")] = PORT,
    token_file: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE", help="What a page must show; made if not there; needed on a network."
        ),
    ] = None,
    name: Annotated[
        list[str] | None,
        typer.Option(help="A host name that this computer is called by; may be repeated."),
    ] = None,
    material: Annotated[
        Path | None, typer.Option(metavar="DIR", help="The simulated rig's sample: a map folder.")
    ] = None,
    as_json_lines: JsonOption = False,
) -> None:
    """Own the rig: its page, and the button on it, which captures a sample. The service runs this."""
    with _one_sentence(as_json_lines):
        address = Address(host, port, token_file, tuple(name or ()))

        def tell(sentence: str) -> None:
            print(json.dumps({"status": sentence}) if as_json_lines else sentence, flush=True)

        serve_page(RigConfig.load(rig), out, address, material, tell)


@firmware.command("flash")
def flash(
    rig: RigOption = app.DEFAULT_RIG,
    board: Annotated[
        str | None,
        typer.Option(help="atmega2560 or atmega328p, for a board that does not answer yet."),
    ] = None,
    as_json_object: JsonOption = False,
) -> None:
    """Write the firmware to the rig's controller, and have it confirm what it runs."""
    with _one_sentence(as_json_object):
        quiet = as_json_object or not sys.stderr.isatty()
        image = write_firmware(RigConfig.load(rig), board, quiet=quiet)
        if as_json_object:
            print(json.dumps(dataclasses.asdict(image) | {"path": str(image.path)}))
        else:
            print(f"The controller runs {image}.")


@firmware.command("parameters")
def parameters(
    setting: Annotated[
        tuple[str, int] | None,
        typer.Option("--set", metavar="NAME VALUE", help="Set one; the controller keeps it."),
    ] = None,
    rig: RigOption = app.DEFAULT_RIG,
    as_json_object: JsonOption = False,
) -> None:
    """What the controller knows of this rig: motor, gears, speeds, LEDs. PROTOCOL.md explains them."""
    with _one_sentence(as_json_object), app.connect(RigConfig.load(rig)) as connection:
        controller = connection.controller
        if setting is not None:
            known = [controller.set_parameter(*setting)]
        else:
            known = [controller.parameter(name) for name in PARAMETERS]
        if as_json_object:
            print(json.dumps([dataclasses.asdict(parameter) for parameter in known]))
        else:
            print(*known, sep="\n")


@commands.command("install-service")
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
    with _one_sentence(as_json_object):
        service = None if rules_only else Service(rig, out, user or default_user())
        written = [str(path) for path in install(service, root)]
        if as_json_object:
            print(json.dumps({"written": written}))
        else:
            print(*(f"Wrote {path}" for path in written), sep="\n")


@commands.command()
def sessions(
    words: Annotated[list[str] | None, typer.Argument(metavar="WORD", show_default=False)] = None,
    root: SessionsOption = SESSIONS,
    barcode: Annotated[str | None, typer.Option(help="Only samples with this barcode.")] = None,
    since: DayOption = None,
    until: DayOption = None,
    as_json_object: JsonOption = False,
) -> None:
    """List the sessions, newest first; only those whose names have every WORD in them."""
    with _one_sentence(as_json_object), Catalogue(root) as catalogue:
        found = catalogue.search(
            " ".join(words or ()), barcode, since and since.date(), until and until.date()
        )
        if as_json_object:
            rows = [dataclasses.asdict(e) | {"folder": e.folder, "state": e.state} for e in found]
            print(TypeAdapter(dict[str, object]).dump_json({"sessions": rows}).decode())
            return
        table = Table("Started", "Sample", "Barcode", "State", box=None)
        table.add_column("Folder", overflow="fold")
        for entry in found:
            started = f"{entry.started.astimezone():%Y-%m-%d %H:%M}"
            table.add_row(
                started, entry.sample, entry.barcode or "", entry.state, entry.folder.name
            )
        Console(markup=False, highlight=False).print(table)


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


def _wait_for_operator() -> None:
    input("Press Enter when it is there. ")


def _go_on() -> None:
    """The simulated rig has put its target on the table."""


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
            f"Shot {shot} contradicts the others and was left out: see that its LED lit, nothing "
            f"shaded it and it is sharp; take it again with: turnlight resume {session} --retake {shot}"
        )


@contextlib.contextmanager
def _one_sentence(as_json_object: bool) -> Iterator[None]:
    """Every error a user can meet, as its one sentence and exit code 1."""
    try:
        yield
    except (TurnlightError, MaterialError) as error:
        if as_json_object:
            print(json.dumps({"error": str(error)}))
        else:
            print(error, file=sys.stderr)
        raise typer.Exit(1) from error


def _end(number: int, _frame: object) -> NoReturn:
    """Ends as any other way does, so that the LEDs go off."""
    sys.exit(128 + number)
