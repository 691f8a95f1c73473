"""How much of the others' fine detail a picture shows, by light from different sides."""

import cv2
import numpy as np

from turnlight.handheld.sharpness import Bands, bands, detail

SIDE = 256


def relief(angle: float) -> np.ndarray:
    """(n, n, 3): fine relief on a coarse pattern that is painted, lit from a side."""
    random = np.random.default_rng(0)
    height = cv2.GaussianBlur(random.normal(size=(SIDE, SIDE)), (0, 0), 1.0)
    down, right = np.gradient(height / height.std())
    paint = cv2.GaussianBlur(random.normal(size=(SIDE, SIDE)), (0, 0), 5.0)
    logs = 0.5 * paint / paint.std() + 0.3 * (np.cos(angle) * right + np.sin(angle) * down)
    return np.repeat(0.2 * np.exp(logs)[..., None], 3, axis=-1).astype(np.float32)


def seen(angle: float, blur: float = 0.0) -> Bands:
    image = relief(angle)
    return bands(cv2.GaussianBlur(image, (0, 0), blur) if blur else image)


def test_relief_lit_from_the_other_side_is_as_sharp() -> None:
    share = detail(seen(np.pi), [seen(0.0), seen(0.2)])
    assert share is not None
    assert share > 0.7


def test_a_blurred_picture_shows_less() -> None:
    for angle in (0.1, np.pi):
        share = detail(seen(angle, blur=2.0), [seen(0.0), seen(0.2)])
        assert share is not None
        assert share < 0.4


def test_nothing_is_said_of_pictures_that_have_nothing_in_common() -> None:
    noise = np.random.default_rng(1).uniform(size=(SIDE, SIDE, 3)).astype(np.float32)
    assert detail(seen(0.0), [bands(noise)]) is None
