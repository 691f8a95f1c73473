"""500 simulated phone shots at 12 megapixels: what the checks catch, and how exact the rest is."""

import os
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

import cv2
import numpy as np
import pytest
from phone_shots import take

from turnlight import app
from turnlight.handheld.refining import developed
from turnlight.handheld.verdict import Problem

pytestmark = [pytest.mark.bench, pytest.mark.timeout(24 * 3600)]
SETS = int(os.environ.get("TURNLIGHT_SHOTS", "500")) // 8
GOOD, BAD = 5, 3


def test_checks_corners_and_pictures(tmp_path: Path) -> None:
    with ProcessPoolExecutor(os.cpu_count()) as workers:
        seen = [
            row for rows in workers.map(one_set, range(SETS), [tmp_path] * SETS) for row in rows
        ]
    good, bad = ([row for row in seen if (row[0] is None) == wanted] for wanted in (True, False))
    used = [row for row in good if row[1]]
    caught = sum(not row[1] for row in bad) / len(bad)
    refused = 1 - len(used) / len(good)
    corners, decibels = np.median([r[2] for r in used]), np.array([r[3] for r in used])
    print(f"\n{len(seen)} shots of 12 MP: {caught:.1%} of {len(bad)} bad ones caught, {refused:.1%} of "
          f"{len(good)} good ones refused; median corner error {corners:.3f} px; rectified pictures "
          f"{np.median(decibels):.1f} dB, at least {decibels.min():.1f}")  # fmt: skip
    print("missed:", sorted(str(row[0]) for row in bad if row[1]))
    assert caught >= 0.95
    assert refused <= 0.02
    assert corners <= 0.3
    assert np.quantile(decibels, 0.05) >= 32


def one_set(seed: int, folder: Path) -> list[tuple[str | None, bool, float, float]]:
    """Of each shot: what is wrong with it, whether it was used, its corners' median error, its dB."""
    cv2.setNumThreads(1)
    own = folder / str(seed)
    own.mkdir()
    chosen = np.random.default_rng(seed + 10**6).choice(list(Problem), BAD, replace=False)
    sample = take(own, seed, GOOD, tuple(Problem(b) for b in chosen))
    session = app.new_handheld("bench", 0.85, own / "session")
    rows: list[tuple[str | None, bool, float, float]] = []
    verdicts = session.add(shot.path for shot in sample.shots)
    for shot, verdict in zip(sample.shots, verdicts, strict=True):
        error = decibel = float("nan")
        frame = session.manifest.photos[verdict.number - 1].frame
        if verdict.used and frame is not None and shot.bad is None:
            places = frame.sighting.places
            off = frame.sighting.corners_px - shot.true.corners_px[places]
            error = float(np.median(np.linalg.norm(off, axis=-1)))
            picture = developed(session._folder, verdict.number, 512)
            decibel = psnr(picture.image, shot.true.ideal)
        rows.append((None if shot.bad is None else shot.bad.value, verdict.used, error, decibel))
    for file in own.glob("*.jpg"):
        file.unlink()
    return rows


def psnr(image: np.ndarray, ideal: np.ndarray) -> float:
    """dB at the network's resolution, as it sees them: clipped, gamma 2.2."""
    ours, theirs = (
        cv2.resize(np.clip(i, 0, 1), (256, 256), interpolation=cv2.INTER_AREA) ** (1 / 2.2)
        for i in (image, ideal)
    )
    return float(-10 * np.log10(np.mean((ours - theirs) ** 2)))
