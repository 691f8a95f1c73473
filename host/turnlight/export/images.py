"""Image files that know how large they are and where they come from: PNG of 8 and 16 bits, EXR."""

import struct
import tempfile
import zlib
from collections.abc import Mapping
from pathlib import Path

import cv2
import numpy as np
import numpy.typing as npt
import OpenEXR

Array = npt.NDArray[np.float32]
_HEADER_END = 33
"""Of a PNG: its signature and IHDR."""
_INCH_MM = 25.4


def png(
    image: Array,
    bits: int = 16,
    *,
    pitch_mm: float | None = None,
    texts: Mapping[str, str] | None = None,
) -> bytes:
    """(H, W, 1 or 3) in [0, 1] as PNG of 8 or 16 bits, values as they are.

    pitch_mm: side of a pixel, written as pixels per metre. texts: what the file says of itself.
    """
    values = np.rint(np.clip(image, 0, 1) * (2**bits - 1))
    values = values.astype(np.uint16 if bits == 16 else np.uint8)
    coded = bytes(cv2.imencode(".png", values[..., ::-1])[1])
    chunks = b""
    if pitch_mm:
        per_metre = round(1000 / pitch_mm)
        chunks += _chunk(b"pHYs", struct.pack(">IIB", per_metre, per_metre, 1))
    for key, text in (texts or {}).items():
        chunks += _chunk(b"iTXt", key.encode("latin-1") + b"\0\0\0\0\0" + text.encode())
    return coded[:_HEADER_END] + chunks + coded[_HEADER_END:]


def exr(
    image: Array,
    *,
    pitch_mm: float | None = None,
    texts: Mapping[str, str] | None = None,
    half: bool = True,
) -> bytes:
    """(H, W, 1 or 3) as EXR of half or full floats, linear; RGB or Y, compressed without loss."""
    kind = np.float16 if half else np.float32
    pixels = np.ascontiguousarray(image, kind)
    header: dict[str, object] = {
        "compression": OpenEXR.ZIP_COMPRESSION,
        "type": OpenEXR.scanlineimage,
        **(texts or {}),
    }
    if pitch_mm:
        header["xDensity"] = _INCH_MM / pitch_mm
    name, data = ("RGB", pixels) if pixels.shape[-1] == 3 else ("Y", pixels[..., 0].copy())
    with tempfile.TemporaryDirectory() as folder:  # the library writes to files alone
        path = Path(folder) / "image.exr"
        OpenEXR.File(header, {name: data}).write(str(path))
        return path.read_bytes()


def linear_to_srgb(linear: Array) -> Array:
    """IEC 61966-2-1 coding of [0, 1]."""
    high = 1.055 * np.maximum(linear, 0.0031308) ** (1 / 2.4) - 0.055
    return np.where(linear <= 0.0031308, linear * 12.92, high).astype(np.float32)


def _chunk(kind: bytes, content: bytes) -> bytes:
    check = zlib.crc32(kind + content)
    return struct.pack(">I", len(content)) + kind + content + struct.pack(">I", check)
