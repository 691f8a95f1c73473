"""Check the rig and its computer."""

import dataclasses
import json
import sys
import time
from pathlib import Path
from typing import Annotated

import typer

from turnlight import app
from turnlight.bundle import write_bundle
from turnlight.cli.options import SESSIONS, JsonOption, RigOption, SessionsOption, one_sentence
from turnlight.doctor import doctor as examine
from turnlight.rig import usb

RESET_S = 5.0
"""What a camera takes to be back after a reset."""


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
    with one_sentence(as_json_object):
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
