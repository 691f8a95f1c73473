"""Screens of the page: opened so that whatever goes wrong in them fails a test, and kept as pictures.

Screenshots of each screen are kept in tests/browser/screenshots.
"""

import contextlib
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

HERE = Path(__file__).parent
AXE = HERE.parents[1] / ".venv/lib/node_modules/axe-core/axe.min.js"
SCREENSHOTS = HERE / "screenshots"
SIZES = {390: 844, 1024: 768, 1920: 1080}
PATIENCE_MS = 180_000
FINGER_PX = 44
SMALL = """
(least) => [...document.querySelectorAll("a, button, input, select, summary")].filter((e) => {
  const target = e.closest("label") ?? e;
  const { width, height } = target.getBoundingClientRect();
  return e.checkVisibility() && getComputedStyle(e).display !== "inline" && !e.matches(".skip")
    && (height < least - 0.5 || width < least - 0.5);
}).map((e) => e.outerHTML.slice(0, 120))
"""

ALL_PICTURES = """
() => Promise.all([...document.images].filter((image) => image.hasAttribute("src")).map((image) => {
  image.loading = "eager";
  return image.complete || new Promise((done) => { image.onload = image.onerror = done; });
}))
"""


@contextlib.contextmanager
def opened(browser: Any, address: str) -> Iterator[Any]:
    """The page at this address; what goes wrong in it, or reaches elsewhere, fails the test."""
    context = browser.new_context(viewport={"width": 1024, "height": 768}, accept_downloads=True)
    context.set_default_timeout(PATIENCE_MS)
    page = context.new_page()
    wrong: list[str] = []
    page.on("pageerror", lambda error: wrong.append(str(error)))
    page.on(
        "request",
        lambda r: (
            None if address in r.url or r.url[:4] in ("data", "blob") else wrong.append(r.url)
        ),
    )
    page.goto(address)
    yield page
    context.close()
    assert not wrong


def until(screen: Any, holds: str) -> None:
    """`wait_for_function` without eval, which the page's policy forbids."""
    until_s = time.monotonic() + PATIENCE_MS / 1000
    while not screen.evaluate(holds):
        assert time.monotonic() < until_s, holds
        screen.wait_for_timeout(100)


def keep(screen: Any, name: str) -> None:
    """A screenshot at each size, light and dark; nothing too wide, nothing too small for a finger, and no
    serious violation by axe-core."""
    SCREENSHOTS.mkdir(exist_ok=True)
    screen.evaluate(ALL_PICTURES)
    assert AXE.exists(), "make test installs axe-core"
    for scheme in ("light", "dark"):
        screen.emulate_media(color_scheme=scheme)
        for width, height in SIZES.items():
            screen.set_viewport_size({"width": width, "height": height})
            screen.evaluate("scrollTo(0, 0)")
            screen.wait_for_timeout(150)
            screen.screenshot(
                path=SCREENSHOTS / f"{name}-{width}-{scheme}.png",
                full_page=True,
                animations="disabled",
            )
            beyond = screen.evaluate("document.documentElement.scrollWidth - innerWidth")
            assert beyond <= 0, f"{name} is {beyond} px too wide at {width}"
            small = screen.evaluate(SMALL, FINGER_PX)
            assert not small, (name, width, small)
        screen.set_viewport_size({"width": 1024, "height": 768})
        screen.evaluate(AXE.read_text())
        found = screen.evaluate("axe.run()")["violations"]
        bad = [v for v in found if v["impact"] in ("serious", "critical")]
        assert not bad, [
            (name, scheme, v["id"], [n["html"][:200] for n in v["nodes"][:3]]) for v in bad
        ]
    screen.emulate_media(color_scheme="light")
