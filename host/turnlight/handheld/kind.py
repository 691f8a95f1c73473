"""What kind of photo a file is, and that it is that photo and nothing else besides."""

import enum
import mmap
import re
from pathlib import Path

PNG_SIGNATURE = b"\x89PNG\r\n\x1a\n"
_HEIC_BRANDS = frozenset({b"heic", b"heix", b"heim", b"heis", b"mif1"})
_MARKER = re.compile(rb"\xff+([\x01-\xcf\xd8-\xfe])")
"""Of a JPEG's segment; a stuffed zero or a restart in the midst of a scan is none."""
_END_OF_IMAGE, _ALONE = b"\xd9", (b"\x01", b"\xd8")
_LOOKED_THROUGH = 66_000
"""Bytes of the file's start, of its end, and behind a JPEG; programs look no farther for what they know."""
_FOREIGN = {
    "a zip archive": rb"PK\x05\x06",
    "an archive": rb"Rar!\x1a\x07|7z\xbc\xaf\x27\x1c",
    "a PDF": rb"%PDF-",
    "a web page": rb"(?i:<html|<script|<svg)",
    "a program": rb"(?i:<\?php)|\x7fELF",
}
"""What a file may be besides."""
CUT_SHORT = "is cut short; copy it again or take another."


class Kind(enum.Enum):
    """A TIFF may be a DNG; its tags tell."""

    JPEG = enum.auto()
    PNG = enum.auto()
    TIFF = enum.auto()
    HEIC = enum.auto()


class NotAPhotoError(Exception):
    """Why not; what follows the file's name in a sentence."""


def kind_of(path: Path) -> Kind:
    """By content, never by name. Raises NotAPhotoError for what is no photo, half a photo, or more than one."""
    with path.open("rb") as file:
        if not file.read(1):
            raise NotAPhotoError(CUT_SHORT)
        with mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as data:
            kind = _by_signature(data[:12])
            end = _ENDS[kind](data)
            if end > len(data):
                raise NotAPhotoError(CUT_SHORT)
            if end < len(data) and kind is not Kind.JPEG:  # where phones put films and notes
                raise NotAPhotoError("has something else behind the photo; save it anew as JPEG.")
            for start in (0, end, max(0, len(data) - _LOOKED_THROUGH)):
                _refuse_foreign(data[start : start + _LOOKED_THROUGH])
    return kind


def _by_signature(start: bytes) -> Kind:
    if start.startswith(b"\xff\xd8\xff"):
        return Kind.JPEG
    if start.startswith(PNG_SIGNATURE):
        return Kind.PNG
    if start[:4] in (b"II*\0", b"MM\0*"):
        return Kind.TIFF
    if start[4:8] == b"ftyp" and start[8:12] in _HEIC_BRANDS:
        return Kind.HEIC
    raise NotAPhotoError("is no JPEG, PNG, TIFF, HEIC or DNG; save it as one of these.")


def _jpeg_end(data: mmap.mmap) -> int:
    at = 0
    while True:
        marker = _MARKER.search(data, at)
        if marker is None:
            return len(data) + 1
        at = marker.end()
        if marker[1] == _END_OF_IMAGE:
            return at
        if marker[1] not in _ALONE:
            at += int.from_bytes(data[at : at + 2], "big")


def _png_end(data: mmap.mmap) -> int:
    at = len(PNG_SIGNATURE)
    while at + 12 <= len(data):
        kind = data[at + 4 : at + 8]
        at += 12 + int.from_bytes(data[at : at + 4], "big")
        if kind == b"IEND":
            return at
    return len(data) + 1


def _heic_end(data: mmap.mmap) -> int:
    at = 0
    while at + 8 <= len(data):
        size = int.from_bytes(data[at : at + 4], "big")
        if size == 1:
            size = int.from_bytes(data[at + 8 : at + 16], "big")
        elif size == 0:
            return len(data)
        if size < 8 or not re.fullmatch(rb"[a-zA-Z0-9 ]{4}", data[at + 4 : at + 8]):
            return at
        at += size
    return at


def _tiff_end(data: mmap.mmap) -> int:
    """Its parts lie anywhere."""
    return len(data)


_ENDS = {
    Kind.JPEG: _jpeg_end,
    Kind.PNG: _png_end,
    Kind.TIFF: _tiff_end,
    Kind.HEIC: _heic_end,
}


def _refuse_foreign(part: bytes) -> None:
    for name, signature in _FOREIGN.items():
        if re.search(signature, part):
            raise NotAPhotoError(f"is {name} as well as a photo; save it anew as JPEG.")
