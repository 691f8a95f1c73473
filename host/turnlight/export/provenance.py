"""What an export says of itself: where its maps come from, how large they are and how to read them."""

import hashlib
import json
from dataclasses import dataclass, field
from importlib import metadata
from pathlib import Path
from typing import Any

from pydantic import BaseModel, ConfigDict, ValidationError

from turnlight.capture.manifest import Manifest
from turnlight.errors import SessionError
from turnlight.handheld.record import HandheldManifest

CONVENTIONS = {
    "frame": "the sample is the square [-1, 1]^2: x right, y up, z toward the viewer; row 0 is its top",
    "normal": "unit vectors, OpenGL sign (green is up), stored as (n + 1) / 2 in images",
    "diffuse": "linear RGB albedo",
    "roughness": "linear; GGX alpha is its square",
    "specular": "linear RGB reflectance at normal incidence (F0)",
    "brdf": "isotropic Cook-Torrance with GGX; diffuse (1 - F0) / pi + F D V / 4",
    "primaries": "Rec. 709 / sRGB",
}
GENERATOR = f"Turnlight {metadata.version('turnlight')}"


class Photo(BaseModel):
    """A photograph that the maps are made of."""

    model_config = ConfigDict(frozen=True)

    file: str
    sha256: str


class Origin(BaseModel):
    """origin.json: what a folder of maps that no rig captured says of itself."""

    model_config = ConfigDict(frozen=True)

    sample: str
    versions: dict[str, str]
    model_sha256: dict[str, str]
    photos: tuple[Photo, ...]


@dataclass(frozen=True)
class Provenance:
    """Travels in every export, as JSON."""

    sample: str
    side_mm: float | None
    """Side of what the maps show; None where it is not known."""
    photos: tuple[Photo, ...] = ()
    versions: dict[str, str] = field(default_factory=dict)
    """Of the software, and of the controller's firmware."""
    model_sha256: dict[str, str] = field(default_factory=dict)
    about: dict[str, Any] = field(default_factory=dict)
    """Rig, barcode, thickness and dates, where there are any."""
    steps: tuple[dict[str, Any], ...] = ()
    """What the export did to the maps, in order."""

    def as_dict(self) -> dict[str, Any]:
        """For JSON."""
        return {
            "generator": GENERATOR,
            "sample": self.sample,
            **self.about,
            "side_mm": self.side_mm,
            "conventions": CONVENTIONS,
            "steps": list(self.steps),
            "versions": self.versions,
            "model_sha256": self.model_sha256,
            "photos": [photo.model_dump() for photo in self.photos],
        }

    def as_json(self) -> str:
        return json.dumps(self.as_dict(), indent=2, ensure_ascii=False)


def of_session(manifest: Manifest) -> Provenance:
    """From what a capture wrote down; the photos are those that the maps are made of."""
    config = manifest.config
    about: dict[str, Any] = {"rig": config.name, "thickness_mm": manifest.thickness_mm}
    if manifest.barcode:
        about["barcode"] = manifest.barcode
    about["captured"] = manifest.started.isoformat(timespec="seconds")
    if manifest.refinement is not None:
        about["refined"] = manifest.refinement.finished.isoformat(timespec="seconds")
    frames = (*manifest.darks, *(frame for shot in manifest.used for frame in shot.frames))
    return Provenance(
        sample=manifest.sample,
        side_mm=config.sample.side_mm,
        photos=tuple(Photo(file=frame.image, sha256=frame.sha256) for frame in frames),
        versions=dict(manifest.versions),
        model_sha256=dict(manifest.model_sha256),
        about=about,
    )


def of_handheld(manifest: HandheldManifest) -> Provenance:
    """From what was written down of photos taken by hand; those are the ones that the maps are made of."""
    about: dict[str, Any] = {"rig": "handheld, in the printed frame"}
    devices = sorted({photo.device for photo in manifest.used if photo.device})
    if devices:
        about["devices"] = ", ".join(devices)
    about["paper_reflectance"] = manifest.white
    about["light_known"] = manifest.with_light
    about["captured"] = manifest.started.isoformat(timespec="seconds")
    if manifest.refinement is not None:
        about["refined"] = manifest.refinement.finished.isoformat(timespec="seconds")
    return Provenance(
        sample=manifest.sample,
        side_mm=manifest.side_mm,
        photos=tuple(Photo(file=photo.file, sha256=photo.sha256) for photo in manifest.used),
        versions=dict(manifest.versions),
        model_sha256=dict(manifest.model_sha256),
        about=about,
    )


def of_folder(folder: Path) -> Provenance:
    """From origin.json, if there is one; else the maps themselves are all that is known."""
    path = folder / "origin.json"
    if path.exists():
        try:
            origin = Origin.model_validate_json(path.read_bytes())
        except ValidationError as error:
            raise SessionError(f"{path} is damaged; restore it, or move it away.") from error
        return Provenance(origin.sample, None, origin.photos, origin.versions, origin.model_sha256)
    hashes = {
        str(file.relative_to(folder)): hashlib.sha256(file.read_bytes()).hexdigest()
        for suffix in (".png", ".jpg")
        for file in sorted(folder.rglob(f"*{suffix}"))[:16]
    }
    return Provenance(
        folder.resolve().name, None, about={"origin": "a folder of maps", "maps_sha256": hashes}
    )
