"""What is exported: maps with their provenance, from a session or from any folder of maps."""

from dataclasses import dataclass, replace
from pathlib import Path

from svbrdf import materials
from svbrdf.maps import Maps
from svbrdf.materials import MaterialError
from turnlight.capture.session import Session
from turnlight.errors import SessionError
from turnlight.export import provenance
from turnlight.export.provenance import Provenance
from turnlight.handheld.folder import HandheldFolder, is_handheld


@dataclass(frozen=True)
class Subject:
    """maps: float32, square or not. session, handheld: where they come from, if a rig captured them or they
    were photographed by hand."""

    maps: Maps
    provenance: Provenance
    session: Session | None = None
    handheld: HandheldFolder | None = None

    @property
    def size_mm(self) -> tuple[float, float] | None:
        """Width and height of what the maps show; the longer one is the provenance's side."""
        if self.provenance.side_mm is None:
            return None
        height, width = self.maps.resolution
        scale = self.provenance.side_mm / max(height, width)
        return width * scale, height * scale

    def changed(self, maps: Maps, side_mm: float | None, **step: object) -> "Subject":
        """The same after a step of processing, which is written down."""
        steps = (*self.provenance.steps, step)
        return replace(
            self, maps=maps, provenance=replace(self.provenance, side_mm=side_mm, steps=steps)
        )


def open_subject(folder: Path, side_mm: float | None = None) -> Subject:
    """Read a session's folder, the folder that `infer` made, or a folder of maps.

    side_mm: the sample's side, where the folder does not know it. Raises SessionError.
    """
    if not folder.is_dir():
        raise SessionError(f"There is no folder {folder}; name a session, or a folder of maps.")
    handheld = HandheldFolder.open(folder) if is_handheld(folder) else None
    captured = handheld is None and (folder / "session.json").exists()
    session = Session.open(folder) if captured else None
    inner = folder / "maps"
    try:
        maps = materials.load(inner if inner.is_dir() else folder)
    except MaterialError as error:
        if session is not None:
            raise SessionError(
                f"{folder} has no maps yet; finish it first with turnlight resume."
            ) from error
        if handheld is not None:
            raise SessionError(
                f"{folder} has no maps yet; add photos that can be used with turnlight handheld."
            ) from error
        raise
    if session is not None:
        known = provenance.of_session(session.manifest)
    elif handheld is not None:
        known = provenance.of_handheld(handheld.manifest)
    else:
        known = provenance.of_folder(folder)
    if side_mm is not None:
        if known.side_mm is not None and abs(known.side_mm - side_mm) > 1e-6:
            raise SessionError(
                f"{folder} says that its sample is {known.side_mm:g} mm wide; leave out --side-mm."
            )
        known = replace(known, side_mm=side_mm)
    return Subject(maps, known, session, handheld)
