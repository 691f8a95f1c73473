"""Whether a photo is fit for use, each reason in a sentence that says what to do."""

from collections.abc import Sequence

import numpy as np

from turnlight.handheld.record import FrameRecord, Measured, PhotoRecord
from turnlight.handheld.tone import DARKEST, LIGHTEST
from turnlight.handheld.verdict import Fault, Problem
from turnlight.picture.pinhole import Matrix

LOWEST_ELEVATION_DEG = 25.0
SMALLEST_PX = 220.0
MOST_BLUR, MOST_BLUR_PX = 1.0 / 512, 1.6
"""Of the frame's edges, as a share of the sample's side and in pixels of the photo: both are too much."""
LEAST_DETAIL = 0.5
"""Of what the sample's other photos show."""
MOST_CLIPPED, MOST_PAPER_CLIPPED = 0.25, 0.5
MOST_SHADOW = 0.02
SAME_LIGHT_DEG = 3.0

NOT_FOUND = Fault(
    Problem.FRAME,
    "The frame was not found: get all of it into the picture, flat, lit and in focus, with nothing on its "
    "markers; of a plain white frame say the size with --size, or print a marked one with turnlight frame.",
)


def faults(
    photo: PhotoRecord,
    before: Sequence[PhotoRecord],
    side_mm: int | None,
) -> tuple[Fault, ...]:
    """All that is wrong with a photo, the worst first.

    before: those used already, which it should add to. side_mm: of the frame in most photos.
    """
    seen = photo.measured
    if photo.frame is None or seen is None:
        return (NOT_FOUND,)
    found = [
        _size(photo, side_mm),
        _oblique(seen),
        _small(seen),
        _clipped(seen),
        _blurred(seen, photo.frame),
        _shadow(seen),
        _duplicate(seen, before),
    ]
    return tuple(fault for fault in found if fault is not None)


def warning(photo: PhotoRecord) -> str | None:
    """What is wrong and keeps no photo from being used."""
    tone = photo.measured.tone if photo.measured else None
    if tone is None or LIGHTEST <= tone <= DARKEST:
        return None
    return (
        f"Beside its white, the frame's greys are too {'dark' if tone > 1 else 'light'}: switch HDR and "
        "filters off, or albedo will be wrong; if every photo says so, it may be the printer."
    )


def _size(photo: PhotoRecord, side_mm: int | None) -> Fault | None:
    assert photo.frame is not None
    if photo.frame.side_mm == side_mm:
        return None
    return Fault(
        Problem.SIZE,
        f"This is the frame for {photo.frame.side_mm} mm and the other photos show the one for {side_mm} mm: "
        "take all photos of a sample in the same frame.",
    )


def _oblique(seen: Measured) -> Fault | None:
    if seen.elevation_deg >= LOWEST_ELEVATION_DEG:
        return None
    return Fault(
        Problem.OBLIQUE,
        f"The camera looked at the sample from only {seen.elevation_deg:.0f} degrees above it: hold it "
        "higher, at 30 degrees or more.",
    )


def _small(seen: Measured) -> Fault | None:
    if seen.resolution_px >= SMALLEST_PX:
        return None
    return Fault(
        Problem.SMALL,
        f"The frame is too small: the sample has {seen.resolution_px:.0f} pixels and needs "
        f"{SMALLEST_PX:.0f}; go closer, until the frame fills the picture.",
    )


def _clipped(seen: Measured) -> Fault | None:
    if seen.clipped <= MOST_CLIPPED and seen.paper_clipped <= MOST_PAPER_CLIPPED:
        return None
    return Fault(
        Problem.CLIPPED,
        "The photo is overexposed: tap on the white paper to set the exposure, or lower it, and take it "
        "again.",
    )


def _blurred(seen: Measured, frame: FrameRecord) -> Fault | None:
    moved = frame.blur > MOST_BLUR and frame.blur_px > MOST_BLUR_PX
    if not moved and (seen.detail is None or seen.detail >= LEAST_DETAIL):
        return None
    return Fault(
        Problem.BLURRED,
        "The sample is blurred: hold still, tap on the sample to focus, and take it again.",
    )


def _shadow(seen: Measured) -> Fault | None:
    if seen.shadow <= MOST_SHADOW:
        return None
    return Fault(
        Problem.SHADOW,
        "A shadow falls on the frame: keep your hand and the phone out of the light, and take it again.",
    )


def _duplicate(seen: Measured, used: Sequence[PhotoRecord]) -> Fault | None:
    for other in used:
        then = other.measured
        if then is None or then.light_mm is None or seen.light_mm is None:
            continue
        light = _angle_deg(seen.light_mm, then.light_mm)
        view = _angle_deg(seen.camera_mm, then.camera_mm)
        if max(light, view) < SAME_LIGHT_DEG:
            return Fault(
                Problem.DUPLICATE,
                f"Light and camera are where they were in photo {other.number}: move to another side of "
                "the sample.",
            )
    return None


def _angle_deg(a: Sequence[float], b: Sequence[float]) -> float:
    p: Matrix = np.asarray(a)
    q: Matrix = np.asarray(b)
    cosine = float(p @ q / np.linalg.norm(p) / np.linalg.norm(q))
    return float(np.degrees(np.arccos(np.clip(cosine, -1, 1))))
