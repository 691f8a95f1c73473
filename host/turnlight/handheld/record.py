"""What a handheld session's folder says of itself: session.json."""

from collections.abc import Mapping
from datetime import datetime
from typing import Literal

import numpy as np
from pydantic import BaseModel, ConfigDict

from turnlight.capture.manifest import RefinementRecord
from turnlight.handheld.finding import Sighting
from turnlight.handheld.plain import PlainFrame
from turnlight.handheld.shading import Source
from turnlight.handheld.sharpness import Blur
from turnlight.handheld.verdict import Fault, Verdict
from turnlight.picture.marked_frame import MarkedFrame
from turnlight.picture.pinhole import Lens

FORMAT = 1
WHITE = 0.85
"""Of plain office paper."""


class _Record(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid")


class FrameRecord(_Record):
    """The frame in a photo: its opening's side, how blurred its edges are, and the corners of its markers,
    by place."""

    side_mm: int
    plain: bool = False
    blur: float
    blur_px: float
    corners_px: Mapping[int, tuple[tuple[float, float], ...]]

    @staticmethod
    def of(seen: Sighting, blur: Blur) -> "FrameRecord":
        corners = {
            int(place): tuple((float(x), float(y)) for x, y in four)
            for place, four in zip(seen.places, seen.corners_px, strict=True)
        }
        return FrameRecord(
            side_mm=seen.frame.side_mm,
            plain=isinstance(seen.frame, PlainFrame),
            blur=blur.share,
            blur_px=blur.px,
            corners_px=corners,
        )

    @property
    def sighting(self) -> Sighting:
        places = sorted(self.corners_px)
        corners = np.array([self.corners_px[place] for place in places], dtype=float)
        frame = PlainFrame(self.side_mm) if self.plain else MarkedFrame(self.side_mm)
        return Sighting(frame, np.array(places, np.int64), corners)


class LensRecord(_Record):
    """Focal length in pixels, and the radial distortion's first two terms."""

    focal_px: float
    k1: float
    k2: float

    @staticmethod
    def of(lens: Lens) -> "LensRecord":
        k1, k2 = lens.distortion[:2]
        return LensRecord(focal_px=float(lens.matrix[0, 0]), k1=float(k1), k2=float(k2))

    def lens(self, width_px: int, height_px: int) -> Lens:
        """For a photo of this size; the lens's centre is the picture's."""
        focal = self.focal_px
        matrix = np.array([[focal, 0, width_px / 2], [0, focal, height_px / 2], [0, 0, 1.0]])
        return Lens(matrix, np.array([self.k1, self.k2, 0.0, 0.0, 0.0]))


class Measured(_Record):
    """What was seen of a photo. Lengths in mm, angles in degrees, shares from 0 to 1.

    resolution_px: pixels along the sample's side where it is seen smallest. detail: what of
    the other photos' detail this one shows (`sharpness.detail`), None where that cannot be said. tone: as
    `tone.tone`.
    camera_mm, light_mm: positions in the frame's
    coordinates; light_mm is None where the light is not known.
    """

    elevation_deg: float
    resolution_px: float
    residual_px: float
    detail: float | None
    clipped: float
    paper_clipped: float
    shadow: float
    tone: float | None = None
    source: Source
    camera_mm: tuple[float, float, float]
    light_mm: tuple[float, float, float] | None


class PhotoRecord(_Record):
    """A photo that was kept. number: from 1. file: under the session's folder. name: what it was called."""

    number: int
    file: str
    name: str
    sha256: str
    device: str | None
    taken: datetime | None
    width_px: int
    height_px: int
    focal_px: float | None
    frame: FrameRecord | None
    lens: LensRecord | None = None
    flash_mm: tuple[float, float] = (0.0, 0.0)
    """Of the device's flash beside its lens."""
    shift_mm: tuple[float, float] = (0.0, 0.0)
    """By which the sample lies beside where the frame says."""
    measured: Measured | None = None
    faults: tuple[Fault, ...] = ()
    warning: str | None = None
    forced: bool = False
    left_out: bool = False

    @property
    def used(self) -> bool:
        """Whether the maps are made of it."""
        return self.frame is not None and not self.left_out and (self.forced or not self.faults)

    @property
    def verdict(self) -> Verdict:
        return Verdict(
            self.number, self.name, self.used, self.faults, self.frame is not None, self.warning
        )


class HandheldManifest(_Record):
    """session.json of a sample photographed by hand."""

    kind: Literal["handheld"] = "handheld"
    format: int = FORMAT
    sample: str
    started: datetime
    finished: datetime | None = None
    versions: Mapping[str, str]
    model_sha256: Mapping[str, str]
    white: float = WHITE
    """Reflectance of the frame's paper."""
    plain_mm: int | None = None
    """Side of the opening, where the frame is plain white paper."""
    with_light: bool = False
    """Whether the maps were made knowing where the light was."""
    photos: tuple[PhotoRecord, ...] = ()
    refinement: RefinementRecord | None = None

    @property
    def used(self) -> tuple[PhotoRecord, ...]:
        return tuple(photo for photo in self.photos if photo.used)

    @property
    def side_mm(self) -> int | None:
        """Of the sample, as the frame of most photos says."""
        sides = [photo.frame.side_mm for photo in self.photos if photo.frame is not None]
        return (
            max(sides, key=lambda side: (sides.count(side), -sides.index(side))) if sides else None
        )
