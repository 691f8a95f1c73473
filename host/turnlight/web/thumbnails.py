"""Small pictures of the photos of a handheld session."""

from pathlib import Path

from turnlight.errors import SessionError
from turnlight.web.images import thumbnail
from turnlight.web.kept import Kept

MOST_KEPT = 1000


class Thumbnails:
    """Makes each once; for several threads."""

    def __init__(self, folder: Path) -> None:
        """folder: the session's."""
        self._folder = folder / "photos"
        self._made: Kept[bytes] = Kept(MOST_KEPT)

    def of(self, number: int) -> bytes:
        """JPEG. Raises SessionError if there is no such photo, ImageError if it is damaged."""
        return self._made.once(number, lambda: self._make(number))

    def _make(self, number: int) -> bytes:
        for path in self._folder.glob(f"{number:03d}.*"):
            return thumbnail(path)
        raise SessionError(f"There is no photo {number}.")
