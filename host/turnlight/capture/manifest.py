"""What a session's folder says of itself: session.json, and the record of every shot."""

from collections.abc import Mapping
from datetime import datetime
from pathlib import Path

from pydantic import BaseModel, ConfigDict

from turnlight.capture.plan import Shot
from turnlight.config import RigConfig
from turnlight.frame import Exposure
from turnlight.preset import Preset

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
    clipped: float | None = None
    """Share of the picture in which the sensor clipped."""
    change: float | None = None
    """Mean absolute change of the maps by this shot; None for the first."""
    warning: str | None = None
    dropped: str | None = None
    """Why the maps do without this shot; None for a shot that is used."""

    @property
    def frames(self) -> tuple[FrameRecord, ...]:
        return (self.frame,) if self.short is None else (self.frame, self.short)


class SkippedShot(_Record):
    """A planned shot that gave no usable picture, and why; resuming the session tries it again."""

    index: int
    cause: str


class LitExposure(_Record):
    """What the exposure test found for these LEDs: clipped is a share of the sample's pixels."""

    leds: tuple[int, ...]
    exposure_us: int
    clipped: float


class RefinementRecord(_Record):
    """How the maps were refined, and how well the session explains itself."""

    finished: datetime
    resolution: int
    prior: bool
    """False for the classical optimisation, which judges no shot."""
    relighting_error: float | None = None
    """Mean over the shots of how far each is from its prediction by the others: mean absolute difference
    as a display shows it, from 0 to 1. None with fewer than two usable shots."""
    relighting_error_by_shot: Mapping[int, float] = {}
    """By number, from 1."""
    bad_shots: tuple[int, ...] = ()
    """Numbers of shots that contradict the others, and were left out."""
    highlight_reachable: float | None = None
    """Share of the sample whose highlight some shot of this rig can catch."""


class Manifest(_Record):
    """session.json."""

    format: int = FORMAT
    sample: str
    barcode: str | None = None
    operator: str | None = None
    thickness_mm: float
    started: datetime
    finished: datetime | None = None
    versions: Mapping[str, str]
    model_sha256: Mapping[str, str]
    """Hash of every file of the model that made the maps."""
    config: RigConfig
    material: Path | None = None
    """The folder that gave the simulated rig its sample."""
    preset: Preset = Preset()
    exposures: tuple[LitExposure, ...] = ()
    plan: tuple[Shot, ...]
    """With an adaptive order, the shots that have been chosen so far."""
    darks: tuple[FrameRecord, ...] = ()
    shots: tuple[ShotRecord, ...] = ()
    skipped: tuple[SkippedShot, ...] = ()
    refinement: RefinementRecord | None = None
    """None while the maps are the network's."""

    @property
    def count(self) -> int:
        """How many shots there are to be."""
        adaptive = self.preset.order == "adaptive"
        return max(len(self.plan), self.preset.shots if adaptive else 0)

    @property
    def used(self) -> tuple[ShotRecord, ...]:
        """The shots that the maps are made of, in the order of the plan."""
        kept = (record for record in self.shots if record.dropped is None)
        return tuple(sorted(kept, key=lambda record: record.shot.index))

    @property
    def missing(self) -> tuple[Shot, ...]:
        """The planned shots that are still to be taken."""
        settled = {r.shot.index for r in self.shots} | {s.index for s in self.skipped}
        return tuple(shot for shot in self.plan if shot.index not in settled)
