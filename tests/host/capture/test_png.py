"""A frame as PNG is read by others as it was, and is no larger than a general packer makes it."""

import io
import zlib

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


@pytest.mark.parametrize("top", [1, 2, 255, 256, 4095, 65535])
def test_any_range_of_values_comes_back(top: int) -> None:
    random = np.random.default_rng(top)
    rare = (
        random.random((130, 90, 3)) ** 8
    )  # mostly dark, so that some bytes are far rarer than others
    pixels = np.rint(rare * top).astype(np.uint16)
    read = cv2.imdecode(np.frombuffer(b"".join(encode16(pixels)), np.uint8), cv2.IMREAD_UNCHANGED)
    assert np.array_equal(read[..., ::-1], pixels)


def test_a_part_of_a_frame_is_written_as_it_is_seen() -> None:
    whole = np.random.default_rng(0).integers(0, 4096, (60, 80, 3), dtype=np.uint16)
    part = whole[10:50, 5:70]
    read = cv2.imdecode(np.frombuffer(b"".join(encode16(part)), np.uint8), cv2.IMREAD_UNCHANGED)
    assert np.array_equal(read[..., ::-1], part)


def test_a_sensors_noise_takes_no_more_than_a_packer_that_looks_for_repeats() -> None:
    random = np.random.default_rng(0)
    scene = 2000 + 1000 * np.sin(np.arange(400) / 60)[:, None, None]
    pixels = np.rint(scene + random.normal(0, 15, (400, 300, 3))).astype(np.uint16)
    rows = pixels.astype(">u2").view(np.uint8).reshape(400, -1)
    less_left = np.concatenate([rows[:, :6], rows[:, 6:] - rows[:, :-6]], axis=1)
    assert len(b"".join(encode16(pixels))) < 1.01 * len(zlib.compress(less_left.tobytes(), 1))
