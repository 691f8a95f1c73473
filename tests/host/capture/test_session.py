"""The session's folder: what it holds, in which order it appears, and what a crash leaves."""

import hashlib
import os
from collections.abc import Callable
from datetime import UTC, datetime
from pathlib import Path

import cv2
import numpy as np
import pytest

from svbrdf.maps import flat
from turnlight.capture.manifest import Manifest
from turnlight.capture.plan import Shot
from turnlight.capture.session import Session
from turnlight.config import RigConfig
from turnlight.errors import SessionError
from turnlight.frame import Exposure, Frame

REPOSITORY = Path(__file__).parents[3]
SHOTS = tuple(Shot(i, 15.0 * i, (6,), 10_000, 1.0) for i in range(2))


def manifest() -> Manifest:
    return Manifest(
        sample="oak",
        thickness_mm=2.0,
        started=datetime(2026, 11, 22, tzinfo=UTC),
        versions={"turnlight": "0.1.0"},
        model_sha256={"model.json": "00"},
        config=RigConfig.load(REPOSITORY / "rig_config/simulated.toml"),
        plan=SHOTS,
    )


def frame(seed: int = 0) -> Frame:
    bits = np.random.default_rng(seed).integers(0, 4096, (30, 40, 3), dtype=np.uint16)
    return Frame(bits, 12, 2.2, Exposure(10_000, 1.0), 123)


def manifest_on_disk(folder: Path) -> Manifest:
    return Manifest.model_validate_json((folder / "session.json").read_text())


def test_a_whole_session(tmp_path: Path) -> None:
    session = Session(tmp_path / "oak", manifest())
    session.save_dark(frame(9))
    for shot in SHOTS:
        record = session.save_shot(shot, frame(shot.index), shot.angle_deg + 0.01)
        session.save_record(record.model_copy(update={"measured_angle_deg": shot.angle_deg}))
        session.save_maps(flat(8, 8), np.zeros((8, 8, 3), np.uint8))
    session.finish()
    names = {str(p.relative_to(session.folder)) for p in session.folder.rglob("*") if p.is_file()}
    assert names == {
        "session.json",
        "dark.png",
        "shots/000.png", "shots/000.json", "shots/001.png", "shots/001.json",
        "maps/normal.png", "maps/diffuse.png", "maps/roughness.png", "maps/specular.png",
        "maps/preview.png",
    }  # fmt: skip
    written = manifest_on_disk(session.folder)
    assert written == session.manifest
    assert written.finished is not None
    assert [r.measured_angle_deg for r in written.shots] == [0.0, 15.0]
    for record in written.shots:
        png = (session.folder / record.frame.image).read_bytes()
        assert hashlib.sha256(png).hexdigest() == record.frame.sha256
        bits = cv2.imdecode(np.frombuffer(png, np.uint8), cv2.IMREAD_UNCHANGED)[..., ::-1]
        assert np.array_equal(bits, frame(record.shot.index).pixels)


def test_a_second_exposure_has_a_dark_of_its_own(tmp_path: Path) -> None:
    session = Session(tmp_path, manifest())
    session.save_dark(frame())
    session.save_dark(frame())
    assert [d.image for d in session.manifest.darks] == ["dark.png", "dark-2.png"]


@pytest.mark.parametrize("steps_before_the_crash", range(7))
def test_a_crash_leaves_only_whole_shots(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, steps_before_the_crash: int
) -> None:
    """The process dies at any synced step of a shot; the manifest names whole files."""

    class Crash(BaseException):
        pass

    session = Session(tmp_path, manifest())
    session.save_shot(SHOTS[0], frame(), 0.0)
    steps = iter(range(steps_before_the_crash))
    sync = os.fsync

    def sync_or_crash(descriptor: int) -> None:
        if next(steps, None) is None:
            raise Crash
        sync(descriptor)

    with monkeypatch.context() as patched:
        patched.setattr(os, "fsync", sync_or_crash)
        try:
            session.save_shot(SHOTS[1], frame(1), 15.0)
        except Crash:
            assert steps_before_the_crash < 6
    assert not list(tmp_path.rglob("*.partial"))
    for record in manifest_on_disk(tmp_path).shots:
        png = (tmp_path / record.frame.image).read_bytes()
        assert hashlib.sha256(png).hexdigest() == record.frame.sha256
        assert (tmp_path / record.frame.image).with_suffix(".json").exists()


def test_a_disk_that_fills_up(small_disk: Callable[[int], Path]) -> None:
    session = Session(small_disk(64) / "oak", manifest())
    session.save_shot(SHOTS[0], frame(), 0.0)
    big = np.random.default_rng(0).integers(0, 4096, (300, 400, 3), dtype=np.uint16)
    with pytest.raises(SessionError, match=r"001\.png: the disk is full; free some space"):
        session.save_shot(SHOTS[1], Frame(big, 12, 2.2, Exposure(10_000, 1.0), 5), 0.0)
    assert {p.name for p in (session.folder / "shots").iterdir()} == {"000.png", "000.json"}
    assert len(manifest_on_disk(session.folder).shots) == 1


def saved_session(folder: Path) -> Session:
    session = Session(folder, manifest())
    session.save_dark(frame(9))
    for shot in reversed(SHOTS):
        session.save_shot(shot, frame(shot.index), shot.angle_deg)
    return session


def test_a_session_is_read_back_as_it_was_saved(tmp_path: Path) -> None:
    written = saved_session(tmp_path / "oak")
    session = Session.open(tmp_path / "oak")
    assert session.manifest == written.manifest
    shots = list(session.saved())
    assert [s.record.shot for s in shots] == list(SHOTS)
    dark = session.dark_record(Exposure(10_000, 1.0))
    assert dark is not None
    assert np.array_equal(session.dark_frame(dark).pixels, frame(9).pixels)
    assert session.dark_record(Exposure(5_000, 1.0)) is None
    for shot in shots:
        assert np.array_equal(shot.frame.pixels, frame(shot.record.shot.index).pixels)
        assert shot.frame.exposure == Exposure(10_000, 1.0)


def test_a_shot_taken_again_replaces_the_one_before(tmp_path: Path) -> None:
    session = saved_session(tmp_path / "oak")
    for seed in (5, 6):
        session.save_shot(SHOTS[1], frame(seed), 15.0, short=frame(seed + 10))
    last = list(Session.open(tmp_path / "oak").saved())[-1]
    assert last.short is not None
    assert np.array_equal(last.frame.pixels, frame(6).pixels)
    assert np.array_equal(last.short.pixels, frame(16).pixels)
    assert len(list((tmp_path / "oak/shots").glob("001*.png"))) == 2


def test_what_is_not_a_sound_session_is_named(tmp_path: Path) -> None:
    with pytest.raises(SessionError, match="is not a session"):
        Session.open(tmp_path)
    session = saved_session(tmp_path / "oak")
    (session.folder / "shots/000.png").write_bytes(b"else")
    with pytest.raises(SessionError, match=r"000\.png is not the file that was saved"):
        list(session.saved())
    (session.folder / "shots/000.png").unlink()
    with pytest.raises(SessionError, match="cannot be read"):
        list(session.saved())
    path = session.folder / "session.json"
    path.write_text(path.read_text().replace('"format": 1', '"format": 9'))
    with pytest.raises(SessionError, match="has format 9"):
        Session.open(session.folder)
    path.write_text("{}")
    with pytest.raises(SessionError, match="is damaged"):
        Session.open(session.folder)
