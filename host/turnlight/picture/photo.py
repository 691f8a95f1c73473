"""Pictures from photographs that are already rectified and square."""

from pathlib import Path

import cv2
import numpy as np

from turnlight.errors import ImageError
from turnlight.picture.picture import Picture

GAMMA = 2.2
SMALLEST_PX = 16
MOST_PIXELS = 100_000_000
PNG_SIGNATURE = b"\x89PNG\r\n\x1a\n"
JPEG_SIGNATURE = b"\xff\xd8"
FRAME_HEADERS = frozenset(range(0xC0, 0xD0)) - {0xC4, 0xC8, 0xCC}
SCAN_HEADER = 0xDA


def load_aligned(path: Path) -> Picture:
    """Read a square JPEG or PNG of 8 or 16 bits, row 0 the sample's top, as a Picture of gain 1.

    Decoded with gamma 2.2 to linear RGB; EXIF rotation is honoured, alpha dropped, grey repeated.
    Raises ImageError when the file is missing, damaged, no such image, too small, too large, or not
    square.
    """
    try:
        data = path.read_bytes()
    except FileNotFoundError as error:
        raise ImageError(f"There is no file {path}; check the name.") from error
    except OSError as error:
        raise ImageError(f"{path} cannot be read: {error.strerror}.") from error
    width, height = _size(data, path)
    if min(width, height) < SMALLEST_PX:
        raise ImageError(
            f"{path} is {width}x{height} pixels; use a picture of at least "
            f"{SMALLEST_PX}x{SMALLEST_PX}."
        )
    if width * height > MOST_PIXELS:
        raise ImageError(
            f"{path} has {width}x{height} pixels, more than the limit of "
            f"{MOST_PIXELS // 1_000_000} million; reduce it first."
        )
    if width != height:
        raise ImageError(
            f"{path} is {width}x{height} pixels and not square; crop it square to the sample."
        )
    bits = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_ANYDEPTH | cv2.IMREAD_COLOR)
    if bits is None:
        raise ImageError(f"{path} is damaged; copy it again or take another.")
    full_scale = 255 if bits.dtype == np.uint8 else 65535
    coded = np.asarray(bits[..., ::-1], np.float32) / full_scale
    linear = np.asarray(coded**GAMMA, np.float32)
    clipped = np.asarray(np.any(bits == full_scale, axis=-1))
    return Picture(linear, 1.0, np.ones(linear.shape[:2], dtype=bool), clipped)


def _size(data: bytes, path: Path) -> tuple[int, int]:
    """Width and height from the header, before anything is decoded."""
    if data.startswith(PNG_SIGNATURE):
        if len(data) < 33 or b"IEND" not in data[-1024:]:
            raise ImageError(f"{path} is cut short; copy it again or take another.")
        return int.from_bytes(data[16:20], "big"), int.from_bytes(data[20:24], "big")
    if data.startswith(JPEG_SIGNATURE):
        return _jpeg_size(data, path)
    raise ImageError(f"{path} is not a JPEG or PNG image; convert it to one of these.")


def _jpeg_size(data: bytes, path: Path) -> tuple[int, int]:
    size = (0, 0)
    at = len(JPEG_SIGNATURE)
    while at + 9 <= len(data) and data[at] == 0xFF:
        kind = data[at + 1]
        if kind == 0xFF:  # a fill byte
            at += 1
            continue
        if kind in FRAME_HEADERS:
            height, width = data[at + 5 : at + 7], data[at + 7 : at + 9]
            size = int.from_bytes(width, "big"), int.from_bytes(height, "big")
        if kind == SCAN_HEADER:
            break
        at += 2 + int.from_bytes(data[at + 2 : at + 4], "big")
    if size == (0, 0) or b"\xff\xd9" not in data[at:]:
        raise ImageError(f"{path} is cut short; copy it again or take another.")
    return size
