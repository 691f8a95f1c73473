"""The phone's service as tests run it: in this process, on a free port; and photos to send to it."""

import contextlib
import http.client
import json
import math
import socket
import threading
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from urllib.parse import quote

import numpy as np
import uvicorn

from svbrdf import procedural
from turnlight import app
from turnlight.handheld.inbox import Inbox
from turnlight.handheld.record import WHITE
from turnlight.picture.marked_frame import MarkedFrame
from turnlight.simulation import phone as simulated
from turnlight.web.door import Door
from turnlight.web.phone import build
from turnlight.web.phone_server import COOKIE_NAME

TOKEN = "a-token-that-is-long-enough"
BEARER = {"authorization": f"Bearer {TOKEN}"}


@dataclass(frozen=True)
class ServedPhone:
    """A running service."""

    inbox: Inbox
    port: int

    @property
    def address(self) -> str:
        return f"http://127.0.0.1:{self.port}"

    @property
    def link(self) -> str:
        return f"{self.address}/#{TOKEN}"

    def ask(
        self,
        method: str,
        path: str,
        body: bytes | Iterator[bytes] | None = None,
        headers: dict[str, str] | None = None,
    ) -> tuple[int, Any, dict[str, str]]:
        """Status, body (JSON read, or bytes), and headers."""
        line = http.client.HTTPConnection("127.0.0.1", self.port, timeout=100)
        with contextlib.closing(line):
            line.request(method, path, body, BEARER if headers is None else headers)
            reply = line.getresponse()
            data = reply.read()
            told = {k.lower(): v for k, v in reply.getheaders()}
            if "json" in told.get("content-type", ""):
                return reply.status, json.loads(data), told
            return reply.status, data, told

    def send(self, name: str, content: bytes) -> None:
        status, answer, _ = self.ask("POST", f"/api/photos?name={quote(name)}", content)
        assert status == 202, answer

    def news(self) -> Any:
        """Once everything that was sent has had its turn."""
        self.inbox.wait()
        status, news, _ = self.ask("GET", "/api/handheld")
        assert status == 200
        return news

    def wait_for(self, holds: Callable[[], bool], timeout_s: float = 100) -> None:
        until_s = time.monotonic() + timeout_s
        while not holds():
            assert time.monotonic() < until_s, self.inbox.news
            time.sleep(0.02)


@contextlib.contextmanager
def serving_phone(folder: Path) -> Iterator[ServedPhone]:
    """A service whose session is in the folder; begun anew, or gone on with."""
    if (folder / "session.json").exists():
        from turnlight.handheld.handheld import Handheld

        handheld = Handheld.open(folder)
    else:
        handheld = app.new_handheld("Oak, oiled", WHITE, folder)
    with socket.create_server(("127.0.0.1", 0)) as listening, Inbox(handheld) as inbox:
        port = listening.getsockname()[1]
        link = f"http://127.0.0.1:{port}/#{TOKEN}"
        api = build(inbox, Door(TOKEN, cookie_name=COOKIE_NAME), link)
        running = uvicorn.Server(uvicorn.Config(api, log_level="error"))
        thread = threading.Thread(target=running.run, kwargs={"sockets": [listening]})
        thread.start()
        try:
            yield ServedPhone(inbox, port)
        finally:
            running.should_exit = True
            thread.join()


class Photographer:
    """Takes photos of one sample with one phone, each from another side."""

    def __init__(self, seed: int = 1, width_px: int = 2016, side_mm: int = 100) -> None:
        self._rng = np.random.default_rng(seed)
        self._phone = simulated.phone(self._rng, width_px, width_px * 3 // 4)
        self._frame = MarkedFrame(side_mm)
        self._material = procedural.material(7, 256)

    def shoot(self, elevation_deg: float = 70, **conditions: Any) -> bytes:
        """A JPEG."""
        pose = simulated.pose(self._rng, self._phone, self._frame, elevation_deg, 0.85)
        how = simulated.Conditions(pose, **conditions)
        shot = simulated.photograph(
            self._phone, self._frame, self._material, how, self._rng, resolution=32
        )
        return shot.jpeg

    def round_trip(self, count: int) -> list[bytes]:
        """From straight above, then from the sides."""
        elevations = [88.0, *(60 - 10 * math.cos(2.4 * i) for i in range(1, count))]
        return [self.shoot(elevation) for elevation in elevations]
