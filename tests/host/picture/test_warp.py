import cv2
import numpy as np
import pytest

from turnlight.picture.warp import Image, warp


def scaling(factor: float) -> np.ndarray:
    return np.diag([factor, factor, 1.0])


def fine_stripes(size: int) -> Image:
    """Smooth waves plus stripes too fine for a reduction by four."""
    x = np.arange(size, dtype=np.float32)
    wave = 0.5 + 0.3 * np.sin(x / size * 20)[None] * np.cos(x / size * 17)[:, None]
    return (wave + 0.2 * (-1) ** np.arange(size)[None]).astype(np.float32)


def test_identity_changes_nothing() -> None:
    image = fine_stripes(64)
    np.testing.assert_allclose(warp(image, scaling(1), 64, 64), image, atol=1e-6)


@pytest.mark.parametrize("factor", [2, 4, 8, 16])
def test_reduction_averages(factor: int) -> None:
    image = fine_stripes(512)
    small = 512 // factor
    expected = cv2.resize(image, (small, small), interpolation=cv2.INTER_AREA)
    np.testing.assert_allclose(warp(image, scaling(1 / factor), small, small), expected, atol=2e-3)


def test_enlargement_keeps_the_place() -> None:
    ramp = np.tile((np.arange(32, dtype=np.float32) + 0.5) / 32, (32, 1))
    expected = (np.arange(320) + 0.5) / 320
    result = warp(ramp, scaling(10), 320, 320)[160]
    np.testing.assert_allclose(result[5:-5], expected[5:-5], atol=2e-3)


def test_the_border_extends_outward() -> None:
    image = np.full((8, 8, 3), 0.25, np.float32)
    shifted = np.array([[1.0, 0, 20], [0, 1, 0], [0, 0, 1]])
    np.testing.assert_allclose(warp(image, shifted, 8, 8), 0.25)


def test_perspective_reduction_is_within_40_db_of_brute_force() -> None:
    image = fine_stripes(1200)
    tilted = np.array([[0.2, 0.03, -30], [0.01, 0.17, -10], [0, 1.2e-4, 1]])
    brute = scaling(24) @ tilted
    shift = np.array([[1.0, 0, 0.5], [0, 1, 0.5], [0, 0, 1]])
    centred = np.linalg.inv(shift) @ brute @ shift
    fine = cv2.warpPerspective(
        image, centred, (128 * 24, 128 * 24), borderMode=cv2.BORDER_REPLICATE
    )
    expected = cv2.resize(fine, (128, 128), interpolation=cv2.INTER_AREA)
    error = (warp(image, tilted, 128, 128) - expected)[12:-12, 12:-12]
    assert -10 * np.log10(np.mean(error**2)) > 40
