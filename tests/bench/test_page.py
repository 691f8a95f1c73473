"""What watching costs a run, and how soon the list of many sessions is there."""

import json
import os
import subprocess
import sys
import time
from pathlib import Path

import pytest
from web_service import Served, serving, small_material

from turnlight import app

pytestmark = [pytest.mark.bench, pytest.mark.timeout(900)]
PAGES, SHOTS, SESSIONS, ROUNDS = 20, 6, 2000, 3

WATCH = """
import json, sys, urllib.request
from concurrent.futures import ThreadPoolExecutor
from websockets.sync.client import connect
port, pages = sys.argv[1], int(sys.argv[2])
def get(path):
    with urllib.request.urlopen(f"http://127.0.0.1:{port}{path}") as reply:
        return reply.read()
def watch(_):
    with connect(f"ws://127.0.0.1:{port}/api/events") as line:
        print("watching", flush=True)
        for text in line:
            event = json.loads(text)
            if event["kind"] == "shot":
                name = json.loads(get("/api/run"))["session"]
                get(f"/api/sessions/{name}")
                get(f"/api/sessions/{name}/packed")
                for which in ("normal", "diffuse", "roughness", "specular"):
                    get(f"/api/sessions/{name}/maps/{which}.jpg")
with ThreadPoolExecutor(pages) as pool:
    list(pool.map(watch, range(pages)))
"""


def test_twenty_pages_slow_a_run_by_little(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Runs with and without the pages in turn; each page asks for what capture.js asks for."""
    monkeypatch.setattr(app, "simulated_material", small_material)
    with serving(tmp_path, shots=SHOTS, width_px=2028) as served:
        _run_s(served)
        alone_s, watched_s = [], []
        for _ in range(ROUNDS):
            alone_s.append(_run_s(served))
            command = [sys.executable, "-c", WATCH, str(served.port), str(PAGES)]
            pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.DEVNULL}
            with subprocess.Popen(command, **pipes) as pages:
                assert pages.stdout is not None
                for _ in range(PAGES):
                    pages.stdout.readline()
                watched_s.append(_run_s(served))
                pages.kill()
    ratio = min(watched_s) / min(alone_s)
    print(f"\n{SHOTS} shots: {min(alone_s):.1f} s; watched by {PAGES} pages: x {ratio:.3f}")
    if (os.cpu_count() or 1) > 4:
        assert ratio < 1.05


def test_the_list_of_many_sessions_is_there_at_once(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(app, "simulated_material", small_material)
    with serving(tmp_path, shots=1) as served:
        _run_s(served)
        (first,) = (p for p in served.root.iterdir() if p.name.startswith("sample"))
        manifest = json.loads((first / "session.json").read_text())
        for number in range(SESSIONS - 1):
            folder = served.root / f"copy-{number}"
            folder.mkdir()
            (folder / "session.json").write_text(
                json.dumps(manifest | {"sample": f"copy {number}"})
            )
        for name in ("first", "again"):
            began_s = time.monotonic()
            for path in ("/", "/app.js", "/api/sessions?limit=40"):
                served.get(path)
            took_s = time.monotonic() - began_s
            print(f"\n{SESSIONS} sessions, opened {name}: {took_s:.2f} s")
        assert served.get("/api/sessions")["total"] == SESSIONS
        assert took_s < 1


def _run_s(served: Served) -> float:
    began_s = time.monotonic()
    assert served.ask("POST", "/api/run")[0] == 202
    served.wait_for(lambda: served.get("/api/run")["now"]["state"] == "idle", 300)
    return time.monotonic() - began_s
