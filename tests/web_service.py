"""The web service as tests run it: in this process, on a free port, with a small simulated rig."""

import asyncio
import contextlib
import http.client
import json
import re
import socket
import threading
import time
from collections.abc import Callable, Coroutine, Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, TypeVar

import cv2
import numpy as np
import pytest
import uvicorn

from svbrdf import procedural
from turnlight import app
from turnlight.frame import Exposure, Frame
from turnlight.handheld.folder import HandheldFolder
from turnlight.handheld.record import FrameRecord, HandheldManifest, PhotoRecord
from turnlight.handheld.verdict import Fault, Problem
from turnlight.simulation.camera import SimulatedCamera
from turnlight.web import server
from turnlight.web.api import build
from turnlight.web.desk import Desk
from turnlight.web.door import Door

T = TypeVar("T")
REPOSITORY = Path(__file__).parents[1]
PRESETS = """
[preset.fast]
title = "For tests"
shots = {shots}
exposure = "fixed"
enough_change = 0.0

[preset.other]
shots = 2
exposure = "fixed"
"""


@dataclass(frozen=True)
class Served:
    """A running service."""

    desk: Desk
    port: int
    root: Path

    @property
    def address(self) -> str:
        return f"http://127.0.0.1:{self.port}"

    def ask(
        self,
        method: str,
        path: str,
        body: Any = None,
        headers: dict[str, str] | None = None,
    ) -> tuple[int, Any, dict[str, str]]:
        """Status, body (JSON read, or bytes), and headers."""
        line = http.client.HTTPConnection("127.0.0.1", self.port, timeout=60)
        with contextlib.closing(line):
            content = None if body is None else json.dumps(body).encode()
            sent = {"content-type": "application/json"} if body is not None else {}
            line.request(method, path, content, sent | (headers or {}))
            reply = line.getresponse()
            data = reply.read()
            told = {k.lower(): v for k, v in reply.getheaders()}
            if "json" in told.get("content-type", ""):
                return reply.status, json.loads(data), told
            return reply.status, data, told

    def get(self, path: str) -> Any:
        status, body, _ = self.ask("GET", path)
        assert status == 200, body
        return body

    def wait_for(self, holds: Callable[[], bool], timeout_s: float = 60) -> None:
        until_s = time.monotonic() + timeout_s
        while not holds():
            assert time.monotonic() < until_s, self.desk.engine.current
            time.sleep(0.02)


@contextlib.contextmanager
def serving(
    folder: Path, door: Door | None = None, shots: int = 3, width_px: int = 1014, port: int = 0
) -> Iterator[Served]:
    """A service whose rig file, sessions and material lie in `folder`."""
    root = folder / "sessions"
    with (
        Desk(rig_file(folder, shots, width_px), root) as desk,
        socket.create_server(("127.0.0.1", port)) as listening,
    ):
        api = build(desk, door or Door())
        running = uvicorn.Server(server.options(api))
        thread = threading.Thread(target=running.run, kwargs={"sockets": [listening]})
        thread.start()
        try:
            yield Served(desk, listening.getsockname()[1], desk.root)
        finally:
            running.should_exit = True
            thread.join()


def in_a_loop(work: Coroutine[Any, Any, T]) -> T:
    """What the coroutine returns; in another thread, as the browser's tests leave a loop in this one."""
    with ThreadPoolExecutor(1) as pool:
        return pool.submit(asyncio.run, work).result()


class Shutter:
    """The simulated camera's. A test holds it, so that a run waits where the test has something to do,
    however fast or busy the computer is."""

    def __init__(self, patch: pytest.MonkeyPatch) -> None:
        self.holds: Callable[[], bool] = lambda: False
        capture = SimulatedCamera.capture

        def patient(camera: SimulatedCamera, exposure: Exposure) -> Frame:
            while self.holds():
                time.sleep(0.01)
            return capture(camera, exposure)

        patch.setattr(SimulatedCamera, "capture", patient)

    def hold(self, holds: Callable[[], bool] = lambda: True) -> None:
        """Take no picture while this is so."""
        self.holds = holds

    def release(self) -> None:
        self.hold(lambda: False)


def small_material() -> Any:
    """In place of app.simulated_material, which takes seconds."""
    return procedural.material(app.SIMULATED_SEED, 256)


def photographed_by_hand(path: Path) -> None:
    """A handheld session with maps, of two photos, of which the second is not used."""
    frame = FrameRecord(side_mm=100, blur=0.0, blur_px=0.0, corners_px={})
    blurred = Fault(Problem.BLURRED, "It is blurred; hold the phone still.")
    photos = tuple(
        PhotoRecord(
            number=number, name=f"IMG_{number}.png", file=f"photos/{number:03d}.png",
            sha256=str(number), device=None, taken=None, width_px=400, height_px=300,
            focal_px=None, frame=frame, faults=faults,
        )
        for number, faults in ((1, ()), (2, (blurred,)))
    )  # fmt: skip
    manifest = HandheldManifest(
        sample="Oak by hand", started=datetime.now(UTC), finished=datetime.now(UTC),
        versions={}, model_sha256={}, photos=photos,
    )  # fmt: skip
    folder = HandheldFolder(path, manifest)
    folder.save_maps(small_material())
    for photo in photos:
        picture = np.full((300, 400, 3), 90 * photo.number, np.uint8)
        assert cv2.imwrite(str(path / photo.file), picture)


def rig_file(folder: Path, shots: int = 3, width_px: int = 1014) -> Path:
    text = (REPOSITORY / "rig_config/simulated.toml").read_text()
    text = re.sub(r"^width_px = \d+$", f"width_px = {width_px}", text, flags=re.MULTILINE)
    height_px = width_px * 3 // 4
    text = re.sub(r"^height_px = \d+$", f"height_px = {height_px}", text, flags=re.MULTILINE)
    path = folder / "small.toml"
    path.write_text(text.split("[preset.standard]")[0] + PRESETS.format(shots=shots))
    return path
