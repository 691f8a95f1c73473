"""What the service answers with: shapes for JSON, and what of a session a page shows."""

from collections.abc import Mapping, Sequence
from datetime import datetime
from typing import Annotated, Literal

from pydantic import BaseModel, Field

from turnlight.capture.events import Snapshot
from turnlight.capture.manifest import Manifest, RefinementRecord, ShotRecord
from turnlight.capture.plan import Shot, expected_s, total_turn_deg
from turnlight.catalogue import Entry
from turnlight.config import RigConfig
from turnlight.handheld.record import HandheldManifest
from turnlight.preset import Preset
from turnlight.web.images import Doubt
from turnlight.web.looks import Light, View
from turnlight.web.sample import largest_side_mm

CLIPPED_FAIR, CLIPPED_POOR = 0.01, 0.05
RESIDUAL_FAIR_PX, RESIDUAL_POOR_PX = 1.0, 2.0


class Lamp(BaseModel):
    """One LED as seen from above: x right, y away from the operator, 1 at the outermost ring."""

    x: float
    y: float


class RigShape(BaseModel):
    name: str
    simulated: bool
    calibrated: bool
    leds: list[Lamp]
    camera: Lamp
    presets: dict[str, Preset]
    largest_side_mm: float


class Ready(BaseModel):
    ok: bool
    looked: bool
    """False until the lights have been looked at once."""
    lights: list[Light]


class PlanShape(BaseModel):
    shots: list[Shot]
    total_turn_deg: float
    minutes: float


class ViewShape(BaseModel):
    image: str
    """JPEG in base64; pixels at full scale are pink."""
    clipped: float
    focus: float
    markers_seen: int
    trouble: str | None


class RunShape(BaseModel):
    now: Snapshot
    session: str | None
    """Name of the session that the run makes."""
    verbs: list[str]


class ShotShape(BaseModel):
    """A shot of the plan. quality: None until it is taken; reasons: why it is not good."""

    number: int
    angle_deg: float
    leds: list[int]
    exposure_us: int
    state: Literal["planned", "taken", "dropped", "skipped"]
    quality: Literal["good", "fair", "poor"] | None = None
    reasons: list[str] = []
    change: float | None = None


class SessionLine(BaseModel):
    """A line of the list of sessions."""

    name: str
    sample: str
    barcode: str | None
    started: datetime
    state: str
    saved: int
    planned: int
    finished: bool
    readable: bool


class SessionList(BaseModel):
    total: int
    complete: bool
    """False while a folder that is new to the service has not all been read; ask again."""
    sessions: list[SessionLine]


class DoubtShape(BaseModel):
    """How far a map may be off: half of the interval that holds 95 % of errors, in `unit`."""

    map: str
    median: float
    full: float
    """What the picture shows brightest."""
    unit: str


class QualityShape(BaseModel):
    """How well a session explains itself: each shot is predicted by the others.

    relighting_error: mean over the shots of the mean absolute difference as a display shows it, 0 to 1;
    bad_shots: that contradict the others, and were left out; highlight_reachable: share of the sample whose
    highlight some shot of this rig can catch.
    """

    relighting_error: float | None
    relighting_error_by_shot: dict[int, float]
    bad_shots: list[int]
    highlight_reachable: float | None


class PhotoLine(BaseModel):
    """A photo taken by hand. used: are the maps made of it? reasons: what the checks found."""

    number: int
    name: str
    used: bool
    reasons: list[str]


class SessionShape(BaseModel):
    """shots: what a rig was to take; photos: what was taken by hand. One of them is empty."""

    name: str
    sample: str
    barcode: str | None
    operator: str | None
    preset: str | None
    side_mm: float | None
    thickness_mm: float | None
    started: datetime
    finished: datetime | None
    shots: list[ShotShape]
    photos: list[PhotoLine]
    has_maps: bool
    history: list[int]
    """After how many pictures the maps can be looked at, besides the last."""
    refined: datetime | None
    """When the maps were refined, None if they are the network's."""
    quality: QualityShape | None
    doubts: list[DoubtShape]


class Answer(BaseModel):
    """Done. session: the one that it concerns."""

    session: str | None = None


class Problem(BaseModel):
    """Why not, in one sentence."""

    detail: str


class Token(BaseModel):
    token: Annotated[str, Field(max_length=200)]


class DoorShape(BaseModel):
    open: bool
    """May this page ask for more than this?"""
    version: str


class GoOn(BaseModel):
    """What to do with a session: shots to take again, or to leave out, by number from 1."""

    retake: Annotated[list[Annotated[int, Field(ge=1, le=100_000)]], Field(max_length=1000)] = []
    drop: Annotated[list[Annotated[int, Field(ge=1, le=100_000)]], Field(max_length=1000)] = []
    finish: bool = False


def rig_shape(config: RigConfig, simulated: bool) -> RigShape:
    thickness_mm = config.sample.reference_thickness_mm
    leds = config.led_positions_mm(thickness_mm)[:, :2]
    camera = config.camera_position_mm(thickness_mm)[:2]
    farthest = max(float((leds**2).sum(axis=1).max()) ** 0.5, 1e-9)
    return RigShape(
        name=config.name,
        simulated=simulated,
        calibrated=config.calibration is not None,
        leds=[Lamp(x=x / farthest, y=y / farthest) for x, y in leds.tolist()],
        camera=Lamp(x=camera[0] / farthest, y=camera[1] / farthest),
        presets=config.preset,
        largest_side_mm=largest_side_mm(config),
    )


def plan_shape(shots: Sequence[Shot]) -> PlanShape:
    turn_deg = total_turn_deg(shot.angle_deg for shot in shots)
    return PlanShape(shots=list(shots), total_turn_deg=turn_deg, minutes=expected_s(shots) / 60)


def line_shape(entry: Entry) -> SessionLine:
    return SessionLine(
        name=entry.folder.name,
        sample=entry.sample,
        barcode=entry.barcode,
        started=entry.started,
        state=entry.state,
        saved=entry.saved,
        planned=entry.planned,
        finished=entry.finished is not None,
        readable=entry.problem is None,
    )


def session_shape(
    name: str,
    manifest: Manifest,
    has_maps: bool,
    history: list[int],
    doubts: Mapping[str, Doubt],
) -> SessionShape:
    records = {record.shot.index: record for record in manifest.shots}
    skipped = {skip.index: skip.cause for skip in manifest.skipped}
    presets = manifest.config.preset.items()
    return SessionShape(
        name=name,
        sample=manifest.sample,
        barcode=manifest.barcode,
        operator=manifest.operator,
        preset=next((key for key, value in presets if value == manifest.preset), "its own"),
        side_mm=manifest.config.sample.side_mm,
        thickness_mm=manifest.thickness_mm,
        started=manifest.started,
        finished=manifest.finished,
        shots=[_shot(shot, records.get(shot.index), skipped) for shot in manifest.plan],
        photos=[],
        has_maps=has_maps,
        history=history,
        refined=manifest.refinement.finished if manifest.refinement else None,
        quality=_quality(manifest.refinement),
        doubts=_doubts(manifest.refinement, doubts),
    )


def handheld_shape(
    name: str, manifest: HandheldManifest, has_maps: bool, doubts: Mapping[str, Doubt]
) -> SessionShape:
    return SessionShape(
        name=name,
        sample=manifest.sample,
        barcode=None,
        operator=None,
        preset=None,
        side_mm=manifest.side_mm,
        thickness_mm=None,
        started=manifest.started,
        finished=manifest.finished,
        shots=[],
        photos=[
            PhotoLine(
                number=photo.number,
                name=photo.name,
                used=photo.used,
                reasons=[fault.sentence for fault in photo.faults],
            )
            for photo in manifest.photos
        ],
        has_maps=has_maps,
        history=[],
        refined=manifest.refinement.finished if manifest.refinement else None,
        quality=_quality(manifest.refinement),
        doubts=_doubts(manifest.refinement, doubts),
    )


def view_shape(view: View, image: str) -> ViewShape:
    return ViewShape(
        image=image,
        clipped=view.clipped,
        focus=view.focus,
        markers_seen=view.markers_seen,
        trouble=view.trouble,
    )


def quality(record: ShotRecord) -> tuple[Literal["good", "fair", "poor"], list[str]]:
    """Of a taken shot's picture, and why it is no better."""
    poor = [record.warning] if record.warning else []
    fair: list[str] = []
    clipped, residual_px = record.clipped or 0.0, record.marker_residual_px or 0.0
    if clipped > CLIPPED_FAIR:
        worse = poor if clipped > CLIPPED_POOR else fair
        worse.append(f"{clipped:.0%} of the picture is overexposed.")
    if residual_px > RESIDUAL_FAIR_PX:
        worse = poor if residual_px > RESIDUAL_POOR_PX else fair
        worse.append(f"The markers lie {residual_px:.1f} px from where they should be.")
    return ("poor" if poor else "fair" if fair else "good"), poor + fair


def _quality(refinement: RefinementRecord | None) -> QualityShape | None:
    if refinement is None or not refinement.prior:
        return None
    return QualityShape(
        relighting_error=refinement.relighting_error,
        relighting_error_by_shot=dict(refinement.relighting_error_by_shot),
        bad_shots=list(refinement.bad_shots),
        highlight_reachable=refinement.highlight_reachable,
    )


def _doubts(refinement: RefinementRecord | None, doubts: Mapping[str, Doubt]) -> list[DoubtShape]:
    if refinement is None:
        return []
    return [
        DoubtShape(map=key, median=doubt.median, full=doubt.full, unit=doubt.unit)
        for key, doubt in doubts.items()
    ]


def _shot(shot: Shot, record: ShotRecord | None, skipped: dict[int, str]) -> ShotShape:
    shape = ShotShape(
        number=shot.index + 1,
        angle_deg=shot.angle_deg,
        leds=list(shot.leds),
        exposure_us=shot.exposure_us,
        state="planned",
    )
    if record is None:
        if shot.index in skipped:
            shape.state, shape.reasons = "skipped", [skipped[shot.index]]
        return shape
    shape.state = "dropped" if record.dropped else "taken"
    shape.quality, shape.reasons = quality(record)
    shape.change = record.change
    return shape
