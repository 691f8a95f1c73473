"""Nonsense: whatever is sent, the service answers, does not fail, and writes nowhere but into its folder."""

import contextlib
import itertools
import random
import socket
from pathlib import Path
from typing import Any

import pytest
import schemathesis
from hypothesis import HealthCheck, given, settings
from hypothesis.errors import Unsatisfiable
from web_service import Served
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import connect

pytestmark = pytest.mark.timeout(600)
SEED = 7
REQUESTS, CONNECTIONS, MESSAGES, EXAMPLES = 1000, 100, 10, 6
PATHS = [
    "/", "/api/run", "/api/run/stop", "/api/run/shots/1/drop", "/api/sample", "/api/sessions",
    "/api/sessions/../../etc/passwd", "/api/sessions/%00", "/api/sessions/a/maps/normal.jpg",
    "/api/sessions/a/resume", "/api/sessions/a/export", "/api/door", "/api/view", "/api/events",
    "/api/calibration/dark", "/api/calibration/..%2fdark", "/api/calibration/targets/..%2fx.pdf",
    "/api/sessions/a/refine", "/api/sessions/../refine", "/api/sessions/a/uncertainty/normal.jpg",
    "/app.js", "/..%2f..%2fpyproject.toml", "/%2e%2e/", "//", "/api/sessions?limit=1e9", "*",
]  # fmt: skip
METHODS = ["GET", "POST", "PUT", "DELETE", "PATCH", "HEAD", "OPTIONS", "TRACE", "FOO", ""]
BODIES = [
    b"", b"{}", b"[]", b"null", b"{", b"\xff\xfe\x00", b'{"name": 1}', b"[" * 5000, b"1e999",
    b'{"name": "../../x", "preset": "fast", "side_mm": NaN, "thickness_mm": -1}', b"x" * 70_000,
    b'{"name": "\\u0000", "preset": "fast", "side_mm": 50, "thickness_mm": 1}',
    b'{"token": "' + b"x" * 999 + b'"}',
    b'{"retake": [0, -1, 99999999999999999999]}', b'{"format": "../../x"}',
]  # fmt: skip
HEADERS = [
    b"Host: localhost", b"Host: evil.example", b"Host:", b"Content-Type: application/json",
    b"Content-Type: multipart/form-data; boundary=x", b"Content-Length: -1", b"Content-Length: 99999999999",
    b"Transfer-Encoding: chunked", b"Transfer-Encoding: gzip, chunked", b"Authorization: Bearer \xff",
    b"Cookie: turnlight=\xff; a=b; =", b"Origin: null", b"Upgrade: websocket", b"Connection: Upgrade",
    b"Sec-WebSocket-Version: 13", b"Sec-WebSocket-Key: x", b"X: " + b"y" * 9000, b"Range: bytes=5-1",
    b"Accept-Encoding: \x01", b"Expect: 100-continue", b"If-None-Match: \"", b"no colon", b"\x00: \x00",
]  # fmt: skip


def test_a_thousand_malformed_requests(served: Served) -> None:
    chance = random.Random(SEED)
    before = _files(served.root.parent)
    failed = []
    for number in range(REQUESTS):
        request = _request(chance)
        answer = _send(served.port, request)
        if answer.startswith(b"HTTP/1.1 5"):
            failed.append((number, request[:200], answer[:200]))
    assert not failed
    assert served.get("/api/run")["now"]["state"] == "idle"
    outside = {p for p in _files(served.root.parent) - before if served.root not in p.parents}
    assert not outside


def test_a_thousand_malformed_messages(served: Served) -> None:
    chance = random.Random(SEED)
    address = f"ws://127.0.0.1:{served.port}/api/events"
    for _ in range(CONNECTIONS):
        with connect(address) as line, contextlib.suppress(ConnectionClosed):
            assert "snapshot" in str(line.recv(timeout=20))
            for _ in range(MESSAGES):
                line.send(_message(chance))
    assert served.get("/api/run")["now"]["state"] == "idle"
    with connect(address) as line:
        assert "snapshot" in str(line.recv(timeout=20))


def test_whatever_schemathesis_makes_of_the_schema_gives_no_server_error(served: Served) -> None:
    schema = schemathesis.openapi.from_dict(served.get("/api/openapi.json"))
    starting = ["/api/run", "/api/sessions/{name}/resume", "/api/calibration/{step}"]  # see above
    operations = [f.ok() for f in schema.exclude(method="POST", path=starting).get_all_operations()]
    modes = (schemathesis.GenerationMode.POSITIVE, schemathesis.GenerationMode.NEGATIVE)
    for operation, mode in itertools.product(operations, modes):
        with contextlib.suppress(Unsatisfiable):
            _try_out(operation, mode, served.address)
    assert len(operations) > 15


def _try_out(operation: Any, mode: Any, address: str) -> None:
    @settings(
        max_examples=EXAMPLES, deadline=None, derandomize=True, database=None,
        suppress_health_check=list(HealthCheck),
    )  # fmt: skip
    @given(case=operation.as_strategy(generation_mode=mode))
    def call(case: Any) -> None:
        response = case.call(address, timeout=60)
        assert response.status_code < 500, response.text

    call()


def _message(chance: random.Random) -> bytes | str:
    message = chance.randbytes(chance.choice([0, 1, 100, 1000, 9000]))
    return message.hex() if chance.random() < 0.5 else message


def _request(chance: random.Random) -> bytes:
    method, path, body = (chance.choice(c) for c in (METHODS, PATHS, BODIES))
    if method == "POST" and path in ("/api/run", "/api/view", "/api/calibration/dark"):
        path += "/" + chance.choice(["x", "..", "%", "stop-now"])
    if chance.random() < 0.1:
        path = "/" + "".join(chr(chance.randrange(33, 127)) for _ in range(chance.randrange(2000)))
    lines = [f"{method} {path} HTTP/{chance.choice(['1.1', '1.1', '1.0', '9', ''])}".encode()]
    if chance.random() < 0.8:
        lines.append(b"Host: localhost")
    lines += chance.sample(HEADERS, chance.randrange(4))
    if chance.random() < 0.7:
        lines += [f"Content-Length: {len(body)}".encode(), b"Content-Type: application/json"]
    whole = b"\r\n".join(lines) + b"\r\n\r\n" + body
    if chance.random() < 0.1:
        spoiled = bytearray(whole)
        for _ in range(5):
            spoiled[chance.randrange(min(len(spoiled), 200))] = chance.randrange(256)
        whole = bytes(spoiled)
    return whole


def _send(port: int, request: bytes) -> bytes:
    with socket.create_connection(("127.0.0.1", port), timeout=20) as line:
        with contextlib.suppress(OSError):
            line.sendall(request)
            line.shutdown(socket.SHUT_WR)
            return line.recv(400)
        return b""


def _files(folder: Path) -> set[Path]:
    return set(folder.rglob("*"))
