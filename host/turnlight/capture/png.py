"""A frame as PNG, many times as fast as libpng writes it: the time that a shot may take is short.

The format is ISO/IEC 15948: every row's bytes less those of the pixel to the left (filter 1, "Sub"), in
one zlib stream (RFC 1950). A sensor's noise repeats nothing, so no repeats are looked for: each byte is a
literal of one Huffman code for the frame (`deflate`). The stream is made of bands of rows, each coded on
its own, so that two threads can. OpenCV and Pillow read it.
"""

import struct
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from functools import partial

import numpy as np
import numpy.typing as npt
from isal import isal_zlib

from turnlight.capture import deflate

_SIGNATURE = b"\x89PNG\r\n\x1a\n"
_SUB = 1
_BYTES_PER_PIXEL = 6
_HEADER, _END = b"\x78\x01", b"\x03\x00"
"""Of a zlib stream: 32 KiB window, fastest; and an empty last block."""
_BAND_ROWS = 64
_THREADS = 2
_ROWS_COUNTED = 32
_ADLER = 65521


def encode16(pixels: npt.NDArray[np.uint16]) -> Iterator[bytes]:
    """(height, width, 3) RGB as PNG of 16 bits a channel, part by part; the same for the same pixels."""
    height, width, _ = pixels.shape
    yield _SIGNATURE
    yield from _chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, 16, 2, 0, 0, 0))
    yield from _chunk(b"IDAT", _HEADER)
    checksum = 1
    samples = np.ascontiguousarray(pixels).reshape(height, 3 * width)
    bands = [samples[row : row + _BAND_ROWS] for row in range(0, height, _BAND_ROWS)]
    compressed = partial(_compressed, code=deflate.code_for(_counts(samples)))
    with ThreadPoolExecutor(_THREADS, "png") as workers:
        for band, (data, adler) in zip(bands, workers.map(compressed, bands), strict=True):
            checksum = _joined(checksum, adler, len(band) * (1 + width * _BYTES_PER_PIXEL))
            yield from _chunk(b"IDAT", data)
    yield from _chunk(b"IDAT", _END + struct.pack(">I", checksum))
    yield from _chunk(b"IEND", b"")


def _compressed(band: npt.NDArray[np.uint16], code: deflate.Code) -> tuple[bytes, int]:
    return deflate.block(band, _SUB, code)


def _counts(samples: npt.NDArray[np.uint16]) -> npt.NDArray[np.int64]:
    """(256,) of the bytes that are coded, in some of the rows."""
    rows = (
        samples[:: max(1, len(samples) // _ROWS_COUNTED)]
        .view(np.uint8)
        .reshape(-1, 2 * samples.shape[1])
    )
    return np.bincount((rows[:, 6:] - rows[:, :-6]).ravel(), minlength=256)


def _joined(first: int, second: int, length: int) -> int:
    """The Adler-32 of two byte strings after each other, of which the second has this length."""
    a, b = first & 0xFFFF, first >> 16
    c, d = second & 0xFFFF, second >> 16
    low = (a + c - 1) % _ADLER
    high = (b + d + length * (a - 1)) % _ADLER
    return high << 16 | low


def _chunk(kind: bytes, data: bytes) -> tuple[bytes, ...]:
    checksum = isal_zlib.crc32(data, isal_zlib.crc32(kind))
    return struct.pack(">I", len(data)), kind, data, struct.pack(">I", checksum)
