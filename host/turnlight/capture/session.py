"""The session: one sample's folder, in which a shot is durable before anything else sees it.

session.json        the manifest: what was asked and with what, and a record of every shot on disk
shots/NNN.png       the camera's own bits; NNN.json the record of that shot
dark.png            the frame without LEDs, subtracted from every shot of the same exposure
maps/*.png          the maps after the last shot so far, 16-bit, linear; preview.png relights them
contact_sheet.png   the whole capture at a glance
"""

import hashlib
from collections.abc import Mapping
from datetime import UTC, datetime
from pathlib import Path

import cv2
import numpy as np
import numpy.typing as npt
from pydantic import BaseModel, ConfigDict

from svbrdf import materials
from svbrdf.maps import Maps
from turnlight.capture import durable
from turnlight.capture.plan import Shot
from turnlight.config import RigConfig
from turnlight.frame import Exposure, Frame

FORMAT = 1
# Run lengths of horizontal differences: as small as the default on sensor noise, and twice as fast.
_PNG = [
    cv2.IMWRITE_PNG_COMPRESSION, 1,
    cv2.IMWRITE_PNG_STRATEGY, cv2.IMWRITE_PNG_STRATEGY_RLE,
    cv2.IMWRITE_PNG_FILTER, cv2.IMWRITE_PNG_FILTER_SUB,
]  # fmt: skip


class _Record(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid")


class FrameRecord(_Record):
    """A frame on disk: its file, that file's hash, and what the camera said of the frame."""

    image: str
    sha256: str
    bit_depth: int
    gamma: float
    exposure: Exposure
    started_us: int


class ShotRecord(_Record):
    """A shot on disk. What its picture shows is None until it has been rectified."""

    shot: Shot
    frame: FrameRecord
    reported_angle_deg: float
    measured_angle_deg: float | None = None
    markers_seen: int | None = None
    marker_residual_px: float | None = None
    warning: str | None = None


class Manifest(_Record):
    """session.json."""

    format: int = FORMAT
    sample: str
    thickness_mm: float
    started: datetime
    finished: datetime | None = None
    versions: Mapping[str, str]
    model_sha256: Mapping[str, str]
    """Hash of every file of the model that made the maps."""
    config: RigConfig
    plan: tuple[Shot, ...]
    darks: tuple[FrameRecord, ...] = ()
    shots: tuple[ShotRecord, ...] = ()


class Session:
    """One capture's folder, open for writing; SessionError if the disk refuses."""

    def __init__(self, folder: Path, manifest: Manifest) -> None:
        """Make the folder, which must not exist or be empty."""
        self.folder = folder
        durable.create_folder(folder)
        durable.create_folder(folder / "shots")
        durable.create_folder(folder / "maps")
        self.manifest = manifest
        self._write_manifest()

    def save_dark(self, frame: Frame) -> None:
        """Keep the frame without LEDs that holds for one exposure."""
        number = len(self.manifest.darks)
        record = self._save_frame(f"dark-{number + 1}.png" if number else "dark.png", frame)
        self._update(darks=(*self.manifest.darks, record))

    def save_shot(self, shot: Shot, frame: Frame, reported_angle_deg: float) -> ShotRecord:
        """Make a shot durable: its picture first, then its record, then the manifest."""
        record = ShotRecord(
            shot=shot,
            frame=self._save_frame(f"shots/{shot.index:03d}.png", frame),
            reported_angle_deg=reported_angle_deg,
        )
        return self._save_record(record)

    def save_measurement(
        self,
        record: ShotRecord,
        measured_angle_deg: float,
        markers_seen: int,
        marker_residual_px: float,
        warning: str | None,
    ) -> ShotRecord:
        """Add to a shot's record what was seen in its picture."""
        measured = {
            "measured_angle_deg": measured_angle_deg,
            "markers_seen": markers_seen,
            "marker_residual_px": marker_residual_px,
            "warning": warning,
        }
        return self._save_record(record.model_copy(update=measured))

    def save_maps(self, maps: Maps, preview: npt.NDArray[np.uint8]) -> None:
        """Replace the maps, each file at once; preview is (h, w, 3) RGB as a screen shows it."""
        save_maps(self.folder, maps, preview)

    def finish(self) -> None:
        """Note that every planned shot is in."""
        self._update(finished=datetime.now(UTC))

    def _save_frame(self, name: str, frame: Frame) -> FrameRecord:
        png = bytes(cv2.imencode(".png", frame.pixels[..., ::-1], _PNG)[1])
        durable.write(self.folder / name, png)
        return FrameRecord(
            image=name,
            sha256=hashlib.sha256(png).hexdigest(),
            bit_depth=frame.bit_depth,
            gamma=frame.gamma,
            exposure=frame.exposure,
            started_us=frame.started_us,
        )

    def _save_record(self, record: ShotRecord) -> ShotRecord:
        index = record.shot.index
        path = self.folder / f"shots/{index:03d}.json"
        durable.write(path, record.model_dump_json(indent=2).encode())
        others = (r for r in self.manifest.shots if r.shot.index != index)
        self._update(shots=(*others, record))
        return record

    def _update(self, **changes: object) -> None:
        self.manifest = self.manifest.model_copy(update=changes)
        self._write_manifest()

    def _write_manifest(self) -> None:
        content = self.manifest.model_dump_json(indent=2).encode()
        durable.write(self.folder / "session.json", content)


def save_maps(folder: Path, maps: Maps, preview: npt.NDArray[np.uint8]) -> None:
    """Write maps/*.png under the folder, each file replaced at once."""
    for name, png in materials.encode(maps).items():
        durable.write(folder / f"maps/{name}.png", png)
    durable.write(folder / "maps/preview.png", png_bytes(preview))


def png_bytes(image: npt.NDArray[np.uint8]) -> bytes:
    """(h, w, 3) RGB as PNG."""
    return bytes(cv2.imencode(".png", image[..., ::-1])[1])
