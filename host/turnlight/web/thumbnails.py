"""Small pictures of the photos of a handheld session."""

import threading
from pathlib import Path

import cv2
import numpy as np

from turnlight.errors import SessionError
from turnlight.handheld.photo import read_photo
from turnlight.web.images import jpeg

WIDTH_PX = 320


class Thumbnails:
    """Makes each once; for several threads."""

    def __init__(self, folder: Path) -> None:
        """folder: the session's."""
        self._folder = folder / "photos"
        self._made: dict[int, bytes] = {}
        self._lock = threading.Lock()

    def of(self, number: int) -> bytes:
        """JPEG. Raises SessionError if there is no such photo, ImageError if it is damaged."""
        with self._lock:
            if number not in self._made:
                self._made[number] = self._make(number)
            return self._made[number]

    def _make(self, number: int) -> bytes:
        for path in self._folder.glob(f"{number:03d}.*"):
            pixels = read_photo(path).pixels
            height, width = pixels.shape[:2]
            size = (WIDTH_PX, max(1, round(WIDTH_PX * height / width)))
            small = cv2.resize(pixels, size, interpolation=cv2.INTER_AREA)
            return jpeg(np.rint(small.clip(0, 1) ** (1 / 2.2) * 255).astype(np.uint8))
        raise SessionError(f"There is no photo {number}.")
