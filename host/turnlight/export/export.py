"""One export from beginning to end: read, process, write."""

import re
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path

from turnlight.capture import durable
from turnlight.errors import ExportError
from turnlight.export import folder, gltf, materialx, viewer
from turnlight.export.height import Array, height_from_normals
from turnlight.export.resample import resampled
from turnlight.export.subject import Subject, open_subject
from turnlight.export.tileable import Seam, tileable

SMALLEST_PX, LARGEST_PX = 16, 8192


class Format(StrEnum):
    GLTF = "gltf"
    MATERIALX = "materialx"
    FOLDER = "folder"
    VIEWER = "viewer"


@dataclass(frozen=True)
class Options:
    """What to do to the maps on the way. size_px: of the longer side, as it is if None."""

    tileable: bool = False
    size_px: int | None = None
    height: bool = False
    side_mm: float | None = None


@dataclass(frozen=True)
class Exported:
    """What was written. size_mm: width and height of what the maps show."""

    path: Path
    format: str
    size_px: tuple[int, int]
    size_mm: tuple[float, float] | None
    seam: Seam | None
    bytes: int


def export(source: Path, kind: Format, options: Options, out: Path | None = None) -> Exported:
    """Write a session's or a folder's maps in another form; nothing is overwritten.

    out: a new file for glTF and viewer, else a new folder; default: under the source's `exports`.
    Raises ExportError, SessionError or svbrdf.materials.MaterialError.
    """
    if options.height and kind in (Format.GLTF, Format.VIEWER):
        raise ExportError(f"{kind} holds no height; use --format materialx or folder for it.")
    subject, seam = _processed(open_subject(source, options.side_mm), options)
    height = _height(subject) if options.height else None
    path = out or _default(source, subject, kind, options)
    match kind:
        case Format.GLTF:
            content = {path: gltf.glb(subject, tiles=options.tileable)}
        case Format.VIEWER:
            content = {path: viewer.html(subject, tiles=options.tileable)}
        case Format.MATERIALX:
            content = {path / n: c for n, c in materialx.files(subject, height).items()}
        case Format.FOLDER:
            content = {path / n: c for n, c in folder.files(subject, height).items()}
    _write(path, content)
    rows, columns = subject.maps.resolution
    total = sum(map(len, content.values()))
    return Exported(path, kind.value, (columns, rows), subject.size_mm, seam, total)


def _processed(subject: Subject, options: Options) -> tuple[Subject, Seam | None]:
    seam = None
    if options.tileable:
        longest = max(subject.maps.resolution)
        tile, seam = tileable(subject.maps)
        side_mm = subject.provenance.side_mm
        scaled = None if side_mm is None else side_mm * max(tile.resolution) / longest
        subject = subject.changed(
            tile, scaled, step="tileable", seam_edge=seam.edge, seam_path=seam.path
        )
    before = subject.maps.resolution
    size = options.size_px
    if size is not None and size != max(before):
        if not SMALLEST_PX <= size <= LARGEST_PX:
            raise ExportError(f"--size {size} will not do; it is {SMALLEST_PX} to {LARGEST_PX}.")
        rows, columns = (max(1, round(side * size / max(before))) for side in before)
        maps = resampled(subject.maps, columns, rows, wrap=options.tileable)
        subject = subject.changed(
            maps, subject.provenance.side_mm, step="resampled", from_px=[before[1], before[0]]
        )
    return subject, seam


def _height(subject: Subject) -> Array:
    if subject.size_mm is None:
        raise ExportError(
            "Heights are in mm and the folder does not say how large the sample is; add --side-mm."
        )
    pitch_mm = subject.size_mm[0] / subject.maps.resolution[1]
    return height_from_normals(subject.maps.normal, pitch_mm)[..., None]


def _default(source: Path, subject: Subject, kind: Format, options: Options) -> Path:
    name = re.sub(r"[^\w.-]+", "-", subject.provenance.sample).strip("-.") or "sample"
    if options.tileable:
        name += "-tile"
    if options.size_px:
        name += f"-{options.size_px}"
    suffix = {Format.GLTF: ".glb", Format.VIEWER: ".html"}.get(kind, f"-{kind}")
    return source / "exports" / f"{name}{suffix}"


def _write(path: Path, content: dict[Path, bytes]) -> None:
    if path in content:
        if path.exists():
            raise ExportError(
                f"{path} exists and is not overwritten; choose another name with --out."
            )
        _make_parents(path)
    else:
        durable.create_folder(path)
        for inner in {file.parent for file in content} - {path}:
            durable.create_folder(inner)
    for file, data in content.items():
        durable.write(file, data)


def _make_parents(path: Path) -> None:
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise ExportError(
            f"The folder {path.parent} cannot be made: {error.strerror}; choose another with --out."
        ) from error
