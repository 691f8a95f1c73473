"""A handheld session refined, under the lights that the frame has told."""

from collections.abc import Callable
from datetime import UTC, datetime
from pathlib import Path

from svbrdf.maps import Maps
from turnlight.capture.manifest import RefinementRecord
from turnlight.capture.refining import refinement_record, save_uncertainty
from turnlight.errors import SessionError
from turnlight.estimate.classical import optimise
from turnlight.estimate.estimator import Estimator
from turnlight.estimate.refine import refine
from turnlight.handheld import develop
from turnlight.handheld.folder import HandheldFolder
from turnlight.picture.picture import Picture

_LOADED = 0.4
"""Of the work, what reading and rectifying the photos are taken to be."""


def refine_handheld(
    path: Path,
    estimator: Estimator | None,
    resolution: int,
    progress: Callable[[float], None] = lambda _: None,
) -> RefinementRecord:
    """Replace the session's maps by refined ones, resolution x resolution; add uncertainty/*.png.

    estimator: as for `refine_session`. Raises SessionError or ImageError; then nothing has changed.
    """
    folder = HandheldFolder.open(path)
    used = folder.manifest.used
    if not used:
        raise SessionError(
            f"{path} has no photo that is used; take some in the printed frame first."
        )
    if not folder.manifest.with_light:
        raise SessionError(
            f"{path} cannot be refined: it is not known where the light was in each of its photos; take "
            "them with the phone's flash, in a dim room."
        )
    pictures: list[Picture] = []
    network: Maps | None = None
    for record in used:
        picture = developed(folder, record.number, resolution)
        pictures.append(picture)
        network = estimator.add(picture) if estimator else None
        progress(_LOADED * len(pictures) / len(used))
    if estimator is None:
        maps = optimise(pictures, resolution)
        done = RefinementRecord(finished=datetime.now(UTC), resolution=resolution, prior=False)
    else:
        refined = refine(
            pictures, network, resolution, lambda s: progress(_LOADED + (1 - _LOADED) * s)
        )
        numbers = [record.number for record in used]
        done = refinement_record(resolution, numbers, refined.quality, None)
        maps = refined.maps
        save_uncertainty(refined.uncertainty, path)
    folder.save_maps(maps)
    folder.update(refinement=done)
    progress(1.0)
    return done


def developed(folder: HandheldFolder, number: int, resolution: int) -> Picture:
    """A photo's picture, from the file and its record alone."""
    record = folder.manifest.photos[number - 1]
    seen = develop.look(folder.read(record), record, resolution)
    picture = develop.picture(record, seen, develop.shading(record, seen), folder.manifest.white)
    return picture if folder.manifest.with_light else develop.without_light(picture)
