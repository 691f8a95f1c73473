"""The page as a technician uses it: from ready to an export, on three sizes of screen, and for everyone.

Screenshots of each screen are kept in tests/browser/screenshots.
"""

import base64
import re
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from browser import relit_in_numpy
from web_service import Served, serving, small_material

from svbrdf import materials
from turnlight import app
from turnlight.frame import Exposure, Frame
from turnlight.simulation.camera import SimulatedCamera

HERE = Path(__file__).parent
AXE = HERE.parents[1] / ".venv/lib/node_modules/axe-core/axe.min.js"
SCREENSHOTS = HERE / "screenshots"
SIZES = {390: 844, 1024: 768, 1920: 1080}
SHOTS = 10
PATIENCE_MS = 180_000
pytestmark = pytest.mark.timeout(900)

READ = """
() => {
  const gl = document.querySelector(".stage canvas").getContext("webgl2");
  const [w, h] = [gl.drawingBufferWidth, gl.drawingBufferHeight];
  const pixels = new Uint8Array(w * h * 4);
  gl.readPixels(0, 0, w, h, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
  let text = "";
  for (let i = 0; i < pixels.length; i += 8192) text += String.fromCharCode(...pixels.subarray(i, i + 8192));
  return [w, h, btoa(text)];
}
"""


@pytest.fixture(scope="module")
def served(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Served]:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(app, "simulated_material", small_material)
        patch.setattr(SimulatedCamera, "capture", _as_slow_as_a_rig(SimulatedCamera.capture))
        with serving(tmp_path_factory.mktemp("page"), shots=SHOTS) as service:
            yield service


def _as_slow_as_a_rig(capture: Callable[..., Frame]) -> Callable[..., Frame]:
    """Virtual time would end the run before a button is found."""

    def slow(camera: SimulatedCamera, exposure: Exposure) -> Frame:
        time.sleep(0.5)
        return capture(camera, exposure)

    return slow


@pytest.fixture(scope="module")
def screen(browser: Any, served: Served) -> Iterator[Any]:
    """A page of the service; what goes wrong in it, or reaches elsewhere, fails the tests."""
    context = browser.new_context(viewport={"width": 1024, "height": 768}, accept_downloads=True)
    context.set_default_timeout(PATIENCE_MS)
    page = context.new_page()
    wrong: list[str] = []
    page.on("pageerror", lambda error: wrong.append(str(error)))
    page.on(
        "request",
        lambda r: (
            None
            if served.address in r.url or r.url[:4] in ("data", "blob")
            else wrong.append(r.url)
        ),
    )
    page.goto(served.address)
    yield page
    context.close()
    assert not wrong


def test_a_technicians_day(screen: Any, served: Served, tmp_path: Path) -> None:
    _ready_sample_frame_and_plan(screen, served)
    _capture(screen, served)
    _result(screen, served, tmp_path)
    _sessions(screen)


def _ready_sample_frame_and_plan(screen: Any, served: Served) -> None:
    screen.wait_for_selector("text=Everything is ready.")
    assert screen.locator(".lights .ok").count() == 5
    _keep(screen, "ready")
    screen.get_by_role("link", name="Next: the sample").click()
    screen.get_by_label("Name").fill("Oak, oiled")
    screen.get_by_label("Barcode").fill("4006381333931")
    screen.get_by_label("Operator").fill("Mo")
    _keep(screen, "sample")
    screen.get_by_role("button", name="Next: the plan").click()
    screen.wait_for_selector(".diagram")
    assert served.get("/api/sample")["operator"] == "Mo"
    _keep(screen, "plan")
    screen.get_by_role("link", name="Frame").click()
    screen.wait_for_selector("text=8 seen")
    _keep(screen, "frame")


def _capture(screen: Any, served: Served) -> None:
    screen.get_by_role("navigation").get_by_role("link", name="Capture").click()
    screen.get_by_role("button", name="Capture").wait_for()
    screen.wait_for_selector("text=10 shots")
    _keep(screen, "capture-start")
    screen.get_by_role("button", name="Capture").click()
    normal = screen.get_by_alt_text("normal map")
    _until(screen, "document.querySelectorAll('.chip.good, .chip.fair, .chip.poor').length >= 1")
    _until(screen, "document.querySelector('.maps img').src.includes('/maps/')")
    first = normal.get_attribute("src")
    screen.get_by_role("button", name="Pause").click()
    screen.wait_for_selector("text=Paused")
    _until(screen, "() => document.querySelector('.stage canvas').dataset.light")
    stage = screen.locator(".stage canvas")
    stage.scroll_into_view_if_needed()
    dark = screen.evaluate(READ)[2]
    box = stage.bounding_box()
    screen.mouse.move(box["x"] + 40, box["y"] + 40)
    screen.mouse.down()
    screen.mouse.move(box["x"] + box["width"] - 60, box["y"] + 60, steps=4)
    screen.mouse.up()
    screen.wait_for_timeout(500)
    assert screen.evaluate(READ)[2] != dark, "the light that was dragged lights the material"
    _keep(screen, "capture")
    before = len(served.desk.engine.current.shots)
    screen.get_by_role("button", name="Go on").click()
    served.wait_for(lambda: len(served.desk.engine.current.shots) > before)
    _until(screen, f"() => document.querySelector('.maps img').src !== '{first}'")
    screen.get_by_role("button", name="Stop now").click()
    screen.wait_for_selector("text=shots are safe")
    _keep(screen, "interrupted")
    screen.get_by_role("button", name="Resume").click()
    screen.wait_for_selector("text=How the maps grew", timeout=PATIENCE_MS)
    assert len(served.desk.engine.current.shots) == SHOTS


def _result(screen: Any, served: Served, tmp_path: Path) -> None:
    _until(screen, "[...document.querySelectorAll('.growth img')].every(i => i.complete)")
    _until(screen, "document.querySelector('.stage canvas').dataset.light")
    screen.wait_for_timeout(500)
    _agrees_with_numpy(screen, served)
    _tilted(screen, served)
    screen.get_by_role("button", name="1", exact=True).click()
    screen.wait_for_timeout(500)
    _keep(screen, "result")
    screen.get_by_role("link", name="Export").click()
    _keep(screen, "export")
    screen.get_by_text("glTF").click()
    with screen.expect_download() as waiting:
        screen.get_by_role("button", name="Export").click()
    waiting.value.save_as(tmp_path / "it.glb")
    assert (tmp_path / "it.glb").read_bytes()[:4] == b"glTF"
    screen.get_by_role("link", name="Back").click()
    screen.get_by_role("button", name="Take again: shot 2").click()
    screen.wait_for_selector("text=Shot 2 will be taken again.")
    served.wait_for(lambda: served.get("/api/run")["now"]["state"] != "idle")
    served.wait_for(lambda: served.get("/api/run")["now"]["state"] == "idle", 100)
    (folder,) = served.root.glob("Oak*")
    assert (folder / "shots/001-2.png").exists()


def _tilted(screen: Any, served: Served) -> None:
    """The view is turned by dragging and by keys; the renderer agrees from there too."""
    screen.get_by_role("button", name="view", exact=True).click()
    stage = screen.locator(".stage canvas")
    _until(screen, "Number(document.querySelector('.stage canvas').dataset.tilt) > 0.5")
    _agrees_with_numpy(screen, served)
    before = stage.get_attribute("data-turn")
    stage.scroll_into_view_if_needed()
    box = stage.bounding_box()
    screen.mouse.move(box["x"] + 200, box["y"] + 200)
    screen.mouse.down()
    screen.mouse.move(box["x"] + 120, box["y"] + 180, steps=4)
    screen.mouse.up()
    _until(screen, f"document.querySelector('.stage canvas').dataset.turn !== '{before}'")
    stage.press("ArrowDown")
    screen.wait_for_timeout(300)
    _agrees_with_numpy(screen, served)
    _keep(screen, "result-tilted")
    screen.get_by_role("button", name="light", exact=True).click()
    screen.get_by_role("button", name="From above").click()
    _until(screen, "document.querySelector('.stage canvas').dataset.tilt === '0'")


def _sessions(screen: Any) -> None:
    screen.get_by_role("navigation").get_by_role("link", name="Sessions").click()
    screen.get_by_label("Search").fill("4006381333931")
    screen.wait_for_selector("text=1 session")
    _keep(screen, "sessions")
    screen.get_by_role("button", name=re.compile("Delete Oak")).click()
    screen.wait_for_selector("text=0 sessions")
    screen.get_by_role("button", name="Undo").click()
    screen.wait_for_selector("text=1 session")


def _agrees_with_numpy(screen: Any, served: Served) -> None:
    """Within 2/255 on 99 % of the pixels."""
    size, _, text = screen.evaluate(READ)
    told = screen.locator(".stage canvas").evaluate("c => ({...c.dataset})")
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


def _until(screen: Any, holds: str) -> None:
    """`wait_for_function` without eval, which the page's policy forbids."""
    until_s = time.monotonic() + PATIENCE_MS / 1000
    while not screen.evaluate(holds):
        assert time.monotonic() < until_s, holds
        screen.wait_for_timeout(100)


def _keep(screen: Any, name: str) -> None:
    """A screenshot at each size, and no serious violation by axe-core."""
    SCREENSHOTS.mkdir(exist_ok=True)
    for width, height in SIZES.items():
        screen.set_viewport_size({"width": width, "height": height})
        screen.wait_for_timeout(150)
        screen.screenshot(
            path=SCREENSHOTS / f"{name}-{width}.png", full_page=width < 1000, animations="disabled"
        )
        beyond = screen.evaluate("document.documentElement.scrollWidth - innerWidth")
        assert beyond <= 0, f"{name} is {beyond} px too wide at {width}"
    screen.set_viewport_size({"width": 1024, "height": 768})
    assert AXE.exists(), "make test installs axe-core"
    for scheme in ("light", "dark"):
        screen.emulate_media(color_scheme=scheme)
        screen.evaluate(AXE.read_text())
        found = screen.evaluate("axe.run()")["violations"]
        bad = [v for v in found if v["impact"] in ("serious", "critical")]
        assert not bad, [
            (name, scheme, v["id"], [n["html"][:200] for n in v["nodes"][:3]]) for v in bad
        ]
    screen.screenshot(path=SCREENSHOTS / f"{name}-1024-dark.png")
    screen.emulate_media(color_scheme="light")


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
