"""What a page shows of a session: maps as a screen shows them, for relighting, and small pictures of shots."""

import json
import threading
from collections.abc import Callable
from pathlib import Path

import cv2
import numpy as np
import numpy.typing as npt

from svbrdf import materials
from svbrdf.materials import MaterialError
from turnlight.capture.manifest import ShotRecord
from turnlight.capture.relight import relit, shown
from turnlight.errors import SessionError
from turnlight.export.pack import packed

THUMBNAIL_PX = 480
MAPS_PX = 256
MOST_KEPT = 64
_JPEG = [cv2.IMWRITE_JPEG_QUALITY, 92]


class Images:
    """Makes each image once, however many pages ask for it."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._kept: dict[tuple[object, ...], dict[str, bytes]] = {}

    def maps(self, folder: Path) -> dict[str, bytes]:
        """JPEG of normal, diffuse, roughness, specular and preview; and `packed`, which is JSON.

        folder: with a `maps` folder in it. Raises SessionError if there are no maps yet.
        """
        try:
            stamp = (folder / "maps/preview.png").stat().st_mtime_ns
        except OSError as error:
            raise SessionError("There are no maps yet; take a shot first.") from error
        return self._once((folder, stamp), lambda: _images(folder / "maps"))

    def shot(self, folder: Path, record: ShotRecord) -> bytes:
        """JPEG of a shot's frame. Raises SessionError if the file is gone."""
        path = folder / record.frame.image
        key = (record.frame.sha256,)
        return self._once(key, lambda: {"shot": _thumbnail(path, record)})["shot"]

    def _once(
        self, key: tuple[object, ...], make: Callable[[], dict[str, bytes]]
    ) -> dict[str, bytes]:
        with self._lock:
            if key not in self._kept:
                if len(self._kept) >= MOST_KEPT:
                    self._kept.pop(next(iter(self._kept)))
                self._kept[key] = make()
            return self._kept[key]


def jpeg(image: npt.NDArray[np.uint8]) -> bytes:
    """(h, w, 3) RGB as JPEG."""
    return bytes(cv2.imencode(".jpg", np.ascontiguousarray(image[..., ::-1]), _JPEG)[1])


def _images(folder: Path) -> dict[str, bytes]:
    try:
        maps = materials.load(folder)
    except MaterialError as error:
        raise SessionError(str(error)) from error
    if maps.resolution != (MAPS_PX, MAPS_PX):
        maps = materials.reduced(maps, MAPS_PX)
    images = {name.lower(): jpeg(image) for name, image in shown(maps).items()}
    return images | {"preview": jpeg(relit(maps)), "packed": json.dumps(packed(maps)).encode()}


def _thumbnail(path: Path, record: ShotRecord) -> bytes:
    read = cv2.imread(str(path), cv2.IMREAD_UNCHANGED)
    if read is None:
        raise SessionError(f"The picture of shot {record.shot.index + 1} cannot be read.")
    image = np.asarray(read, np.uint16)
    return jpeg(screen(image[..., ::-1], record.frame.bit_depth, record.frame.gamma, THUMBNAIL_PX))


def screen(
    pixels: npt.NDArray[np.uint16], bit_depth: int, gamma: float, width: int
) -> npt.NDArray[np.uint8]:
    """(h, w, 3) of a frame's pixels, no wider than `width`, as a screen shows them."""
    height_px, width_px = pixels.shape[:2]
    scale = min(1.0, width / width_px)
    size = (max(1, round(width_px * scale)), max(1, round(height_px * scale)))
    small = cv2.resize(np.ascontiguousarray(pixels), size, interpolation=cv2.INTER_AREA)
    value = (small / ((1 << bit_depth) - 1)).clip(0, 1) ** (gamma / 2.2)
    return np.rint(value * 255).astype(np.uint8)
