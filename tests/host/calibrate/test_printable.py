from pathlib import Path

import cv2
import numpy as np
import pytest

from turnlight.app import DEFAULT_RIG
from turnlight.calibrate.printable import DPI, Sheet, sheets
from turnlight.calibrate.targets import Targets
from turnlight.config import RigConfig
from turnlight.picture.charuco import find_corners
from turnlight.picture.markers import find_markers

PER_MM = DPI / 25.4


@pytest.fixture(scope="module")
def config() -> RigConfig:
    return RigConfig.load(Path(DEFAULT_RIG)).calibrated(None)


@pytest.fixture(scope="module")
def printed(config: RigConfig) -> dict[str, Sheet]:
    return sheets(config, Targets())


def seen(sheet: Sheet, reduction: int) -> np.ndarray:
    height, width = (n // reduction for n in sheet.paper.shape)
    grey = cv2.resize(sheet.paper.astype(np.float32), (width, height), interpolation=cv2.INTER_AREA)
    return cv2.GaussianBlur(0.05 + 0.8 * grey, (0, 0), 1.0)


def test_the_boards_squares_are_as_large_as_they_say(printed: dict[str, Sheet]) -> None:
    found = find_corners(seen(printed["board"], 4))
    assert len(found.ids) == 36
    first, last = found.corners_px[[0, -1]]
    assert np.abs(last - first) * 4 / PER_MM == pytest.approx([60, 60], abs=0.05)


def test_the_platters_markers_are_where_the_rig_has_them(
    config: RigConfig, printed: dict[str, Sheet]
) -> None:
    sheet = printed["platter"]
    found = find_markers(seen(sheet, 4), config.platter, 14 * PER_MM / 4)
    assert found.ids.tolist() == list(range(8))
    middle = np.array(sheet.paper.shape[::-1]) / 2
    on_platter = (found.corners_px * 4 - middle) / PER_MM * [1, -1]
    np.testing.assert_allclose(on_platter, config.platter.marker_corners_mm(), atol=0.08)


def test_every_sheet_is_a_small_pdf_of_its_true_size(printed: dict[str, Sheet]) -> None:
    sizes = {name: np.array(sheet.paper.shape) / PER_MM for name, sheet in printed.items()}
    assert sizes["board"] == pytest.approx([297, 210], abs=0.1)
    assert sizes["platter"] == pytest.approx([420, 297], abs=0.1)
    for name, sheet in printed.items():
        pdf = sheet.pdf()
        assert pdf.startswith(b"%PDF")
        assert len(pdf) < 200_000
        shipped = Path(DEFAULT_RIG).parent / f"targets/{name}.pdf"
        assert shipped.exists()
