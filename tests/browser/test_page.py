"""The page as a technician uses it: from the token to an export, on three sizes of screen, and for everyone."""

import base64
import re
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from browser import relit_in_numpy
from browser.screens import PATIENCE_MS, keep, opened, until
from web_service import Served, Shutter, photographed_by_hand, serving, small_material

from svbrdf import materials
from turnlight import app
from turnlight.capture import relight
from turnlight.capture.state import State
from turnlight.errors import RigError
from turnlight.simulation.board import SimulatedBoard
from turnlight.web.door import Door

SHOTS = 10
_SHOOTING = (State.RUNNING, State.PAUSING)
pytestmark = pytest.mark.timeout(900)

READ = """
() => {
  const gl = document.querySelector(".stage canvas").getContext("webgl2");
  const [w, h] = [gl.drawingBufferWidth, gl.drawingBufferHeight];
  const pixels = new Uint8Array(w * h * 4);
  gl.readPixels(0, 0, w, h, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
  let text = "";
  for (let i = 0; i < pixels.length; i += 8192) text += String.fromCharCode(...pixels.subarray(i, i + 8192));
  return [w, h, btoa(text), { ...gl.canvas.dataset }]; // at once: of what is drawn
}
"""


@pytest.fixture(scope="module")
def shutter() -> Iterator[Shutter]:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(app, "simulated_material", small_material)
        held = Shutter(patch)
        yield held
        held.release()


@pytest.fixture(scope="module")
def served(tmp_path_factory: pytest.TempPathFactory, shutter: Shutter) -> Iterator[Served]:
    with serving(tmp_path_factory.mktemp("page"), shots=SHOTS) as service:
        yield service
        shutter.release()


@pytest.fixture(scope="module")
def screen(browser: Any, served: Served) -> Iterator[Any]:
    with opened(browser, served.address) as page:
        yield page


def test_a_technicians_day(screen: Any, served: Served, shutter: Shutter, tmp_path: Path) -> None:
    _ready_sample_frame_and_plan(screen, served)
    _capture(screen, served, shutter)
    _result(screen, served, tmp_path)
    _by_hand(screen, served)
    _sessions(screen)


def _ready_sample_frame_and_plan(screen: Any, served: Served) -> None:
    screen.wait_for_selector("text=Everything is ready.")
    assert screen.locator(".lights .ok").count() == 5
    keep(screen, "ready")
    screen.get_by_role("link", name="Next: the sample").click()
    screen.get_by_label("Name").fill("Oak, oiled")
    screen.get_by_label("Barcode").fill("4006381333931")
    screen.get_by_label("Operator").fill("Mo")
    keep(screen, "sample")
    screen.get_by_role("button", name="Next: the plan").click()
    screen.wait_for_selector(".diagram")
    assert served.get("/api/sample")["operator"] == "Mo"
    keep(screen, "plan")
    screen.get_by_role("link", name="Frame").click()
    screen.wait_for_selector("text=8 seen")
    keep(screen, "frame")


def _capture(screen: Any, served: Served, shutter: Shutter) -> None:
    def go_as_far_as(shots: int) -> None:
        now = lambda: served.desk.engine.current  # noqa: E731
        shutter.hold(lambda: now().state in _SHOOTING and len(now().shots) >= shots)

    go_as_far_as(2)
    screen.get_by_role("navigation").get_by_role("link", name="Capture").click()
    screen.get_by_role("button", name="Capture").wait_for()
    screen.wait_for_selector("text=10 shots")
    keep(screen, "capture-start")
    screen.get_by_role("button", name="Capture").click()
    normal = screen.get_by_role("img", name="normal map")
    until(screen, "document.querySelectorAll('.chip.good, .chip.fair, .chip.poor').length >= 1")
    until(screen, "document.querySelector('.maps canvas').width === 256")
    first = normal.evaluate("(map) => map.toDataURL()")
    screen.get_by_role("button", name="Pause").click()
    served.wait_for(lambda: served.desk.engine.current.state is not State.RUNNING)
    go_as_far_as(SHOTS)
    screen.wait_for_selector("text=Paused")
    until(screen, "() => document.querySelector('.stage canvas').dataset.light")
    _maps_are_as_on_disk(screen, served)
    stage = screen.locator(".stage canvas")
    stage.scroll_into_view_if_needed()
    dark, aimed = screen.evaluate(READ)[2:]
    box = stage.bounding_box()
    screen.mouse.move(box["x"] + 40, box["y"] + 40)
    screen.mouse.down()
    screen.mouse.move(box["x"] + box["width"] - 60, box["y"] + 60, steps=4)
    screen.mouse.up()
    until(screen, f"document.querySelector('.stage canvas').dataset.light !== '{aimed['light']}'")
    assert screen.evaluate(READ)[2] != dark, "the light that was dragged lights the material"
    keep(screen, "capture")
    before = len(served.desk.engine.current.shots)
    go_as_far_as(before + 2)
    screen.get_by_role("button", name="Go on").click()
    served.wait_for(lambda: len(served.desk.engine.current.shots) > before)
    until(screen, f"() => document.querySelector('.maps canvas').toDataURL() !== '{first}'")
    screen.get_by_role("button", name="Stop now").click()
    engine = served.desk.engine  # which has been stopped already if no picture was being taken
    served.wait_for(
        lambda: engine._control.stopping_now or engine.current.state is State.INTERRUPTED
    )
    shutter.release()
    screen.wait_for_selector("text=shots are safe")
    keep(screen, "interrupted")
    screen.get_by_role("button", name="Resume").click()
    screen.wait_for_selector("text=How the maps grew", timeout=PATIENCE_MS)
    assert len(served.desk.engine.current.shots) == SHOTS


def _maps_are_as_on_disk(screen: Any, served: Served) -> None:
    """Within 2/255 on 99 % of the pixels, as soon as the page has heard of the last shot."""
    (folder,) = served.root.glob("Oak*")
    agree: dict[str, float] = {}
    until_s = time.monotonic() + PATIENCE_MS / 1000
    while not agree or min(agree.values()) < 0.99:
        assert time.monotonic() < until_s, agree
        screen.wait_for_timeout(200)
        shown = relight.shown(materials.load(folder / "maps"))
        agree = {name: _agreement(screen, name.lower(), image) for name, image in shown.items()}


def _agreement(screen: Any, name: str, expected: Any) -> float:
    address = screen.get_by_role("img", name=f"{name} map").evaluate("map => map.toDataURL()")
    png = np.frombuffer(base64.b64decode(address.partition(",")[2]), np.uint8)
    drawn = np.asarray(cv2.imdecode(png, cv2.IMREAD_COLOR), np.int16)[..., ::-1]
    return float(np.mean(np.abs(drawn - expected).max(-1) <= 2))


def _result(screen: Any, served: Served, tmp_path: Path) -> None:
    until(screen, "[...document.querySelectorAll('.growth img')].every(i => i.complete)")
    until(screen, "document.querySelector('.stage canvas').dataset.light")
    screen.wait_for_timeout(500)
    _agrees_with_numpy(screen, served)
    _tilted(screen, served)
    screen.get_by_role("button", name="Refine", exact=True).click()
    screen.wait_for_selector("text=off, where a shot is predicted by the others")
    screen.get_by_alt_text("Where the normal map may be off").scroll_into_view_if_needed()
    screen.get_by_role("button", name="1", exact=True).click()
    screen.wait_for_timeout(500)
    keep(screen, "result")
    screen.get_by_role("link", name="Export").click()
    keep(screen, "export")
    screen.get_by_text("glTF").click()
    with screen.expect_download() as waiting:
        screen.get_by_role("button", name="Export").click()
    waiting.value.save_as(tmp_path / "it.glb")
    assert (tmp_path / "it.glb").read_bytes()[:4] == b"glTF"
    screen.get_by_role("link", name="Back").click()
    screen.get_by_role("button", name="Take again: shot 2").click()
    screen.wait_for_selector("text=Shot 2 will be taken again.")
    (folder,) = served.root.glob("Oak*")
    served.wait_for((folder / "shots/001-2.png").exists, 100)
    served.wait_for(lambda: served.get("/api/run")["now"]["state"] == "idle", 100)


def _tilted(screen: Any, served: Served) -> None:
    """The view is turned by dragging and by keys; the renderer agrees from there too.

    Not from much lower, where the page's mipmaps come in, which the reference does without.
    """
    screen.get_by_role("button", name="view", exact=True).click()
    stage = screen.locator(".stage canvas")
    until(screen, "Number(document.querySelector('.stage canvas').dataset.tilt) > 0.5")
    _agrees_with_numpy(screen, served)
    before = stage.get_attribute("data-turn")
    stage.scroll_into_view_if_needed()
    box = stage.bounding_box()
    screen.mouse.move(box["x"] + 200, box["y"] + 200)
    screen.mouse.down()
    screen.mouse.move(box["x"] + 120, box["y"] + 195, steps=4)
    screen.mouse.up()
    until(screen, f"document.querySelector('.stage canvas').dataset.turn !== '{before}'")
    turned = stage.get_attribute("data-tilt")
    stage.press("ArrowDown")
    until(screen, f"document.querySelector('.stage canvas').dataset.tilt !== '{turned}'")
    _agrees_with_numpy(screen, served)
    keep(screen, "result-tilted")
    screen.get_by_role("button", name="light", exact=True).click()
    screen.get_by_role("button", name="From above").click()
    until(screen, "document.querySelector('.stage canvas').dataset.tilt === '0'")


def _by_hand(screen: Any, served: Served) -> None:
    """What a phone has photographed is opened like the rest."""
    photographed_by_hand(served.root / "by-hand")
    screen.get_by_role("navigation").get_by_role("link", name="Sessions").click()
    screen.get_by_role("link", name="Oak by hand").click()
    screen.wait_for_selector("text=1 of 2 photos by hand")
    screen.wait_for_selector("text=It is blurred; hold the phone still.")
    until(screen, "document.querySelector('.stage canvas').dataset.light")
    keep(screen, "result-by-hand")


def _sessions(screen: Any) -> None:
    slow: list[Any] = []
    screen.route("**/api/sessions?words=&*", lambda route, _: slow.append(route))
    screen.get_by_role("navigation").get_by_role("link", name="Sessions").click()
    while not slow:
        screen.wait_for_timeout(20)
    screen.get_by_label("Search").fill("4006381333931")
    for request in slow:  # whose answer comes when something else is wanted
        request.continue_()
    screen.wait_for_selector("text=1 session")
    screen.unroute("**/api/sessions?words=&*")
    keep(screen, "sessions")
    screen.get_by_role("button", name=re.compile("Delete Oak")).click()
    screen.wait_for_selector("text=0 sessions")
    screen.get_by_role("button", name="Undo").click()
    screen.wait_for_selector("text=1 session")
    screen.get_by_role("button", name=re.compile("Delete Oak")).click()
    screen.wait_for_selector("text=0 sessions")
    keep(screen, "sessions-undo")


def _agrees_with_numpy(screen: Any, served: Served) -> None:
    """Within 2/255 on 99 % of the pixels."""
    size, _, text, told = screen.evaluate(READ)
    light = np.array([float(v) for v in told["light"].split(",")])
    shown = np.frombuffer(base64.b64decode(text), np.uint8).reshape(size, size, 4)[::-1, :, :3]
    (folder,) = served.root.glob("Oak*")
    maps = materials.load(folder / "maps")
    expected, inside = relit_in_numpy.relit(
        maps, light, float(told["turn"]), float(told["tilt"]), size
    )
    apart = np.abs(shown - expected).max(-1)[inside]
    assert np.mean(apart <= 2) >= 0.99, (told, np.mean(apart <= 2))
    assert inside.mean() > 0.2


def test_a_red_light_says_cause_and_fix(
    browser: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def gone(_: SimulatedBoard) -> None:
        raise RigError("The controller does not answer; see that its cable is plugged in.")

    monkeypatch.setattr(SimulatedBoard, "__init__", gone)
    with serving(tmp_path) as service, opened(browser, service.address) as screen:
        screen.wait_for_selector("text=Something needs a hand.")
        assert screen.locator(".lights .bad").count() == 3
        assert "plugged in" in screen.locator(".lights .bad").first.inner_text()
        keep(screen, "ready-not")


def test_a_sample_is_captured_by_keyboard_alone(
    browser: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(app, "simulated_material", small_material)
    with serving(tmp_path, shots=2) as service, opened(browser, service.address) as screen:
        screen.wait_for_selector("text=Everything is ready.")
        for title, name in (
            ("Ready", "Next: the sample"), ("Sample", "Next: the plan"),
            ("Plan", "Next: capture"), ("sample", "Capture"),
        ):  # fmt: skip
            screen.get_by_role("heading", name=title, level=1).wait_for()
            screen.locator("main").get_by_text(name, exact=True).wait_for()
            _press(screen, name)
        screen.wait_for_selector("text=2 of 2 shots", timeout=PATIENCE_MS)


def _press(screen: Any, name: str) -> None:
    """Tab as far as what has this name, within the screen, and press Enter."""
    focused = "(document.activeElement.closest('main') && document.activeElement.textContent) || ''"
    for _ in range(60):
        if screen.evaluate(focused) == name:
            screen.keyboard.press("Enter")
            return
        screen.keyboard.press("Tab")
    raise AssertionError(f"{name} cannot be reached by Tab.")


def test_the_door_asks_for_the_token(
    browser: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(app, "simulated_material", small_material)
    token = "a token that is long enough"
    with serving(tmp_path, Door(token)) as service, opened(browser, service.address) as screen:
        field = screen.get_by_label("Token")
        field.fill("a guess")
        field.press("Enter")
        screen.wait_for_selector("text=That is not the token")
        keep(screen, "door")
        field.fill(token)
        field.press("Enter")
        screen.wait_for_selector("text=Ready")
        screen.reload()
        screen.wait_for_selector("text=Everything is ready.")
        screen.get_by_role("navigation").get_by_role("link", name="Sessions").click()
        screen.wait_for_selector("text=Capture the first")
        keep(screen, "sessions-none")


def test_a_page_that_loses_its_connection_says_so_and_comes_back(
    browser: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(app, "simulated_material", small_material)
    with serving(tmp_path) as service:
        page = browser.new_page()
        page.set_default_timeout(PATIENCE_MS)
        page.goto(service.address)
        page.wait_for_selector("text=Ready")
    page.wait_for_selector("text=Not connected")
    with serving(tmp_path, port=service.port):
        page.wait_for_selector("#link:not(.lost)", state="attached")
        page.close()
