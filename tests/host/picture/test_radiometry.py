"""Blocks of a frame, averaged in linear light."""

import numpy as np
import pytest

from turnlight.frame import Exposure, Frame
from turnlight.picture.radiometry import averaged, clipped, linear


def frame(height: int, width: int) -> Frame:
    pixels = np.random.default_rng(0).integers(0, 1100, (height, width, 3), dtype=np.uint16)
    return Frame(np.minimum(pixels, 1023), 10, 2.2, Exposure(10_000, 1.0), 0)


@pytest.mark.parametrize("side", [1, 2, 4])
def test_blocks_are_the_means_of_the_light_of_their_pixels(side: int) -> None:
    seen = frame(41, 30)
    part = seen.pixels[3:38, 2:29]
    blocks = averaged(seen, part, side)
    rows, columns = part.shape[0] // side, part.shape[1] // side
    assert blocks.shape == (rows, columns, 4)
    light, full = linear(seen, part), clipped(seen, part)[..., None]
    both = np.concatenate([light, full], axis=-1)[: rows * side, : columns * side]
    means = both.reshape(rows, side, columns, side, 4).mean(axis=(1, 3))
    np.testing.assert_allclose(blocks, means, atol=1e-6)
