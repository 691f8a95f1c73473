"""What a page shows of a session: maps as a screen shows them, for relighting, and small pictures of shots."""

import json
import threading
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, TypeVar

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
MAPS = ("normal", "diffuse", "roughness", "specular")
T = TypeVar("T")
_JPEG = [cv2.IMWRITE_JPEG_QUALITY, 92]


@dataclass(frozen=True)
class Doubt:
    """How far a map may be off: half of the interval that holds 95 % of errors. unit: of these numbers;
    degrees for normals. full: what the picture shows brightest."""

    median: float
    full: float
    unit: str
    image: bytes = field(repr=False)


class Images:
    """Makes each image once, however many pages ask for it."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._kept: dict[tuple[object, ...], Any] = {}

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

    def doubts(self, folder: Path) -> dict[str, Doubt]:
        """Of each map that has been refined; empty where none has been."""
        try:
            stamp = (folder / "uncertainty/normal.png").stat().st_mtime_ns
        except OSError:
            return {}
        return self._once((folder, "doubts", stamp), lambda: _doubts(folder / "uncertainty"))

    def _once(self, key: tuple[object, ...], make: Callable[[], T]) -> T:
        with self._lock:
            if key not in self._kept:
                if len(self._kept) >= MOST_KEPT:
                    self._kept.pop(next(iter(self._kept)))
                self._kept[key] = make()
            kept: T = self._kept[key]
            return kept


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


def _doubts(folder: Path) -> dict[str, Doubt]:
    """From the pictures that turnlight.capture.refining writes."""
    doubts = {}
    for name in MAPS:
        read = cv2.imread(str(folder / f"{name}.png"), cv2.IMREAD_UNCHANGED)
        if read is None:
            raise SessionError(
                f"The uncertainty of the {name} map cannot be read; refine it again."
            )
        half = np.asarray(read, np.float32).reshape(*read.shape[:2], -1)[..., ::-1] / 65535
        unit = ""
        if name == "normal":  # an ellipse in slope space: its extents, and their correlation
            half, unit = np.degrees(np.arctan(half[..., :2])), "°"
        off = half.mean(axis=-1)
        full = max(float(np.percentile(off, 99)), 1e-6)
        small = cv2.resize(off, (MAPS_PX, MAPS_PX), interpolation=cv2.INTER_AREA)
        bits = np.rint(np.clip(small / full, 0, 1) * 255).astype(np.uint8)
        shown = np.asarray(cv2.applyColorMap(bits, cv2.COLORMAP_INFERNO), np.uint8)
        doubts[name] = Doubt(float(np.median(off)), full, unit, jpeg(shown[..., ::-1]))
    return doubts


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
