import cv2
import numpy as np
import pytest

from turnlight.calibrate.colour import delta_e00, fit_colour, lab, read_chart
from turnlight.errors import CalibrationError
from turnlight.picture.chart import patch_numbers, patch_reflectances
from turnlight.simulation import spectra

# Sharma, Wu, Dalal: The CIEDE2000 color-difference formula, 2005, table 1 (pairs 1, 4, 7, 9, 13, 17, 25, 33)
SHARMA = [
    ((50.0, 2.6772, -79.7751), (50.0, 0.0, -82.7485), 2.0425),
    ((50.0, -1.3802, -84.2814), (50.0, 0.0, -82.7485), 1.0000),
    ((50.0, 0.0, 0.0), (50.0, -1.0, 2.0), 2.3669),
    ((50.0, 2.49, -0.001), (50.0, -2.49, 0.0009), 7.1792),
    ((50.0, -0.001, 2.49), (50.0, 0.0009, -2.49), 4.8045),
    ((50.0, 2.5, 0.0), (73.0, 25.0, -18.0), 27.1492),
    ((60.2574, -34.0099, 36.2677), (60.4626, -34.1751, 39.4387), 1.2644),
    ((6.7747, -0.2908, -2.4247), (5.8714, -0.0985, -2.2286), 0.6377),
]


@pytest.mark.parametrize(("first", "second", "expected"), SHARMA)
def test_delta_e00_is_the_published_one(
    first: tuple[float, ...], second: tuple[float, ...], expected: float
) -> None:
    assert delta_e00(np.array(first), np.array(second)) == pytest.approx(expected, abs=1e-4)
    assert delta_e00(np.array(second), np.array(first)) == pytest.approx(expected, abs=1e-4)


def test_white_has_no_colour() -> None:
    np.testing.assert_allclose(lab(np.ones(3)), [100, 0, 0], atol=0.01)


@pytest.mark.parametrize("warmth", [0.0, 0.5, 1.0])
def test_real_spectra_are_corrected_to_within_the_limit(warmth: float) -> None:
    judged = fit_colour(spectra.patch_readings(spectra.led(warmth)))
    assert judged.colour.delta_e00_mean < 1.5
    assert judged.delta_e00.shape == (24,)
    np.testing.assert_allclose(np.sum(judged.colour.matrix, axis=1), 1)


def test_a_camera_that_sees_srgb_needs_no_correction() -> None:
    seen = np.clip(patch_reflectances(), 0, 1)
    judged = fit_colour(seen)
    np.testing.assert_allclose(judged.colour.matrix, np.eye(3), atol=0.02)
    assert judged.colour.delta_e00_mean < 0.3


@pytest.mark.parametrize("turns", [0, 1, 2, 3])
def test_the_chart_is_read_whichever_way_it_lies(turns: int) -> None:
    colours = np.clip(patch_reflectances(), 0, 1)
    numbers = patch_numbers(100.0, 512)
    image = np.concatenate([colours, [[0.6] * 3, [0.03] * 3]])[numbers].astype(np.float32)
    image = cv2.GaussianBlur(np.rot90(image, turns).copy(), (0, 0), 1.0)
    np.testing.assert_allclose(read_chart(image), colours, atol=0.01)


def test_no_chart_is_one_clear_sentence() -> None:
    with pytest.raises(CalibrationError, match="chart was not found"):
        read_chart(np.full((256, 256, 3), 0.5, np.float32))
