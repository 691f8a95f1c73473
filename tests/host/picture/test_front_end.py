import cv2
import numpy as np
import pytest

from turnlight.picture.front_end import network_input
from turnlight.picture.picture import Picture


def picture(image: np.ndarray, gain: float = 1.0) -> Picture:
    everywhere = np.ones(image.shape[:2], dtype=bool)
    return Picture(image.astype(np.float32), gain, everywhere, ~everywhere)


def random_image(resolution: int) -> np.ndarray:
    return np.random.default_rng(0).random((resolution, resolution, 3), np.float32)


def test_eight_bit_pictures_come_back_bit_for_bit() -> None:
    bits = np.random.default_rng(0).integers(0, 256, (256, 256, 3), np.uint8)
    linear = (bits.astype(np.float32) / 255) ** 2.2
    np.testing.assert_array_equal(network_input(picture(linear)), bits)


def test_gain_is_applied_before_clipping() -> None:
    grey = np.full((256, 256, 3), 0.25)
    assert (network_input(picture(grey, 2.0)) == round(255 * 0.5 ** (1 / 2.2))).all()
    assert (network_input(picture(grey, 5.0)) == 255).all()


@pytest.mark.parametrize("resolution", [512, 1024])
def test_reduction_averages_linear_light(resolution: int) -> None:
    image = random_image(resolution)
    block = resolution // 256
    mean = image.reshape(256, block, 256, block, 3).mean(axis=(1, 3))
    expected = 255 * mean ** (1 / 2.2)
    assert np.abs(network_input(picture(image)) - expected).max() <= 0.501


@pytest.mark.parametrize("resolution", [16, 100, 255, 257, 3000])
def test_any_resolution_becomes_the_networks(resolution: int) -> None:
    image = cv2.resize(random_image(8), (resolution, resolution), interpolation=cv2.INTER_CUBIC)
    image = np.clip(image, 0, 1)
    result = network_input(picture(image))
    assert result.shape == (256, 256, 3)
    assert result.dtype == np.uint8
    assert result.mean() == pytest.approx(255 * (image ** (1 / 2.2)).mean(), abs=2)


def test_the_same_picture_gives_the_same_bits() -> None:
    image = picture(random_image(700), 1.3)
    np.testing.assert_array_equal(network_input(image), network_input(image))


def test_another_resolution_can_be_asked_for() -> None:
    assert network_input(picture(random_image(256)), 128).shape == (128, 128, 3)
