"""The phone's service: who is let in, how much they may bring, and what two phones at once make of it."""

import io
import itertools
import json
import os
import re
import resource
import signal
import subprocess
import sys
import threading
import time
import zipfile
import zlib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import numpy.typing as npt
import pytest
from phone_service import BEARER, TOKEN, Photographer, ServedPhone, serving_phone
from photo_files import png_of, scene
from PIL import Image

from turnlight.web import phone
from turnlight.web.phone_server import COOKIE_NAME

MIB = 1 << 20
pytestmark = pytest.mark.timeout(900)


@pytest.fixture(scope="module")
def served(tmp_path_factory: pytest.TempPathFactory) -> Iterator[ServedPhone]:
    with serving_phone(tmp_path_factory.mktemp("phone") / "oak") as service:
        yield service


def test_without_the_token_nothing_is_to_be_had(served: ServedPhone) -> None:
    wrong = [
        {},
        {"authorization": f"Bearer {TOKEN}x"},
        {"authorization": f"Basic {TOKEN}"},
        {"cookie": f"{COOKIE_NAME}={TOKEN}"},
        {"cookie": "turnlight=x"},
    ]
    asked = [
        ("GET", "/api/handheld", None),
        ("GET", f"/api/handheld?token={TOKEN}", None),
        ("GET", "/api/link.svg", None),
        ("GET", "/api/photos/1.jpg", None),
        ("POST", "/api/photos?name=a.jpg", b"photo"),
        ("POST", "/api/photos/1/force", None),
    ]
    for headers, (method, path, body) in itertools.product(wrong, asked):
        assert served.ask(method, path, body, headers)[0] == 401, (headers, path)
    assert served.news()["version"] == 0
    page = served.ask("GET", "/", headers={})[1].decode()
    assert TOKEN not in page and TOKEN not in served.ask("GET", "/phone.js", headers={})[1].decode()


def test_the_links_token_becomes_a_cookie(served: ServedPhone) -> None:
    asked = {"content-type": "application/json"}
    wrong = served.ask("POST", "/api/door", b'{"token": "not the one there is"}', asked)
    assert wrong[0] == 401 and "set-cookie" not in wrong[2]
    right = served.ask("POST", "/api/door", json.dumps({"token": TOKEN}).encode(), asked)
    cookie = right[2]["set-cookie"]
    assert cookie.startswith(f"{COOKIE_NAME}=") and TOKEN not in cookie
    assert "HttpOnly" in cookie and "SameSite=strict" in cookie
    own = {"cookie": cookie.split(";")[0]}
    assert served.ask("GET", "/api/handheld", headers=own)[0] == 200


def test_another_sites_page_sends_nothing(served: ServedPhone) -> None:
    for origin in ("http://evil.example", "null", f"http://localhost:{served.port + 1}"):
        for path in ("/api/photos?name=a.jpg", "/api/photos/1/force", "/api/door"):
            assert served.ask("POST", path, b"x", BEARER | {"origin": origin})[0] == 403, path
    for host in ("evil.example", "127.0.0.1.evil.example"):
        assert served.ask("GET", "/api/handheld", headers=BEARER | {"host": host})[0] == 421
    assert served.news()["version"] == 0


def test_what_a_browser_may_do_with_the_page(served: ServedPhone) -> None:
    for path in ("/", "/phone.js", "/api/link.svg", "/api/nowhere"):
        _, _, told = served.ask("GET", path)
        policy = told["content-security-policy"]
        assert "default-src 'none'" in policy and "unsafe" not in policy
        assert told["x-content-type-options"] == "nosniff"
        assert told["referrer-policy"] == "no-referrer"
    page = served.ask("GET", "/")[1].decode()
    assert not re.search(r"https?://|\sstyle=|\son\w+=", page)


def test_200_megabytes_are_refused_and_not_held(served: ServedPhone) -> None:
    before_kib = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    part = bytes(MIB)
    for headers in (BEARER | {"content-length": str(200 * MIB)}, BEARER):
        parts = itertools.repeat(part, 200)
        status, answer, _ = served.ask("POST", "/api/photos?name=raw.tiff", parts, headers)
        assert status == 413
        assert answer["detail"] == (
            "raw.tiff is too large; at most 150 MB can be sent. Save it as JPEG."
        )
    grown_kib = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before_kib
    assert grown_kib < 100 * 1024
    assert not list((served.inbox.folder / "incoming").glob("*/*"))
    assert served.news()["version"] == 0


def test_a_sender_that_goes_away_leaves_nothing(served: ServedPhone) -> None:
    def parts() -> Iterator[bytes]:
        yield bytes(MIB)
        raise ConnectionError

    with pytest.raises(ConnectionError):
        served.ask("POST", "/api/photos", parts(), BEARER | {"content-length": str(2 * MIB)})
    served.wait_for(lambda: not list((served.inbox.folder / "incoming").glob("*/*")))
    assert served.news()["version"] == 0


def test_other_requests_stay_small(served: ServedPhone) -> None:
    assert served.ask("POST", "/api/photos/1/force", bytes(MIB))[0] == 413
    for path in ("/api/photos/99.jpg", "/api/sessions/../packed", "/api/sessions/other/packed"):
        assert served.ask("GET", path)[0] == 404, path
    status, answer, _ = served.ask("POST", "/api/photos/7/force")
    assert status == 409 and "There is no photo 7" in answer["detail"]


def test_harm_is_refused_with_a_sentence(served: ServedPhone) -> None:
    """What each is, test_photo_limits looks into; here, that none gets any farther by the phone's way."""
    bundle = io.BytesIO()
    Image.fromarray(scene()).save(bundle, "jpeg")
    with zipfile.ZipFile(bundle, "a") as archive:
        archive.writestr("virus.html", "<html>")
    harm = {
        "bomb.png": (png_of(40_000, 40_000, zlib.compress(bytes(1000))), "has 40000x40000 pixels"),
        "both.jpg": (bundle.getvalue(), "is a zip archive as well as a photo"),
        "page.heic": (b"<!doctype html><script>alert(1)</script>", "is no JPEG, PNG, TIFF, HEIC"),
    }
    for name, (content, _) in harm.items():
        served.send(name, content)
    news = served.news()
    assert news["photos"] == [] and len(news["arrivals"]) == len(harm)
    for arrival, (name, (_, why)) in zip(news["arrivals"], harm.items(), strict=True):
        assert arrival["sentence"].startswith(f"{name} {why}"), arrival
        served.ask("POST", f"/api/arrivals/{arrival['number']}/dismiss")


def test_news_come_when_there_are_any(served: ServedPhone, monkeypatch: pytest.MonkeyPatch) -> None:
    version = served.news()["version"]
    monkeypatch.setattr(phone, "LONGEST_WAIT_S", 0.3)
    assert served.ask("GET", f"/api/handheld?after={version}")[1]["version"] == version
    monkeypatch.setattr(phone, "LONGEST_WAIT_S", 100.0)
    answers: list[Any] = []
    waiting = threading.Thread(
        target=lambda: answers.append(served.ask("GET", f"/api/handheld?after={version}")[1])
    )
    waiting.start()
    time.sleep(0.3)
    assert answers == []
    served.send("cat.gif", b"GIF89a")
    waiting.join(60)
    assert answers[0]["version"] > version
    (refused,) = served.news()["arrivals"]
    assert refused["turn"] == "refused" and "cat.gif is no JPEG" in refused["sentence"]
    assert served.ask("POST", f"/api/arrivals/{refused['number']}/dismiss")[0] == 200
    assert served.news()["arrivals"] == []


def test_two_phones_at_once_and_on_again_after_the_end(tmp_path: Path) -> None:
    """A photo of each; a third is left in the folder when the program starts anew."""
    hands = [Photographer(seed, 1344) for seed in (1, 2)]
    photos = [hand.shoot(80 - 15 * i) for i, hand in enumerate(hands)]
    folder = tmp_path / "oak"
    with serving_phone(folder) as served:
        threads = [
            threading.Thread(target=served.send, args=(f"phone {hand}.jpg", photo))
            for hand, photo in enumerate(photos)
        ]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        news = served.news()
        assert sorted(p["name"] for p in news["photos"]) == ["phone 0.jpg", "phone 1.jpg"]
        assert all(p["used"] for p in news["photos"]), news["photos"]
        assert news["arrivals"] == [] and news["maps"] is not None
        thumbnail = served.ask("GET", "/api/photos/2.jpg")[1]
        assert cv2.imdecode(np.frombuffer(thumbnail, np.uint8), 1).shape == (240, 320, 3)
        served.send("again.jpg", photos[0])
        assert len(served.news()["photos"]) == 2, "the same file is no other photo"
    left = folder / "incoming/0001/late.jpg"
    left.parent.mkdir(parents=True)
    left.write_bytes(hands[0].shoot(60))
    with serving_phone(folder) as served:
        assert [p["name"] for p in served.news()["photos"]][2:] == ["late.jpg"]


def test_the_command(tmp_path: Path) -> None:
    """Its code on the terminal leads to the page; a photo comes by the watched folder; Ctrl-C ends it well."""
    watched, out = tmp_path / "watched", tmp_path / "out"
    watched.mkdir()
    start = "from turnlight.cli import main; main()"
    command = [sys.executable, "-c", start, "handheld", "--host", "127.0.0.1"]
    command += ["--port", "0", "--watch", str(watched), "--out", str(out), "--sample", "Oak"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True, cwd=tmp_path) as program:
        assert program.stdout is not None
        code = list(itertools.takewhile(lambda line: "Point" not in line, program.stdout))
        said = _read_code("".join(code))
        assert re.fullmatch(r"http://127\.0\.0\.1:\d+/#[\w-]{32}", said)
        for line in program.stdout:
            if "End with Ctrl-C" in line:
                break
        (watched / "IMG_1.jpg").write_bytes(Photographer(1, 1344).shoot(80))
        assert program.stdout.readline() == "  1  IMG_1.jpg: Used.\n"
        os.kill(program.pid, signal.SIGINT)
        rest = program.stdout.read()
    assert f"The maps are in {out / 'maps'}" in rest and program.returncode == 0
    assert (out / "contact_sheet.png").exists() and (out / "photos/001.jpg").exists()


def _read_code(text: str) -> str:
    """What a phone's camera reads off a terminal: two rows of modules in every line."""
    dark = {"\N{FULL BLOCK}": (0, 0), "\N{UPPER HALF BLOCK}": (0, 1)}
    dark |= {"\N{LOWER HALF BLOCK}": (1, 0), " ": (1, 1)}
    plain = re.sub(r"\x1b\[[\d;]*m", "", text)
    lines = [line for line in plain.splitlines() if line and set(line) <= dark.keys()]
    rows = [[dark[c][half] for c in line] for line in lines for half in (0, 1)]
    modules: npt.NDArray[np.uint8] = np.array(rows, np.uint8)
    picture = np.kron(255 * (1 - modules), np.ones((8, 8), np.uint8)).astype(np.uint8)
    for shown in (picture, 255 - picture):
        framed = cv2.copyMakeBorder(shown, 60, 60, 60, 60, cv2.BORDER_CONSTANT, value=[255])
        said, _, _ = cv2.QRCodeDetector().detectAndDecode(framed)
        if said:
            return said
    return ""
