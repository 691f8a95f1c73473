"""Photos as files of every kind, made by other means than those that read them."""

import struct
import subprocess
import zlib
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import numpy.typing as npt
from PIL import ExifTags, Image

P3_PRIMARIES = {"r": (0.51512, 0.2412, -0.00105), "g": (0.29198, 0.69225, 0.04189)}
P3_PRIMARIES["b"] = (0.1571, 0.06657, 0.78407)
SRGB_CURVE = (2.4, 1 / 1.055, 0.055 / 1.055, 1 / 12.92, 0.04045)


def scene(width: int = 96, height: int = 64) -> npt.NDArray[np.uint8]:
    """(h, w, 3) RGB: smooth, different in every corner, nowhere near full scale but in one place."""
    y, x = np.mgrid[:height, :width] / [[[height]], [[width]]]
    image = np.stack([0.2 + 0.6 * x, 0.2 + 0.6 * y, 0.7 - 0.5 * x * y], axis=-1)
    image[: height // 4, : width // 4] = 1.0
    return np.rint(image * 255).astype(np.uint8)


def phone_exif(orientation: int = 1, focal_35mm: int = 26) -> Image.Exif:
    exif = Image.Exif()
    exif[ExifTags.Base.Make] = "Turnlight"
    exif[ExifTags.Base.Model] = "Phone 1"
    exif[ExifTags.Base.Orientation] = orientation
    camera = exif.get_ifd(ExifTags.IFD.Exif)
    camera[ExifTags.Base.FocalLengthIn35mmFilm] = focal_35mm
    camera[ExifTags.Base.DateTimeOriginal] = "2026:11:22 18:30:00"
    camera[ExifTags.Base.OffsetTimeOriginal] = "+01:00"
    return exif


def icc_profile(
    primaries: Mapping[str, tuple[float, float, float]] = P3_PRIMARIES,
    curve: tuple[float, ...] = SRGB_CURVE,
) -> bytes:
    """A display profile of a matrix and one parametric curve (ICC.1:2022, 7.2 and 7.3)."""

    def fixed(values: tuple[float, ...]) -> bytes:
        return struct.pack(f">{len(values)}i", *(round(v * 65536) for v in values))

    kind = {1: 0, 3: 1, 4: 2, 5: 3, 7: 4}[len(curve)]
    tags = {f"{c}XYZ".encode(): b"XYZ \0\0\0\0" + fixed(xyz) for c, xyz in primaries.items()}
    for c in "rgb":
        tags[f"{c}TRC".encode()] = b"para\0\0\0\0" + struct.pack(">HH", kind, 0) + fixed(curve)
    at = 128 + 4 + 12 * len(tags)
    table, content = struct.pack(">I", len(tags)), b""
    for name, tag in tags.items():
        table += struct.pack(">4sII", name, at + len(content), len(tag))
        content += tag
    size = at + len(content)
    header = struct.pack(">I4sI4s4s4s", size, b"none", 0x04000000, b"mntr", b"RGB ", b"XYZ ")
    header = header.ljust(36, b"\0") + b"acsp"
    header = header.ljust(68, b"\0") + fixed((0.9642, 1.0, 0.8249))
    return header.ljust(128, b"\0") + table + content


def write_heic(path: Path, image: npt.NDArray[np.generic], *options: str, **kept: object) -> Path:
    """By Debian's heif-enc, with what Pillow keeps (`exif`, `icc_profile`) in the picture before it."""
    import cv2

    source = path.with_suffix(".source.png")
    if image.dtype == np.uint16:
        cv2.imwrite(str(source), image[..., ::-1])
    else:
        source = path.with_suffix(".source.jpg")
        Image.fromarray(image).save(source, quality=98, subsampling=0, **kept)
    quality = ["-q", "95", "-p", "preset=ultrafast"]
    command = ["heif-enc", *quality, *options, str(source), "-o", str(path)]
    subprocess.run(command, check=True, capture_output=True, timeout=100)
    source.unlink()
    return path


def write_dng(
    path: Path, light: npt.NDArray[np.floating], orientation: int = 1, white: int = 16383
) -> Path:
    """The least that is a DNG (Adobe DNG 1.4): one 16-bit Bayer mosaic (RGGB), sRGB's matrix, 1:1:1 white.

    light: (h, w, 3) linear.
    """
    height, width = light.shape[:2]
    mosaic = np.empty((height, width))
    for y, x, channel in ((0, 0, 0), (0, 1, 1), (1, 0, 1), (1, 1, 2)):
        mosaic[y::2, x::2] = light[y::2, x::2, channel]
    pixels = np.rint(mosaic.clip(0, 1) * white).astype("<u2").tobytes()
    from_xyz_d65 = [3.2405, -1.5371, -0.4985, -0.9693, 1.8760, 0.0416, 0.0556, -0.2040, 1.0572]
    rational = struct.pack("<18i", *(v for m in from_xyz_d65 for v in (round(m * 10000), 10000)))
    short, long, byte, text, srational, rational_kind = 3, 4, 1, 2, 10, 5
    entries: list[tuple[int, int, int, bytes]] = [
        (254, long, 1, struct.pack("<I", 0)),
        (256, long, 1, struct.pack("<I", width)),
        (257, long, 1, struct.pack("<I", height)),
        (258, short, 1, struct.pack("<H", 16)),
        (259, short, 1, struct.pack("<H", 1)),
        (262, short, 1, struct.pack("<H", 32803)),
        (271, text, 10, b"Turnlight\0"),
        (272, text, 8, b"Phone 1\0"),
        (273, long, 1, b"PIXE"),
        (274, short, 1, struct.pack("<H", orientation)),
        (277, short, 1, struct.pack("<H", 1)),
        (278, long, 1, struct.pack("<I", height)),
        (279, long, 1, struct.pack("<I", len(pixels))),
        (33421, short, 2, struct.pack("<2H", 2, 2)),
        (33422, byte, 4, bytes([0, 1, 1, 2])),
        (50706, byte, 4, bytes([1, 4, 0, 0])),
        (50708, text, 18, b"Turnlight Phone 1\0"),
        (50717, long, 1, struct.pack("<I", white)),
        (50721, srational, 9, rational),
        (50728, rational_kind, 3, struct.pack("<6I", 1, 1, 1, 1, 1, 1)),
        (50778, short, 1, struct.pack("<H", 21)),
    ]
    at = 8 + 2 + 12 * len(entries) + 4
    table, behind = struct.pack("<H", len(entries)), b""
    for tag, kind, count, value in entries:
        stored = value
        if len(value) > 4:
            stored = struct.pack("<I", at + len(behind))
            behind += value + b"\0" * (len(value) % 2)
        table += struct.pack("<HHI", tag, kind, count) + stored.ljust(4, b"\0")
    table += struct.pack("<I", 0)
    table = table.replace(b"PIXE", struct.pack("<I", at + len(behind)))
    path.write_bytes(b"II*\0" + struct.pack("<I", 8) + table + behind + pixels)
    return path


def turned_heic(path: Path, quarter_turns: int) -> Path:
    """The same file with an `irot` property (ISO/IEC 23008-12, 6.5.10), as phones held upright write it."""
    data = path.read_bytes()
    at = data.index(b"ipco")
    ipco = data[at - 4 : at - 4 + _size(data, at)]
    properties, place = 0, 8
    while place < len(ipco):
        properties, place = properties + 1, place + int.from_bytes(ipco[place : place + 4], "big")
    turn = struct.pack(">I4sB", 9, b"irot", quarter_turns)
    ipma_at = data.index(b"ipma")
    ipma = data[ipma_at - 4 : ipma_at - 4 + _size(data, ipma_at)]
    assert ipma[8:16] == b"\0\0\0\0\0\0\0\1", "one item has properties, under small numbers"
    count = ipma[18]
    longer = bytes([count + 1]) + ipma[19 : 19 + count] + bytes([0x80 | (properties + 1)])
    grown = struct.pack(">I", len(ipma) + 1) + ipma[4:18] + longer + ipma[19 + count :]
    head = struct.pack(">I", len(ipco) + 9) + ipco[4:] + turn + grown
    start, end = at - 4, ipma_at - 4 + len(ipma)
    assert start + len(ipco) == ipma_at - 4, "ipma lies right behind ipco"
    data = data[:start] + head + data[end:]
    for box in (b"meta", b"iprp"):
        where = data.index(box)
        data = data[: where - 4] + struct.pack(">I", _size(data, where) + 10) + data[where:]
    path.write_bytes(_shifted(data, 10))
    return path


def _shifted(data: bytes, by: int) -> bytes:
    """With the extents of `iloc` (version 0 or 1, offsets of 4 bytes) farther behind."""
    at = data.index(b"iloc") + 4
    version, sizes = data[at], data[at + 4 : at + 6]
    assert version in (0, 1) and sizes[0] == 0x44 and sizes[1] >> 4 in (0, 4)
    base = sizes[1] >> 4
    changed = bytearray(data)
    (items,) = struct.unpack_from(">H", data, at + 6)
    at += 8
    for _ in range(items):
        at += 4 + (2 if version == 1 else 0) + base
        (extents,) = struct.unpack_from(">H", data, at)
        at += 2
        for _ in range(extents):
            struct.pack_into(">I", changed, at, struct.unpack_from(">I", data, at)[0] + by)
            at += 8
    return bytes(changed)


def _size(data: bytes, at: int) -> int:
    """Of the box whose name is at `at`."""
    return int.from_bytes(data[at - 4 : at], "big")


def png_of(width: int, height: int, content: bytes, extra: bytes = b"") -> bytes:
    """A file of 8 bits RGB. content: deflated; extra: chunks before it."""
    header = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    chunks = (
        png_chunk(b"IHDR", header) + extra + png_chunk(b"IDAT", content) + png_chunk(b"IEND", b"")
    )
    return b"\x89PNG\r\n\x1a\n" + chunks


def png_chunk(name: bytes, content: bytes) -> bytes:
    size, check = struct.pack(">I", len(content)), struct.pack(">I", zlib.crc32(name + content))
    return size + name + content + check
