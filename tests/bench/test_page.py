"""What watching costs a run, and how soon the list of many sessions is there."""

import json
import statistics
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from browser.conftest import browser  # noqa: F401
from web_service import Served, serving, small_material

from turnlight import app
from turnlight.capture.state import State
from turnlight.catalogue import INDEX
from turnlight.frame import Exposure, Frame
from turnlight.simulation.board import BoardState, SimulatedBoard
from turnlight.simulation.camera import SimulatedCamera

pytestmark = [pytest.mark.bench, pytest.mark.timeout(900)]
PAGES, SHOTS, SESSIONS, STARTS, ROUNDS = 20, 6, 2000, 3, 11
DELIVERED_MS = 200.0
"""Three frames at 15 a second."""

WATCH = r"""
import http.client, json, sys
from concurrent.futures import ThreadPoolExecutor
from websockets.sync.client import connect
port, pages = sys.argv[1], int(sys.argv[2])
def watch(_):
    asks = http.client.HTTPConnection("127.0.0.1", port) # kept, as a browser keeps it
    def get(path):
        try:
            asks.request("GET", path)
            return asks.getresponse().read()
        except http.client.RemoteDisconnected: # it has been idle for long
            asks.close()
            return get(path)
    with connect(f"ws://127.0.0.1:{port}/api/events", compression=None) as line:
        print("watching\n", end="", flush=True)
        name = None
        for text in line:
            event = json.loads(text)
            if event["kind"] == "started":
                name = event["folder"].rpartition("/")[2]
            if event["kind"] in ("started", "shot"):
                get(f"/api/sessions/{name}")
            if event["kind"] == "shot":
                get(f"/api/sessions/{name}/packed")
                print("seen\n", end="", flush=True)
with ThreadPoolExecutor(pages) as pool:
    list(pool.map(watch, range(pages)))
"""


@pytest.fixture
def real_time(monkeypatch: pytest.MonkeyPatch) -> None:
    """The simulated table and LEDs take as long as real ones, as a run that is watched has them."""
    advance = SimulatedBoard.advance

    def wait(board: SimulatedBoard, ms: float) -> BoardState:
        time.sleep(ms / 1000)
        return advance(board, ms)

    monkeypatch.setattr(SimulatedBoard, "advance", wait)


@pytest.fixture
def frames_at_hand(monkeypatch: pytest.MonkeyPatch) -> None:
    """The camera renders a frame the first time it is taken, since rendering is what no rig's computer
    does, and delivers it as late as a camera that streams: what it is told lands some frames after."""
    capture = SimulatedCamera.capture
    taken: dict[tuple[int, tuple[int, ...], Exposure], Frame] = {}

    def again(camera: SimulatedCamera, exposure: Exposure) -> Frame:
        state = camera._board.state()
        key = round(state.angle_deg), state.leds, exposure
        if key not in taken:
            taken[key] = capture(camera, exposure)
        camera._board.advance(exposure.exposure_us / 1000 + DELIVERED_MS)
        return replace(taken[key], started_us=state.time_us)

    monkeypatch.setattr(SimulatedCamera, "capture", again)


@pytest.mark.usefixtures("real_time", "frames_at_hand")
def test_twenty_pages_slow_a_run_by_little(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Runs with and without the pages in turn; each page asks for what capture.js asks for. The pages are
    on other computers: here they get what time is left. Each run is compared with the one before it, as
    this computer's speed drifts, and the middle of many is told, as it jumps too."""
    monkeypatch.setattr(app, "simulated_material", small_material)
    with serving(tmp_path, shots=SHOTS, width_px=4056) as served:
        _run_s(served)
        alone_s, watched_s = [], []
        for _ in range(ROUNDS):
            alone_s.append(_run_s(served))
            command = [
                "nice",
                "-n",
                "19",
                sys.executable,
                "-c",
                WATCH,
                str(served.port),
                str(PAGES),
            ]
            pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.DEVNULL}
            with subprocess.Popen(command, **pipes) as pages:
                assert pages.stdout is not None
                for _ in range(PAGES):
                    pages.stdout.readline()
                watched_s.append(_run_s(served))
                seen = sum(pages.stdout.readline() == b"seen\n" for _ in range(PAGES * SHOTS))
                pages.kill()
            assert seen == PAGES * SHOTS
    ratio = statistics.median(w / a for w, a in zip(watched_s, alone_s, strict=True))
    alone = f"{statistics.median(alone_s):.1f} s ({min(alone_s):.1f} to {max(alone_s):.1f})"
    print(f"\n{SHOTS} shots: {alone}; watched by {PAGES} pages: x {ratio:.3f}")
    assert ratio < 1.05


def test_the_page_with_many_sessions_is_there_at_once(
    browser: Any,  # noqa: F811
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """From asking for the page to the first session on it: while the service, just started, reads them all
    for the first time, and again. The quicker of several starts, as others may use this computer."""
    monkeypatch.setattr(app, "simulated_material", small_material)
    with serving(tmp_path, shots=10) as served:
        _run_s(served)
        (first,) = (p for p in served.root.iterdir() if p.name.startswith("sample"))
        manifest = json.loads((first / "session.json").read_text())
        for number in range(SESSIONS - 1):
            folder = served.root / f"copy-{number}"
            folder.mkdir()
            (folder / "session.json").write_text(
                json.dumps(manifest | {"sample": f"copy {number}"})
            )
    took_s: dict[str, list[float]] = {"first": [], "again": []}
    for _ in range(STARTS):
        for index in served.root.glob(f"{INDEX}*"):
            index.unlink()
        with serving(tmp_path) as served:
            for times_s in took_s.values():
                page = browser.new_page()
                began_s = time.monotonic()
                page.goto(f"{served.address}/#/sessions")
                page.wait_for_selector(".sessions li")
                times_s.append(time.monotonic() - began_s)
                page.wait_for_selector(f"text={SESSIONS} sessions")
                page.close()
    for name, times_s in took_s.items():
        print(f"\n{SESSIONS} sessions, opened {name}: {', '.join(f'{s:.2f}' for s in times_s)} s")
        assert min(times_s) < 1


def _run_s(served: Served) -> float:
    began_s = time.monotonic()
    assert served.ask("POST", "/api/run")[0] == 202
    served.wait_for(lambda: served.desk.engine.current.state == State.IDLE, 300)
    return time.monotonic() - began_s
