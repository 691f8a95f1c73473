"""What a page shows of a session: maps as a screen shows them, for relighting, and small pictures of shots."""

import threading
from dataclasses import dataclass, field
from pathlib import Path

import cv2
import numpy as np
import numpy.typing as npt

from svbrdf import materials
from svbrdf.maps import Maps
from svbrdf.materials import MaterialError
from turnlight.capture.manifest import ShotRecord
from turnlight.capture.relight import shown
from turnlight.errors import SessionError
from turnlight.export.pack import packed_for_a_screen
from turnlight.handheld.photo import read_photo
from turnlight.handheld.record import PhotoRecord
from turnlight.web.kept import Kept

THUMBNAIL_PX = 480
MAPS_PX = 256
MOST_KEPT = 100
PHOTO_PX = 320
MAPS = ("normal", "diffuse", "roughness", "specular")
_READING = threading.Lock()
"""Held by who has a photo in memory: one of 64 megapixels takes 800 MB."""
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
        self._images: Kept[bytes] = Kept(MOST_KEPT)
        self._doubts: Kept[dict[str, Doubt]] = Kept(MOST_KEPT)

    def of(self, folder: Path, which: str) -> bytes:
        """JPEG of the normal, diffuse, roughness or specular map or of the preview; or `packed`.

        folder: with a `maps` folder in it. Raises SessionError if there are no maps yet.
        """
        return self._images.once(_key(folder, which), lambda: _made(folder, which))

    async def soon(self, folder: Path, which: str) -> bytes:
        """As `of`, for the many who ask at the same moment."""
        return await self._images.soon(_key(folder, which), lambda: _made(folder, which))

    def shot(self, folder: Path, record: ShotRecord) -> bytes:
        """JPEG of a shot's frame. Raises SessionError if the file is gone."""
        path = folder / record.frame.image
        return self._images.once((record.frame.sha256,), lambda: _thumbnail(path, record))

    def photo(self, folder: Path, record: PhotoRecord) -> bytes:
        """JPEG of a photo taken by hand. Raises SessionError or ImageError if the file is gone."""
        path = folder / record.file
        return self._images.once((record.sha256,), lambda: thumbnail(path))

    def doubts(self, folder: Path) -> dict[str, Doubt]:
        """Of each map that has been refined; empty where none has been."""
        try:
            stamp = (folder / "uncertainty/normal.png").stat().st_mtime_ns
        except OSError:
            return {}
        return self._doubts.once((folder, stamp), lambda: _doubts(folder / "uncertainty"))


def _key(folder: Path, which: str) -> tuple[Path, str, int]:
    try:
        return folder, which, (folder / "maps/preview.png").stat().st_mtime_ns
    except OSError as error:
        raise SessionError("There are no maps yet; take a shot first.") from error


def _made(folder: Path, which: str) -> bytes:
    return _MAKERS.get(which, _map)(folder / "maps", which)


def jpeg(image: npt.NDArray[np.uint8]) -> bytes:
    """(h, w, 3) RGB as JPEG."""
    return bytes(cv2.imencode(".jpg", np.ascontiguousarray(image[..., ::-1]), _JPEG)[1])


def _map(folder: Path, which: str) -> bytes:
    return jpeg(shown(_maps(folder))[which.capitalize()])


def _packed(folder: Path, _: str) -> bytes:
    return packed_for_a_screen(_maps(folder))


def _preview(folder: Path, _: str) -> bytes:
    read = cv2.imread(str(folder / "preview.png"))
    if read is None:
        raise SessionError("The preview cannot be read; refine or finish the session again.")
    small = cv2.resize(read, (MAPS_PX, MAPS_PX), interpolation=cv2.INTER_AREA)
    return jpeg(np.asarray(small, np.uint8)[..., ::-1])


_MAKERS = {"preview": _preview, "packed": _packed}


def _maps(folder: Path) -> Maps:
    try:
        maps = materials.load(folder)
    except MaterialError as error:
        raise SessionError(str(error)) from error
    if maps.resolution == (MAPS_PX, MAPS_PX):
        return maps
    return materials.reduced(maps, MAPS_PX, MAPS_PX)


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


def thumbnail(path: Path) -> bytes:
    """JPEG of a photo taken by hand. Raises ImageError if it is damaged."""
    with _READING:
        pixels = read_photo(path).pixels
        height, width = pixels.shape[:2]
        size = (PHOTO_PX, max(1, round(PHOTO_PX * height / width)))
        small = cv2.resize(pixels, size, interpolation=cv2.INTER_AREA)
    return jpeg(np.rint(np.asarray(small).clip(0, 1) ** (1 / 2.2) * 255).astype(np.uint8))


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
