"""The calibration by REST and event stream: a step at a time, told while it lasts, and used from then on."""

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from web_service import Served, serving, small_material
from websockets.sync.client import ClientConnection, connect

from turnlight import app
from turnlight.calibration import load_calibration

AT_HAND = {"square_mm": 12, "ball_mm": 30, "white_reflectance": 0.95, "thickness_mm": 2}
FEW_PX = 507
"""Too few for the geometry to be known as well as it has to be."""


@pytest.fixture
def bench(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Served]:
    monkeypatch.setattr(app, "simulated_material", small_material)
    with serving(tmp_path, width_px=FEW_PX) as service:
        yield service


def step(served: Served, name: str) -> dict[str, Any]:
    return next(s for s in served.get("/api/calibration")["steps"] if s["name"] == name)


def done(served: Served, name: str) -> dict[str, Any]:
    served.wait_for(lambda: step(served, name)["state"] in ("passed", "failed"), 100)
    return step(served, name)


def _calibration(line: ClientConnection) -> dict[str, Any]:
    """The next that is told of it."""
    while True:
        told: dict[str, Any] = json.loads(line.recv(timeout=60))
        if told["kind"] == "calibration":
            return told


def test_a_step_that_passes_is_told_and_used(bench: Served) -> None:
    assert bench.get("/api/rig")["calibrated"] is False
    assert step(bench, "dark")["instruction"].startswith("Take everything off")
    assert bench.ask("GET", "/api/calibration/picture.jpg")[0] == 404
    with connect(f"ws://127.0.0.1:{bench.port}/api/events") as line:
        assert json.loads(line.recv())["kind"] == "snapshot"
        assert _calibration(line)["running"] is None
        assert bench.ask("POST", "/api/calibration/dark", AT_HAND)[0] == 202
        heard = [_calibration(line)]
        while heard[-1]["running"]:
            heard.append(_calibration(line))
    assert heard[0]["running"] == "dark"
    assert heard[-1]["steps"][0]["state"] == "passed"
    dark = step(bench, "dark")
    assert all(limit["passed"] for limit in dark["limits"])
    assert "without light" in dark["text"]
    assert dark["measured"]
    assert bench.get("/api/calibration/picture.jpg")[:3] == b"\xff\xd8\xff"
    assert bench.get("/api/rig")["calibrated"] is True
    assert list(load_calibration(bench.root.parent / "small.calibration.toml").measured) == ["dark"]
    assert bench.ask("POST", "/api/run")[0] == 202
    bench.wait_for(lambda: bench.get("/api/run")["now"]["state"] == "idle")
    (session,) = bench.get("/api/sessions")["sessions"]
    manifest = json.loads((bench.root / session["name"] / "session.json").read_text())
    assert list(manifest["config"]["calibration"]["measured"]) == ["dark"]


def test_a_step_that_fails_says_what_and_changes_nothing(bench: Served) -> None:
    bench.ask("POST", "/api/calibration/dark", AT_HAND)
    done(bench, "dark")
    file = bench.root.parent / "small.calibration.toml"
    before = file.read_bytes()
    bench.ask("POST", "/api/calibration/geometry", AT_HAND)
    failed = done(bench, "geometry")
    assert failed["state"] == "failed"
    assert "did not pass" in failed["text"]
    assert not all(limit["passed"] for limit in failed["limits"])
    assert file.read_bytes() == before
    assert step(bench, "dark")["state"] == "passed"


def test_one_thing_at_a_time_and_it_can_be_stopped(bench: Served) -> None:
    assert bench.ask("POST", "/api/calibration/stop")[0] == 409
    assert bench.ask("POST", "/api/calibration/lights", AT_HAND)[0] == 202
    bench.wait_for(lambda: step(bench, "lights")["number"] > 0, 100)
    status, refused, _ = bench.ask("POST", "/api/run")
    assert (status, "calibrated" in refused["detail"]) == (409, True)
    assert bench.ask("POST", "/api/calibration/dark", AT_HAND)[0] == 409
    assert bench.ask("POST", "/api/calibration/stop")[0] == 202
    stopped = done(bench, "lights")
    assert (stopped["state"], stopped["text"]) == ("failed", "Stopped; nothing has changed.")
    assert not list(bench.root.parent.glob("*.calibration.toml"))
    assert bench.ask("POST", "/api/run")[0] == 202
    status, refused, _ = bench.ask("POST", "/api/calibration/dark", AT_HAND)
    assert (status, refused["detail"]) == (409, "A run is on; finish it first.")
    bench.wait_for(lambda: bench.get("/api/run")["now"]["state"] == "idle")


def test_nonsense_is_refused_and_targets_can_be_printed(served: Served) -> None:
    for path, body in (
        ("lense", AT_HAND),
        ("dark", AT_HAND | {"ball_mm": -1}),
        ("dark", AT_HAND | {"cube_mm": 1}),
        ("dark", {"square_mm": "wide"}),
    ):
        assert served.ask("POST", f"/api/calibration/{path}", body)[0] == 422, (path, body)
    assert served.get("/api/calibration/targets/ball.pdf")[:4] == b"%PDF"
    assert served.ask("GET", "/api/calibration/targets/secret.pdf")[0] == 422
