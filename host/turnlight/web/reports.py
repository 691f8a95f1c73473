"""What a page is told of a session: made once for all pages, and again when its folder has changed."""

from pathlib import Path

from turnlight.capture.session import Session
from turnlight.errors import SessionError
from turnlight.handheld.folder import HandheldFolder, is_handheld
from turnlight.web import shapes
from turnlight.web.images import Images
from turnlight.web.kept import Kept
from turnlight.web.library import Library

HISTORY = (1, 2, 5)
MOST_KEPT = 100
_TOLD_OF = ("session.json", "maps/preview.png", "uncertainty/normal.png")
_Key = tuple[Path, tuple[tuple[int, int] | None, ...]]


class Reports:
    """Of the sessions in `library`; every method raises SessionError where there is none."""

    def __init__(self, library: Library, images: Images) -> None:
        self._library = library
        self._images = images
        self._kept: Kept[bytes] = Kept(MOST_KEPT)

    def of(self, name: str) -> bytes:
        """A `SessionShape` as JSON."""
        folder = self._library.folder(name)
        return self._kept.once(_key(folder), lambda: self._json(folder))

    async def soon(self, name: str) -> bytes:
        """As `of`, for the many who ask at the same moment."""
        folder = self._library.folder(name)
        return await self._kept.soon(_key(folder), lambda: self._json(folder))

    def picture(self, name: str, number: int) -> bytes:
        """JPEG of a shot or a photo, counted from 1."""
        folder = self._library.folder(name)
        if is_handheld(folder):
            for photo in HandheldFolder.open(folder).manifest.photos:
                if photo.number == number:
                    return self._images.photo(folder, photo)
        else:
            for record in Session.open(folder).manifest.shots:
                if record.shot.index == number - 1:
                    return self._images.shot(folder, record)
        raise SessionError(f"There is no picture {number}.")

    def _json(self, folder: Path) -> bytes:
        return self._shape(folder).model_dump_json().encode()

    def _shape(self, folder: Path) -> shapes.SessionShape:
        has_maps = (folder / "maps/preview.png").exists()
        doubts = self._images.doubts(folder)
        if is_handheld(folder):
            by_hand = HandheldFolder.open(folder).manifest
            return shapes.handheld_shape(folder.name, by_hand, has_maps, doubts)
        manifest = Session.open(folder).manifest
        history = [n for n in HISTORY if (folder / f"history/{n:03d}/maps/preview.png").exists()]
        return shapes.session_shape(folder.name, manifest, has_maps, history, doubts)


def _key(folder: Path) -> _Key:
    return folder, tuple(_stamp(folder / name) for name in _TOLD_OF)


def _stamp(path: Path) -> tuple[int, int] | None:
    try:
        stat = path.stat()
    except OSError:
        return None
    return stat.st_mtime_ns, stat.st_size
