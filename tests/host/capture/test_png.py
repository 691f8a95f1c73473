"""A frame as PNG is read by others as it was."""

import io

import cv2
import numpy as np
import pytest
from PIL import Image

from turnlight.capture.png import encode16


@pytest.mark.parametrize("shape", [(30, 41, 3), (1, 1, 3), (64, 1, 3), (150, 70, 3)])
def test_others_read_what_was_written(shape: tuple[int, ...]) -> None:
    pixels = np.random.default_rng(0).integers(0, 1 << 16, shape, dtype=np.uint16)
    png = b"".join(encode16(pixels))
    read = cv2.imdecode(np.frombuffer(png, np.uint8), cv2.IMREAD_UNCHANGED)
    assert read.dtype == np.uint16
    assert np.array_equal(read[..., ::-1], pixels)
    with Image.open(io.BytesIO(png)) as image:
        image.load()  # checks every chunk's checksum
        assert image.size == (shape[1], shape[0])
    assert b"".join(encode16(pixels.copy())) == png
