"""The contact sheet has a place for every number of pictures, and shows what the maps were."""

import numpy as np
import pytest

from svbrdf.maps import flat
from turnlight.capture.contact_sheet import ContactSheet
from turnlight.capture.relight import relit, shown
from turnlight.picture.picture import Picture


def sheet_of(count: int) -> ContactSheet:
    sheet = ContactSheet("oak")
    for number in range(count):
        image = np.full((64, 64, 3), 0.9, np.float32)
        everywhere = np.ones((64, 64), bool)
        picture = Picture(image, 1.0, everywhere, ~everywhere)
        sheet.add(picture, flat(32, 32, albedo=number / count))
    return sheet


@pytest.mark.parametrize(
    ("count", "steps"),
    [(1, [1]), (2, [1, 2]), (4, [1, 2, 4]), (10, [1, 2, 5, 10]), (23, [1, 2, 5, 10, 23])],
)
def test_the_maps_after_1_2_5_10_and_the_last_are_kept(count: int, steps: list[int]) -> None:
    sheet = sheet_of(count)
    assert list(sheet.history) == steps
    image = sheet.draw()
    assert image.dtype == np.uint8
    assert 800 < image.shape[0] < 2400
    assert 1400 < image.shape[1] < 2400
    assert (image > 200).mean() > 0.01


def test_a_white_sheet_relit_is_white_below_the_light() -> None:
    white = relit(flat(64, 64, albedo=1.0, roughness=1.0), (0.0, 0.0, 3.0))
    assert 240 < white[32, 32].min() <= 255
    assert white[0, 0].max() < white[32, 32].min()


def test_the_light_comes_from_the_side_it_is_on() -> None:
    from_upper_left = relit(flat(64, 64)).astype(int).sum(axis=-1)
    assert from_upper_left[0, 0] > from_upper_left[0, 63] > from_upper_left[63, 63]


def test_maps_are_shown_as_is_customary() -> None:
    images = shown(flat(4, 4, albedo=0.5, roughness=0.5))
    assert images["Normal"][0, 0].tolist() == [128, 128, 255]
    assert images["Roughness"][0, 0].tolist() == [128, 128, 128]
    assert images["Diffuse"][0, 0, 0] == round(255 * 0.5 ** (1 / 2.2))
