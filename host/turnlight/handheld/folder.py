"""A handheld session's folder.

session.json        the manifest: what was made with what, and a record of every photo
photos/NNN.*        the photos as they came, also those that are not used
maps/*.png          the maps of the photos used so far, 16-bit, linear; preview.png relights them
contact_sheet.png   the whole at a glance
"""

import contextlib
import hashlib
import json
from pathlib import Path
from typing import Self

from pydantic import ValidationError

from svbrdf.maps import Maps
from turnlight.capture import durable
from turnlight.capture.relight import relit
from turnlight.capture.session import save_maps
from turnlight.errors import SessionError
from turnlight.handheld.photo import Photo, read_photo
from turnlight.handheld.record import FORMAT, HandheldManifest, PhotoRecord


class HandheldFolder:
    """Keeps what is to be kept; SessionError if the disk refuses."""

    def __init__(self, path: Path, manifest: HandheldManifest) -> None:
        """Make the folder, which must not exist or be empty."""
        durable.create_folder(path)
        durable.create_folder(path / "photos")
        durable.create_folder(path / "maps")
        self.path, self.manifest = path, manifest
        self.update()

    @classmethod
    def open(cls, path: Path) -> Self:
        """One that was made before."""
        folder = cls.__new__(cls)
        folder.path, folder.manifest = path, _read(path)
        return folder

    def update(self, **changes: object) -> None:
        """Change the manifest, and write it."""
        self.manifest = self.manifest.model_copy(update=changes)
        content = self.manifest.model_dump_json(indent=2).encode()
        durable.write(self.path / "session.json", content)

    def keep(self, file: Path, number: int) -> str:
        """Copy a photo into the folder, byte by byte; its name there."""
        name = f"photos/{number:03d}{file.suffix.lower()}"
        durable.write(self.path / name, file.read_bytes())
        return name

    def read(self, record: PhotoRecord) -> Photo:
        """A photo that was kept; SessionError if it is not there as it was."""
        path = self.path / record.file
        try:
            unchanged = hashlib.sha256(path.read_bytes()).hexdigest() == record.sha256
        except OSError as error:
            raise SessionError(f"{path} cannot be read; restore it from a copy.") from error
        if not unchanged:
            raise SessionError(f"{path} is not the file that was saved; restore it from a copy.")
        return read_photo(path)

    def remove(self) -> None:
        """Take an empty one away; files that are not its own stay."""
        (self.path / "session.json").unlink(missing_ok=True)
        with contextlib.suppress(OSError):
            for inner in (self.path / "photos", self.path / "maps", self.path):
                inner.rmdir()

    def save_maps(self, maps: Maps) -> None:
        save_maps(self.path, maps, relit(maps))


def is_handheld(path: Path) -> bool:
    """Whether a session's folder is of photos taken by hand."""
    try:
        content = json.loads((path / "session.json").read_bytes())
    except (OSError, ValueError):
        return False
    return isinstance(content, dict) and content.get("kind") == "handheld"


def _read(path: Path) -> HandheldManifest:
    file = path / "session.json"
    try:
        manifest = HandheldManifest.model_validate_json(file.read_bytes())
    except OSError as error:
        raise SessionError(
            f"{path} is not a session: its session.json cannot be read; name the folder that "
            "turnlight infer or turnlight handheld has made."
        ) from error
    except ValidationError as error:
        raise SessionError(f"{file} is damaged; restore it from a copy.") from error
    if manifest.format != FORMAT:
        raise SessionError(
            f"{file} has format {manifest.format} and this program reads {FORMAT}; "
            "use the program that made it."
        )
    return manifest
