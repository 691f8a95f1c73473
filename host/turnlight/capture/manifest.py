"""What a session's folder says of itself: session.json, and the record of every shot."""

from collections.abc import Mapping
from datetime import datetime

from pydantic import BaseModel, ConfigDict

from turnlight.capture.plan import Shot
from turnlight.config import RigConfig
from turnlight.frame import Exposure

FORMAT = 1


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
    short: FrameRecord | None = None
    """The same at a shorter exposure, where the shot is bracketed."""
    reported_angle_deg: float
    measured_angle_deg: float | None = None
    markers_seen: int | None = None
    marker_residual_px: float | None = None
    warning: str | None = None
    dropped: str | None = None
    """Why the maps do without this shot; None for a shot that is used."""

    @property
    def frames(self) -> tuple[FrameRecord, ...]:
        return (self.frame,) if self.short is None else (self.frame, self.short)


class SkippedShot(_Record):
    """A planned shot of which there is no frame, and why."""

    index: int
    cause: str


class Manifest(_Record):
    """session.json."""

    format: int = FORMAT
    sample: str
    barcode: str | None = None
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
    skipped: tuple[SkippedShot, ...] = ()
