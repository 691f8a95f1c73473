"""A saved session refined: its maps, how far they may be off, and how well it explains itself."""

import contextlib
from collections.abc import Callable, Sequence
from datetime import UTC, datetime
from pathlib import Path

import cv2
import numpy as np

from svbrdf.maps import Maps
from turnlight.capture import durable
from turnlight.capture.adaptive import reachable_share
from turnlight.capture.develop import Developer
from turnlight.capture.manifest import RefinementRecord
from turnlight.capture.pipeline import Estimator
from turnlight.capture.relight import relit
from turnlight.capture.session import Session
from turnlight.errors import SessionError
from turnlight.estimate.classical import optimise
from turnlight.estimate.quality import Quality
from turnlight.estimate.refine import refine
from turnlight.estimate.uncertainty import Uncertainty, half_width, radius
from turnlight.picture.picture import Picture

_LOADED = 0.4
"""Of the work, what reading and rectifying the shots are taken to be."""


def refine_session(
    folder: Path,
    estimator: Estimator | None,
    resolution: int,
    progress: Callable[[float], None] = lambda _: None,
) -> RefinementRecord:
    """Replace the session's maps by refined ones, resolution x resolution; add uncertainty/*.png.

    estimator: whose maps the refinement starts at; None for the classical optimisation without a prior,
    which has no uncertainty. Raises SessionError or ImageError; then nothing has changed.
    """
    session = Session.open(folder)
    manifest = session.manifest
    if not manifest.used:
        raise SessionError(f"{folder} has no shot to refine from; capture some first.")
    pictures: list[Picture] = []
    network: Maps | None = None
    developer = Developer(session, resolution)
    for saved in session.saved():
        seen = developer.develop(saved)
        pictures.append(seen.picture)
        network = estimator.add(seen.picture) if estimator else None
        progress(_LOADED * len(pictures) / len(manifest.used))
    numbers = [record.shot.index + 1 for record in manifest.used]
    if estimator is None:
        maps, record = (
            optimise(pictures, resolution),
            RefinementRecord(finished=datetime.now(UTC), resolution=resolution, prior=False),
        )
    else:
        done = refine(
            pictures, network, resolution, lambda s: progress(_LOADED + (1 - _LOADED) * s)
        )
        reachable = reachable_share(manifest.config, done.learned, manifest.thickness_mm)
        maps, record = done.maps, refinement_record(resolution, numbers, done.quality, reachable)
        save_uncertainty(done.uncertainty, folder)
    session.save_maps(maps, relit(maps))
    session.save_refinement(record)
    progress(1.0)
    return record


def refinement_record(
    resolution: int, numbers: Sequence[int], quality: Quality, reachable: float | None
) -> RefinementRecord:
    """numbers: of the shots, in the order of the quality's."""
    errors = zip(numbers, quality.by_shot, strict=True)
    return RefinementRecord(
        finished=datetime.now(UTC),
        resolution=resolution,
        prior=True,
        relighting_error=quality.relighting_error,
        relighting_error_by_shot={number: e for number, e in errors if e is not None},
        bad_shots=tuple(numbers[shot] for shot in quality.bad),
        highlight_reachable=reachable,
    )


def save_uncertainty(uncertainty: Uncertainty, folder: Path) -> None:
    """16-bit PNG, linear: halves of the 95 % intervals; normal.png holds the ellipse of nx/nz and ny/nz, its
    extent along both in red and green, and its correlation from -1 to 1 in blue."""
    with contextlib.suppress(FileExistsError):
        (folder / "uncertainty").mkdir()
    deviation = np.sqrt(np.maximum(uncertainty.slopes[..., :2], 1e-12))
    correlation = np.clip(
        uncertainty.slopes[..., 2:] / deviation.prod(axis=-1, keepdims=True), -1, 1
    )
    size = radius(uncertainty.slopes)
    ellipse = deviation / size * half_width(size, "normal", 95)
    images = {"normal": np.concatenate([ellipse, (correlation + 1) / 2], axis=-1)}
    for name in ("diffuse", "roughness", "specular"):
        images[name] = half_width(getattr(uncertainty, name), name, 95)
    for name, image in images.items():
        bits = np.rint(np.clip(image, 0, 1) * 65535).astype(np.uint16)
        png = bytes(cv2.imencode(".png", bits[..., ::-1])[1])
        durable.write(folder / f"uncertainty/{name}.png", png)
