"""Photographs as a phone or a camera writes them, in linear light."""

import hashlib
import io
import json
import os
import subprocess
import sys
import threading
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from turnlight.errors import ImageError

LARGEST_BYTES = 512_000_000
PATIENCE_S = 120.0
"""What reading one photo may take on a busy computer."""
_STRIP_BYTES = 1 << 20


@dataclass(frozen=True)
class Photo:
    """One photograph, upright.

    pixels: (h, w, 3) float32 linear light in sRGB's primaries, 1 at the file's full scale; colours
    outside sRGB's gamut have a negative component. clipped: (h, w) bool, where a channel of the file is
    at full scale. focal_px: the focal length in pixels of this picture, as EXIF has it; None if it does
    not say. device: maker and model. sha256: of the file. taken: as the device's clock had it.
    """

    pixels: npt.NDArray[np.float32]
    clipped: npt.NDArray[np.bool_]
    focal_px: float | None
    device: str | None
    sha256: str
    name: str
    taken: datetime | None


def read_photo(path: Path, gamma: float | None = None) -> Photo:
    """Read a JPEG, PNG, TIFF, HEIC or DNG of at most 64 million pixels.

    gamma: of a JPEG, PNG or TIFF that has no colour profile; as sRGB's if it is not given.
    A process of its own with limited memory decodes it (`turnlight.handheld.decode`). Raises ImageError
    if the file is missing, too large, damaged, no photo, or a photo and something else besides.
    """
    sha256 = _sha256(path)
    told = [] if gamma is None else [str(gamma)]
    with subprocess.Popen(
        [sys.executable, "-m", "turnlight.handheld.decode", str(path), *told],
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        env=os.environ | {"MALLOC_ARENA_MAX": "1", "OMP_NUM_THREADS": "1"},
    ) as decoder:
        deadline = threading.Timer(PATIENCE_S, decoder.kill)
        deadline.start()
        try:
            return _received(decoder.stdout, path, sha256)  # type: ignore[arg-type]
        finally:
            deadline.cancel()
            decoder.kill()


def _sha256(path: Path) -> str:
    try:
        if path.stat().st_size > LARGEST_BYTES:
            raise ImageError(
                f"{path.name} has {path.stat().st_size / 1e6:.0f} MB, more than the limit of "
                f"{LARGEST_BYTES // 1_000_000}; save it smaller, or as JPEG."
            )
        with path.open("rb") as file:
            return hashlib.file_digest(file, "sha256").hexdigest()
    except FileNotFoundError as error:
        raise ImageError(f"There is no file {path}; check the name.") from error
    except OSError as error:
        raise ImageError(f"{path} cannot be read: {error.strerror}.") from error


def _received(stream: io.BufferedReader, path: Path, sha256: str) -> Photo:
    """What the decoder writes: a line of JSON, then the pixels, then where they are clipped."""
    damaged = ImageError(f"{path.name} is damaged, or no photo; copy it again or take another.")
    try:
        told: dict[str, Any] = json.loads(stream.readline(1 << 16))
    except ValueError as error:
        raise damaged from error
    if "refused" in told:
        raise ImageError(f"{path.name} {told['refused']}")
    shape = (told["height"], told["width"])
    pixels = np.empty((*shape, 3), np.float32)
    clipped = np.empty(shape, np.bool_)
    for array in (pixels, clipped):
        if not _filled(stream, array):
            raise damaged
    taken = told["taken"]
    return Photo(
        pixels,
        clipped,
        told["focal_px"],
        told["device"],
        sha256,
        path.name,
        None if taken is None else datetime.fromisoformat(taken),
    )


def _filled(stream: io.BufferedReader, array: npt.NDArray[Any]) -> bool:
    rest = array.data.cast("B")
    while rest:
        count = stream.readinto(rest[:_STRIP_BYTES])
        if not count:
            return False
        rest = rest[count:]
    return True
