"""The phone's page as who photographs uses it: the code, photo after photo, a bad one, and the maps.

Screenshots are kept in tests/browser/screenshots.
"""

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from phone_service import Photographer, ServedPhone, serving_phone

HERE = Path(__file__).parent
AXE = HERE.parents[1] / ".venv/lib/node_modules/axe-core/axe.min.js"
SCREENSHOTS = HERE / "screenshots"
PATIENCE_MS = 120_000
PHONE: dict[str, Any] = {
    "viewport": {"width": 390, "height": 844},
    "device_scale_factor": 2,
    "is_mobile": True,
    "has_touch": True,
    "reduced_motion": "reduce",
    "accept_downloads": True,
}
pytestmark = pytest.mark.timeout(600)


@pytest.fixture
def served(tmp_path: Path) -> Iterator[ServedPhone]:
    with serving_phone(tmp_path / "oak") as service:
        yield service


@pytest.fixture
def phone(browser: Any, served: ServedPhone) -> Iterator[Any]:
    """A phone's browser; what goes wrong in it, or reaches elsewhere, fails the test."""
    context = browser.new_context(**PHONE)
    context.set_default_timeout(PATIENCE_MS)
    page = context.new_page()
    wrong: list[str] = []
    page.on("pageerror", lambda error: wrong.append(str(error)))
    page.on(
        "request",
        lambda r: (
            None
            if r.url.startswith(served.address) or r.url[:4] in ("data", "blob")
            else wrong.append(r.url)
        ),
    )
    yield page
    context.close()
    assert not wrong


def test_photographing_a_sample(phone: Any, served: ServedPhone, tmp_path: Path) -> None:
    photographer = Photographer(width_px=1344)
    _come_in(phone, served)
    _three_photos(phone, photographer, tmp_path)
    _a_bad_one(phone, photographer, tmp_path)
    _no_photo_at_all(phone, tmp_path)
    _export(phone, tmp_path)
    _in_the_dark(phone)


def _come_in(phone: Any, served: ServedPhone) -> None:
    """By the link of the QR code, as a camera reads it off the page."""
    phone.goto(served.link)
    phone.get_by_role("heading", name="Photograph a sample").wait_for()
    assert phone.url == f"{served.address}/"
    (cookie,) = phone.context.cookies()
    assert cookie["httpOnly"] and cookie["sameSite"] == "Strict"
    _keep(phone, "start")
    phone.get_by_text("With a phone, or another one").click()
    code = phone.get_by_alt_text("QR code of this page's link")
    phone.wait_for_function("document.querySelector('.qr').naturalWidth > 0")
    picture = cv2.imdecode(np.frombuffer(code.screenshot(), np.uint8), cv2.IMREAD_GRAYSCALE)
    said, _, _ = cv2.QRCodeDetector().detectAndDecode(picture)
    assert said == served.link
    _keep(phone, "code")
    phone.get_by_text("With a phone, or another one").click()


def _three_photos(phone: Any, photographer: Photographer, folder: Path) -> None:
    before = None
    for number, jpeg in enumerate(photographer.round_trip(3), 1):
        _take(phone, folder / f"IMG_{number:04d}.jpg", jpeg)
        phone.get_by_role("status").filter(has_text=f"Photo {number} is used").wait_for()
        maps = _maps_after(phone, before)
        assert maps != before
        before = maps
        if number in (1, 3):
            _keep(phone, f"after-{number}")
    assert phone.get_by_role("heading", name="3 photos are used").is_visible()
    for name in ("normal", "diffuse", "roughness", "specular"):
        assert (
            phone.get_by_alt_text(f"{name} map").evaluate("i => i.complete && i.naturalWidth")
            == 256
        )


def _a_bad_one(phone: Any, photographer: Photographer, folder: Path) -> None:
    _take(phone, folder / "flat.jpg", photographer.shoot(20))
    phone.get_by_role("status").filter(has_text="Photo 4 is not used").wait_for()
    sentence = phone.locator(".said").inner_text()
    assert re.search(r"only \d+ degrees above", sentence), sentence
    before = _maps_after(phone, None)
    _keep(phone, "not-used")
    phone.get_by_role("button", name="Use it all the same").click()
    phone.get_by_role("heading", name="4 photos are used").wait_for()
    assert _maps_after(phone, before) != before
    phone.get_by_role("button", name="Photo 4, flat.jpg").click()
    _keep(phone, "photo")
    phone.get_by_role("button", name="Leave it out").click()
    phone.get_by_role("dialog").wait_for(state="detached")
    phone.get_by_role("heading", name="3 photos are used").wait_for()


def _no_photo_at_all(phone: Any, folder: Path) -> None:
    _take(phone, folder / "holiday.jpg", b"GIF89a, I swear")
    refusal = phone.get_by_text("holiday.jpg is no JPEG, PNG, TIFF, HEIC or DNG").last
    refusal.wait_for()
    _keep(phone, "refused")
    phone.get_by_role("button", name="All right").click()
    refusal.wait_for(state="detached")


def _export(phone: Any, folder: Path) -> None:
    phone.get_by_role("link", name="Export the maps").click()
    phone.get_by_role("heading", name="Export").wait_for()
    _keep(phone, "export")
    with phone.expect_download() as download:
        phone.get_by_role("button", name="Export").click()
    file = folder / download.value.suggested_filename
    download.value.save_as(file)
    assert file.suffix == ".html" and "Oak, oiled" in file.read_text(encoding="utf-8")
    phone.get_by_role("link", name="Back").click()
    phone.get_by_role("heading", name="3 photos are used").wait_for()


def _in_the_dark(phone: Any) -> None:
    phone.emulate_media(color_scheme="dark")
    _keep(phone, "dark")
    phone.emulate_media(color_scheme="light")


def test_a_page_without_the_link_says_what_to_do(phone: Any, served: ServedPhone) -> None:
    for address in (served.address, f"{served.address}/#a-token-that-is-wrong"):
        phone.goto("about:blank")
        phone.goto(address)
        phone.get_by_role("heading", name="Open the link again").wait_for()
        assert not phone.locator("#shoot").is_visible()
    assert served.inbox.news.version == 0


def _take(phone: Any, path: Path, content: bytes) -> None:
    path.write_bytes(content)
    phone.get_by_label("Take a photo").set_input_files(path)


def _maps_after(phone: Any, before: str | None) -> str:
    """What stands for the maps that are drawn, once they are others than before."""
    phone.wait_for_function(
        "before => { const now = document.querySelector('.hand > .material').dataset.maps; "
        "return now && now !== before; }",
        arg=before,
    )
    return str(phone.locator(".material").get_attribute("data-maps"))


def _keep(phone: Any, name: str) -> None:
    """A screenshot; nothing is wider than the screen, and axe finds nothing."""
    phone.wait_for_timeout(300)
    SCREENSHOTS.mkdir(exist_ok=True)
    phone.screenshot(path=SCREENSHOTS / f"phone-{name}.png", full_page=True)
    assert phone.evaluate("document.documentElement.scrollWidth") <= 390
    phone.evaluate(AXE.read_text())
    found = phone.evaluate("axe.run()")["violations"]
    assert not found, [(f["id"], [n["html"] for n in f["nodes"]]) for f in found]
