"""Who is let in: hosts, origins, tokens, sizes, paths; and what a browser may do with the answers."""

import asyncio
import contextlib
import re
import socket
from collections.abc import Iterator
from pathlib import Path

import pytest
from web_service import Served, rig_file, serving, small_material
from websockets.exceptions import InvalidStatus
from websockets.sync.client import connect

from turnlight import app
from turnlight.errors import ServiceError
from turnlight.web import door as doors
from turnlight.web.door import Door
from turnlight.web.server import Address, serve

TOKEN = "a token that is long enough"
BEARER = {"authorization": f"Bearer {TOKEN}"}


@pytest.fixture(scope="module")
def guarded(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Served]:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(app, "simulated_material", small_material)
        with serving(tmp_path_factory.mktemp("guarded"), Door(TOKEN)) as service:
            yield service


def test_names_that_are_not_ours_are_refused(served: Served) -> None:
    for host in ("evil.example", "127.0.0.1.evil.example", "localhost.evil.example:80", "", "a@b"):
        assert served.ask("GET", "/api/run", headers={"host": host})[0] == 421, host
    for host in ("localhost", f"127.0.0.1:{served.port}", "[::1]:80", "192.168.1.7", "LOCALHOST"):
        assert served.ask("GET", "/api/run", headers={"host": host})[0] == 200, host


def test_another_sites_page_changes_nothing(served: Served) -> None:
    before = served.get("/api/sample")
    for origin in ("http://evil.example", "null", f"http://localhost:{served.port + 1}", "http://"):
        for method, path in (
            ("POST", "/api/run"),
            ("PUT", "/api/sample"),
            ("DELETE", "/api/sessions/a"),
        ):
            status, _, _ = served.ask(method, path, before | {"name": "x"}, {"origin": origin})
            assert status == 403, origin
    assert served.get("/api/sample") == before
    assert served.get("/api/run")["now"]["state"] == "idle"
    own = {"origin": served.address}
    assert served.ask("PUT", "/api/sample", before, own)[0] == 200


def test_another_sites_page_hears_nothing(served: Served) -> None:
    for headers in ({"Origin": "http://evil.example"}, {"Host": "evil.example"}):
        with (
            pytest.raises(InvalidStatus),
            connect(f"ws://127.0.0.1:{served.port}/api/events", additional_headers=headers),
        ):
            pass
    with connect(
        f"ws://127.0.0.1:{served.port}/api/events", additional_headers={"Origin": served.address}
    ) as line:
        assert "snapshot" in str(line.recv())


def test_without_the_token_nothing_is_to_be_had(guarded: Served) -> None:
    assert guarded.get("/api/door")["open"] is False
    assert guarded.ask("GET", "/api/run", headers=BEARER)[0] == 200
    wrong = [
        ("/api/run", {}),
        (f"/api/run?token={TOKEN}", {}),
        (f"/api/run?authorization=Bearer%20{TOKEN}", {}),
        ("/api/run", {"cookie": f"turnlight={TOKEN}"}),
        ("/api/run", {"cookie": f"token={TOKEN}"}),
        ("/api/run", {"x-token": TOKEN}),
        ("/api/run", {"authorization": TOKEN}),
        ("/api/run", {"authorization": f"Basic {TOKEN}"}),
        ("/api/run", {"authorization": f"Bearer {TOKEN}x"}),
        ("/api/run", {"authorization": "Bearer "}),
        ("/api/run", {"cookie": 'turnlight="'}),
    ]
    for path, headers in wrong:
        assert guarded.ask("GET", path.replace(" ", "%20"), headers=headers)[0] == 401, headers
    with pytest.raises(InvalidStatus), connect(f"ws://127.0.0.1:{guarded.port}/api/events"):
        pass


def test_a_page_trades_the_token_for_a_cookie(guarded: Served) -> None:
    assert guarded.ask("POST", "/api/door", {"token": "wrong"})[0] == 401
    status, _, headers = guarded.ask("POST", "/api/door", {"token": TOKEN})
    assert status == 200
    cookie = headers["set-cookie"]
    assert "HttpOnly" in cookie
    assert "samesite=strict" in cookie.lower()
    assert TOKEN not in cookie
    pair = {"cookie": cookie.partition(";")[0]}
    assert guarded.ask("GET", "/api/run", headers=pair)[0] == 200
    with connect(
        f"ws://127.0.0.1:{guarded.port}/api/events", additional_headers={"Cookie": pair["cookie"]}
    ) as line:
        assert "snapshot" in str(line.recv())


def test_browsers_are_told_to_be_strict(served: Served) -> None:
    for path in ("/", "/api/run", "/api/nothing", "/nothing"):
        policy = served.ask("GET", path)[2]["content-security-policy"]
        assert "default-src 'none'" in policy
        assert "unsafe" not in policy
        assert "frame-ancestors 'none'" in policy


def test_the_page_asks_nobody_else_for_anything() -> None:
    static = Path(doors.__file__).parent / "static"
    for file in static.iterdir():
        if file.suffix in {".html", ".css", ".js", ".svg"}:
            text = file.read_text().replace("http://www.w3.org/2000/svg", "")
            assert not re.search(r"https?://|@import|//cdn", text), file


def test_too_much_is_refused(served: Served) -> None:
    assert served.ask("PUT", "/api/sample", {"name": "x" * 70_000})[0] == 413
    with socket.create_connection(("127.0.0.1", served.port), timeout=10) as line:
        line.sendall(
            b"PUT /api/sample HTTP/1.1\r\nHost: localhost\r\nTransfer-Encoding: chunked\r\n\r\n"
        )
        with contextlib.suppress(OSError):
            for _ in range(200):
                line.sendall(b"400\r\n" + b"x" * 1024 + b"\r\n")
        assert b"413" in line.recv(100)


def test_paths_lead_nowhere_else(served: Served, tmp_path: Path) -> None:
    (served.root.parent / "secret").mkdir()
    (served.root.parent / "secret/session.json").write_text("{}")
    (served.root / "link").symlink_to(served.root.parent / "secret")
    names = ["..", "../secret", "%2e%2e%2fsecret", "..%2fsecret", "%2fetc", ".deleted", "link",
             "a%00b", "%252e%252e%252fsecret", "....//secret", "..\\secret", "~", "C:", "a" * 300]  # fmt: skip
    for name in names:
        for method, rest in (("GET", ""), ("GET", "/packed"), ("DELETE", ""), ("POST", "/restore")):
            status, _, _ = served.ask(method, f"/api/sessions/{name}{rest}")
            assert status in (404, 405, 422), (name, method, status)
        assert served.ask("GET", f"/{name}")[0] in (404, 405), name
    assert (served.root.parent / "secret/session.json").exists()


def test_a_network_needs_a_token(tmp_path: Path) -> None:
    assert doors.token_for("127.0.0.1", None) is None
    assert doors.token_for("::1", None) is None
    with pytest.raises(ServiceError, match="--token-file"):
        doors.token_for("0.0.0.0", None)
    made = doors.token_for("0.0.0.0", tmp_path / "token")
    assert made is not None
    assert doors.token_for("0.0.0.0", tmp_path / "token") == made
    assert (tmp_path / "token").stat().st_mode & 0o077 == 0
    (tmp_path / "short").write_text("1234\n")
    with pytest.raises(ServiceError, match="shorter"):
        doors.token_for("0.0.0.0", tmp_path / "short")


def test_on_a_network_plain_http_is_warned_about(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(asyncio, "run", lambda work: work.close())  # serve nobody
    for host, warned in (("127.0.0.1", False), ("0.0.0.0", True)):
        said: list[str] = []
        address = Address(host, 0, folder / "token")
        serve(rig_file(folder), folder / "sessions", address, tell=said.append)
        assert host in said[0]
        assert ("Over plain HTTP" in said[-1]) is warned
