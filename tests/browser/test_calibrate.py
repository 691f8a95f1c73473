"""Calibrating on the page: what to lay out, a live picture, a verdict with its figures, and a stop."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from browser.screens import keep, opened, until
from web_service import Served, Shutter, serving, small_material

from turnlight import app

FEW_PX = 507
"""Too few for the geometry to be known as well as it has to be."""
pytestmark = pytest.mark.timeout(600)


@pytest.fixture
def shutter(monkeypatch: pytest.MonkeyPatch) -> Iterator[Shutter]:
    held = Shutter(monkeypatch)
    yield held
    held.release()


@pytest.fixture
def served(tmp_path: Path, shutter: Shutter, monkeypatch: pytest.MonkeyPatch) -> Iterator[Served]:
    monkeypatch.setattr(app, "simulated_material", small_material)
    with serving(tmp_path, width_px=FEW_PX) as service:
        yield service
        shutter.release()


def test_a_technician_calibrates(browser: Any, served: Served, shutter: Shutter) -> None:
    with opened(browser, served.address) as screen:
        screen.wait_for_selector("text=Nothing has been measured")
        screen.get_by_role("link", name="Calibrate").click()
        screen.wait_for_selector("text=Take everything off the platter")
        keep(screen, "calibrate")
        screen.get_by_role("button", name="Measure: Dark").click()
        screen.wait_for_selector(".step.passed")
        screen.get_by_role("button", name="Measure: Camera and table").click()
        screen.wait_for_selector(".step.failed")
        screen.wait_for_selector("text=did not pass")
        shutter.hold(lambda: served.desk.calibrator.now.picture >= 3)
        screen.get_by_role("button", name="Measure: Where the LEDs are").click()
        screen.wait_for_selector("text=/Frame [0-9]+ of 144/")
        until(screen, "document.querySelector('.bench .view img').naturalWidth > 0")
        keep(screen, "calibrating")
        screen.get_by_role("button", name="Stop now").click()
        served.wait_for(lambda: served.desk.calibrator.stopping)
        shutter.release()
        screen.wait_for_selector("text=Stopped; nothing has changed.")
        keep(screen, "calibrated")
        screen.get_by_role("navigation").get_by_role("link", name="Ready").click()
        screen.wait_for_selector("text=4 of 5 steps are still to be done")
