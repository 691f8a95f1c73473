from pathlib import Path

import cv2
import numpy as np
import pytest

from turnlight.config import PlatterConfig, RigConfig
from turnlight.picture.markers import draw_platter, find_markers
from turnlight.picture.warp import Image

ROOT = Path(__file__).parents[3]


def platter(dictionary: str = "DICT_APRILTAG_36h11") -> PlatterConfig:
    config = RigConfig.load(ROOT / "rig_config/simulated.toml").platter
    return config.model_copy(update={"dictionary": dictionary})


def corners_in_drawing(target: PlatterConfig, pixels_per_mm: float) -> np.ndarray:
    corners = target.marker_corners_mm()
    return (corners * [1, -1] + target.radius_mm) * pixels_per_mm


@pytest.mark.parametrize("dictionary", ["DICT_APRILTAG_36h11", "DICT_4X4_50"])
@pytest.mark.parametrize("pixels_per_mm", [3.0, 10.0])
def test_the_drawing_is_found_where_the_config_says(dictionary: str, pixels_per_mm: float) -> None:
    target = platter(dictionary)
    drawing = draw_platter(target, target.marker_corners_mm(), pixels_per_mm)
    found = find_markers(drawing, target, target.marker_side_mm * pixels_per_mm)
    assert list(found.ids) == list(range(8))
    miss = found.corners_px - corners_in_drawing(target, pixels_per_mm)
    assert np.abs(miss).max() < 0.05


def test_the_drawing_holds_the_same_ink_at_any_resolution() -> None:
    target = platter()
    ink = [
        (1 - draw_platter(target, target.marker_corners_mm(), scale)).sum() / scale**2
        for scale in (2.0, 3.7, 11.0)
    ]
    assert ink == pytest.approx([ink[0]] * 3, rel=0.005)


def blurred(image: Image, sigma: float) -> Image:
    return np.asarray(cv2.GaussianBlur(image, (0, 0), sigma), np.float32)


def test_blur_moves_no_corner() -> None:
    target = platter()
    found = find_markers(
        blurred(draw_platter(target, target.marker_corners_mm(), 6.0), 1.0), target, 84.0
    )
    miss = found.corners_px - corners_in_drawing(target, 6.0)
    assert len(found.ids) == 8
    assert np.abs(miss).max() < 0.05


@pytest.mark.parametrize("brightness", [1.0, 0.02])
def test_noise_at_any_brightness_hides_no_marker(brightness: float) -> None:
    target = platter()
    photons = np.random.default_rng(0).poisson(
        draw_platter(target, target.marker_corners_mm(), 4.0) * 10_000 * brightness
    )
    found = find_markers((photons / 10_000).astype(np.float32), target, 56.0)
    assert len(found.ids) == 8


def test_other_markers_of_the_dictionary_are_no_concern() -> None:
    target = platter("DICT_4X4_50")
    drawing = draw_platter(target, target.marker_corners_mm(), 4.0)
    dictionary = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_50)
    drawing[400:460, 400:460] = cv2.aruco.generateImageMarker(dictionary, 30, 60) / 255.0
    assert list(find_markers(drawing, target, 56.0).ids) == list(range(8))


def test_a_blank_image_has_none() -> None:
    for level in (0.0, 0.5):
        blank = np.full((300, 300), level, np.float32)
        found = find_markers(blank, platter(), 48.0)
        assert found.ids.shape == (0,)
        assert found.corners_px.shape == (0, 4, 2)
