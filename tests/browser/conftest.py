"""Debian's Chromium with WebGL2 on its software renderer."""

import shutil
from collections.abc import Iterator
from typing import Any

import pytest

CHROMIUM = shutil.which("chromium")
SOFTWARE = ["--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]


@pytest.fixture(scope="session")
def browser() -> Iterator[Any]:
    assert CHROMIUM, (
        "Chromium is not installed; .ci/debian-packages installs it, and make test runs that"
    )
    from playwright.sync_api import sync_playwright

    with sync_playwright() as playwright:
        chromium = playwright.chromium.launch(
            executable_path=CHROMIUM, args=[*SOFTWARE, "--no-sandbox"]
        )
        yield chromium
        chromium.close()


@pytest.fixture
def page(browser: Any) -> Iterator[Any]:
    """A page of its own; what goes wrong in it, or reaches out of it, fails the test."""
    context = browser.new_context(
        viewport={"width": 900, "height": 700}, reduced_motion="reduce", device_scale_factor=1
    )
    context.set_default_timeout(60_000)
    page = context.new_page()
    wrong: list[str] = []
    page.on("pageerror", lambda error: wrong.append(str(error)))
    page.on(
        "console", lambda message: wrong.append(message.text) if message.type == "error" else None
    )
    page.on(
        "request", lambda r: None if r.url[:4] in ("file", "data", "blob") else wrong.append(r.url)
    )
    yield page
    context.close()
    assert not wrong
