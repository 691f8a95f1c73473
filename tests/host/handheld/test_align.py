import cv2
import numpy as np
import pytest

from svbrdf.maps import Maps
from svbrdf.procedural import TEST_SEEDS, material
from svbrdf.renderer import render
from turnlight.handheld.align import features, misalignment

RESOLUTION = 512
LEFT, RIGHT, ABOVE = ((-3.0, 0.5, 3.0), (2.5, 1.5, 2.5), (0.2, 0.1, 4.0))


def seen(maps: Maps, light: tuple[float, float, float], shift: tuple[float, float]) -> np.ndarray:
    """By flash, as large as the network's picture twice over; shifted to the right and down."""
    place = np.array(light, np.float32)
    image = render(maps, place, place, np.float32(np.pi))
    move = np.array([[1, 0, shift[0]], [0, 1, shift[1]]], dtype=float)
    moved = cv2.warpAffine(image, move, (RESOLUTION,) * 2, borderMode=cv2.BORDER_REFLECT)
    noise = np.random.default_rng(0).normal(0, 0.004, moved.shape)
    return np.asarray(moved + noise, np.float32)


@pytest.mark.parametrize("seed", TEST_SEEDS[10:15])
def test_relief_that_is_lit_from_two_sides_stays_where_it_is(seed: int) -> None:
    maps = material(seed, RESOLUTION)
    reference = features(seen(maps, ABOVE, (0, 0)))
    for light in (LEFT, RIGHT):
        assert not misalignment(reference, features(seen(maps, light, (0, 0)))).any()


def test_a_sample_that_lies_lower_is_moved_into_place() -> None:
    maps = material(TEST_SEEDS[3], RESOLUTION)
    reference = features(seen(maps, ABOVE, (0, 0)))
    shift = misalignment(reference, features(seen(maps, RIGHT, (4.3, -2.6))))
    assert shift == pytest.approx([4.3, -2.6], abs=0.4)


def test_pictures_with_nothing_in_common_are_left_alone() -> None:
    one, other = (
        features(seen(material(seed, RESOLUTION), ABOVE, (0, 0))) for seed in TEST_SEEDS[:2]
    )
    assert not misalignment(one, other).any()
