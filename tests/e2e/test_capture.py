"""A sample, through the native firmware's serial lines and the simulated camera's pixels, to maps."""

import hashlib
import json
import signal
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import cv2
import numpy as np
import pytest
from typer.testing import CliRunner

from svbrdf import materials, scores
from svbrdf.maps import Maps
from svbrdf.renderer import pixel_positions, render
from turnlight import app, cli
from turnlight.capture.events import ShotDone
from turnlight.capture.manifest import Manifest
from turnlight.capture.plan import Shot, plan
from turnlight.config import RigConfig
from turnlight.estimate.estimator import Estimator
from turnlight.frame import Exposure
from turnlight.picture.lighting import lighting
from turnlight.picture.picture import Picture
from turnlight.preset import Preset

MAPS = {"normal.png", "diffuse.png", "roughness.png", "specular.png"}
THICKNESS_MM = 2.0
THICK_MM = 12.0


def manifest_of(folder: Path) -> Manifest:
    return Manifest.model_validate_json((folder / "session.json").read_text())


def files_under(folder: Path) -> set[str]:
    return {str(p.relative_to(folder)) for p in folder.rglob("*") if p.is_file()}


def preset(shots: int) -> Preset:
    return Preset(shots=shots, exposure="fixed", enough_change=0)


def test_maps_are_on_disk_after_every_shot(small_rig: Path, tmp_path: Path) -> None:
    config = RigConfig.load(small_rig)
    folder = tmp_path / "session"
    seen: list[dict[str, bytes]] = []
    for event in app.capture(config, app.Sample("oak", THICKNESS_MM), preset(3), folder):
        if isinstance(event, ShotDone):
            assert (event.change is None) == (event.number == 1)
            assert (
                abs(event.record.measured_angle_deg - event.record.reported_angle_deg) % 360 < 0.1
            )
            assert event.record.warning is None
            assert event.record in manifest_of(folder).shots
            assert manifest_of(folder).finished is None
            seen.append({name: (folder / "maps" / name).read_bytes() for name in MAPS})
    assert len(seen) == 3
    assert seen[0] != seen[1] != seen[2]
    left = files_under(folder)
    history = {f"history/00{i}/maps/{name}" for i in (1, 2, 3) for name in (*MAPS, "preview.png")}
    assert left == history | {
        "session.json", "dark.png", "contact_sheet.png", "maps/preview.png",
        *(f"maps/{name}" for name in MAPS),
        *(f"shots/00{i}.{kind}" for i in range(3) for kind in ("png", "json")),
    }  # fmt: skip
    manifest = manifest_of(folder)
    assert manifest.finished is not None
    assert manifest.model_sha256 == app.model_sha256()
    for record in (*manifest.darks, *(shot.frame for shot in manifest.shots)):
        png = (folder / record.image).read_bytes()
        assert hashlib.sha256(png).hexdigest() == record.sha256
        assert cv2.imdecode(np.frombuffer(png, np.uint8), cv2.IMREAD_UNCHANGED).dtype == np.uint16


def test_the_command_speaks_json(small_rig: Path, tmp_path: Path) -> None:
    result = CliRunner().invoke(
        cli.commands,
        [
            "capture",
            "--rig",
            str(small_rig),
            "--shots",
            "2",
            "--out",
            str(tmp_path / "s"),
            "--json",
        ],
    )
    assert result.exit_code == 0, result.stderr
    events = [json.loads(line) for line in result.stdout.splitlines()]
    kinds = [event["kind"] for event in events]
    assert [k for k in kinds if k not in ("state", "step", "exposure", "enough", "table")] == [
        "snapshot", "started", "shot", "shot", "finished",
    ]  # fmt: skip
    shot = events[kinds.index("shot")]
    assert shot["number"] == 1
    assert shot["record"]["shot"]["leds"] == [6]
    assert Path(events[-1]["contact_sheet"]).exists()


def test_the_command_speaks_to_a_person(
    small_rig: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    result = CliRunner().invoke(
        cli.commands, ["capture", "--rig", str(small_rig), "--shots", "2", "--sample", "old oak"]
    )
    assert result.exit_code == 0, result.stderr
    assert "Shot 1/2  first maps" in result.stdout
    assert "Shot 2/2  maps changed" in result.stdout
    (folder,) = (tmp_path / "sessions").iterdir()
    assert folder.name.startswith("old-oak-2")
    assert (folder / "contact_sheet.png").exists()


def test_doctor_finds_nothing_wrong_with_the_simulated_rig(small_rig: Path) -> None:
    result = CliRunner().invoke(cli.commands, ["doctor", "--rig", str(small_rig)])
    assert result.exit_code == 0, result.stdout
    assert [line[:2] for line in result.stdout.splitlines()] == ["OK"] * 8


@pytest.mark.parametrize("kib", [100, 4000])
def test_a_full_disk_leaves_no_half_session(
    small_rig: Path, small_disk: Callable[[int], Path], kib: int
) -> None:
    folder = small_disk(kib) / "session"
    result = CliRunner().invoke(
        cli.commands, ["capture", "--rig", str(small_rig), "--shots", "3", "--out", str(folder)]
    )
    assert result.exit_code == 1
    assert result.stderr.count("\n") == 1
    assert "the disk is full; free some space" in result.stderr
    manifest = manifest_of(folder)
    assert manifest.finished is None
    whole = {record.frame.image for record in manifest.shots} | {d.image for d in manifest.darks}
    assert {name for name in files_under(folder) if name.endswith(".png")} <= whole | {
        f"maps/{name}" for name in MAPS | {"preview.png"}
    }
    for name in files_under(folder) - {"session.json"}:
        if name.endswith(".png"):
            assert cv2.imread(str(folder / name)) is not None


@pytest.mark.parametrize(("signal_sent", "code"), [(signal.SIGTERM, 143), (signal.SIGKILL, -9)])
def test_a_capture_that_is_killed_leaves_whole_shots(
    small_rig: Path, tmp_path: Path, signal_sent: int, code: int
) -> None:
    folder = tmp_path / "session"
    program = Path(sys.executable).with_name("turnlight")
    command = [program, "capture", "--rig", small_rig, "--shots", "10", "--out", folder]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        while not process.stdout.readline().startswith("Shot 2/"):
            assert process.poll() is None
        process.send_signal(signal_sent)
    assert process.returncode == code
    manifest = manifest_of(folder)
    assert manifest.finished is None
    assert 2 <= len(manifest.shots) < 10
    for record in manifest.shots:
        png = (folder / record.frame.image).read_bytes()
        assert hashlib.sha256(png).hexdigest() == record.frame.sha256


@pytest.mark.timeout(300)
def test_the_rig_costs_little_against_pictures_rendered_already_rectified(tmp_path: Path) -> None:
    reference = RigConfig.load(app.DEFAULT_RIG)
    third_size = reference.camera.model_copy(update={"width_px": 1352, "height_px": 1014})
    config = reference.model_copy(update={"camera": third_size})
    truth = materials.reduced(app.simulated_material(), 256, 256)
    folder = tmp_path / "session"
    list(app.capture(config, app.Sample("oak", THICK_MM), preset(10), folder))
    through_the_rig = materials.load(folder / "maps")
    estimator = Estimator()
    for shot in plan(config, 10, THICK_MM):
        rectified = estimator.add(rendered_rectified(config, truth, shot))
    cost = scores.score(rectified, truth).ssim - scores.score(through_the_rig, truth).ssim
    assert abs(cost) < 0.03
    assert scores.score(through_the_rig, rectified).ssim > 0.95


def rendered_rectified(config: RigConfig, truth: Maps, shot: Shot) -> Picture:
    """The shot as an ideal camera above every point would see it: no marker, no noise, no lens."""
    (led,) = shot.leds
    half_side_mm = config.sample.side_mm / 2
    lamp_mm = config.led_positions_mm(THICK_MM)[led]
    aim_mm = -config.lift_mm(THICK_MM)
    reference = np.linalg.norm(lamp_mm - aim_mm) / half_side_mm
    lamp = config.to_sample_frame(lamp_mm, shot.angle_deg).astype(np.float32)
    aim = config.to_sample_frame(aim_mm, shot.angle_deg)
    eye = config.to_sample_frame(config.camera_position_mm(THICK_MM), shot.angle_deg)
    away = pixel_positions(np, 256, 256, dtype=np.float32) - lamp
    distance = np.linalg.norm(away, axis=-1, keepdims=True)
    lobe = np.sum(away * (aim - lamp), axis=-1, keepdims=True) / distance / reference
    irradiance = np.pi * config.led_powers()[led] * lobe * (reference / distance) ** 2
    image = render(truth, lamp, eye.astype(np.float32), irradiance.astype(np.float32))
    image = np.clip(image, 0, 1).astype(np.float32)
    everywhere = np.ones((256, 256), dtype=bool)
    known = lighting(config, shot.leds, shot.angle_deg, Exposure(10_000, 1.0), THICK_MM, 256)
    return Picture(image, 1.0, everywhere, ~everywhere, known)
