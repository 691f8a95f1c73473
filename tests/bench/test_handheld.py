"""500 simulated phone shots at 12 megapixels: what the checks catch, and how exact the rest is.

TURNLIGHT_SHOTS: how many. TURNLIGHT_SHOTS_LOG: a file with which a run that was cut off goes on.
"""

import json
import os
import shutil
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

import cv2
import numpy as np
import pytest
from phone_shots import Shot, take

from turnlight import app
from turnlight.handheld.verdict import Problem
from turnlight.picture.marked_frame import MARKERS

pytestmark = [pytest.mark.bench, pytest.mark.timeout(24 * 3600)]
SETS = int(os.environ.get("TURNLIGHT_SHOTS", "500")) // 8
GOOD, BAD = 5, 3
Row = tuple[str | None, bool, float, float, float]
"""What is wrong with a shot, whether it was used, the share of its `visible` markers that was found, their
corners' median error in px, its picture's dB."""


def test_checks_corners_and_pictures(tmp_path: Path) -> None:
    log = Path(os.environ.get("TURNLIGHT_SHOTS_LOG", tmp_path / "shots.jsonl"))
    seen = [row for rows in logged(log, tmp_path) for row in rows]
    good, bad = ([row for row in seen if (row[0] is None) == wanted] for wanted in (True, False))
    used = [row for row in good if row[1]]
    caught = sum(not row[1] for row in bad) / len(bad)
    refused = 1 - len(used) / len(good)
    found, corners = np.mean([r[2] for r in used]), np.median([r[3] for r in used])
    decibels = np.array([r[4] for r in used])
    print(f"\n{len(seen)} shots of 12 MP: {caught:.1%} of {len(bad)} bad ones caught, {refused:.1%} of "
          f"{len(good)} good ones refused; {found:.1%} of the markers found, median corner error "
          f"{corners:.3f} px; rectified pictures {np.median(decibels):.1f} dB, at least "
          f"{decibels.min():.1f}")  # fmt: skip
    print("missed:", sorted(str(row[0]) for row in bad if row[1]))
    assert caught >= 0.95
    assert refused <= 0.02
    assert found >= 0.99
    assert corners <= 0.3
    assert np.quantile(decibels, 0.05) >= 32


def logged(log: Path, folder: Path) -> Iterator[list[Row]]:
    """All sets' rows; those that the log does not have are taken, and added to it."""
    done = dict(map(json.loads, log.read_text().splitlines())) if log.exists() else {}
    yield from (rows for seed, rows in done.items() if seed < SETS)
    left = [seed for seed in range(SETS) if seed not in done]
    with ProcessPoolExecutor(os.cpu_count()) as workers, log.open("a") as file:
        for seed, rows in zip(left, workers.map(one_set, left, [folder] * len(left)), strict=True):
            print(json.dumps([seed, rows]), file=file, flush=True)
            yield rows


def one_set(seed: int, folder: Path) -> list[Row]:
    cv2.setNumThreads(1)
    own = folder / str(seed)
    own.mkdir()
    chosen = np.random.default_rng(seed + 10**6).choice(list(Problem), BAD, replace=False)
    sample = take(own, seed, GOOD, tuple(Problem(b) for b in chosen))
    session = app.new_handheld("bench", 0.85, own / "session")
    rows: list[Row] = []
    verdicts = session.add(shot.path for shot in sample.shots)
    for shot, verdict in zip(sample.shots, verdicts, strict=True):
        found = error = decibel = float("nan")
        photo = session.manifest.photos[verdict.number - 1]
        if verdict.used and photo.frame is not None and shot.bad is None:
            places = photo.frame.sighting.places
            found = len(places) / visible(shot)
            off = photo.frame.sighting.corners_px - shot.true.corners_px[places]
            error = float(np.median(np.linalg.norm(off, axis=-1)))
            decibel = psnr(session._picture(photo).image, shot.true.ideal)
        bad = None if shot.bad is None else shot.bad.value
        rows.append((bad, verdict.used, found, error, decibel))
    shutil.rmtree(own)
    return rows


def visible(shot: Shot) -> int:
    """How many of the frame's markers are uncovered and whole in the photo."""
    height, width = cv2.imread(str(shot.path)).shape[:2]
    inside = ((shot.true.corners_px > 0) & (shot.true.corners_px < (width, height))).all(
        axis=(1, 2)
    )
    return sum(inside[place] for place in range(MARKERS) if place not in shot.how.hidden)


def psnr(image: np.ndarray, ideal: np.ndarray) -> float:
    """dB at the network's resolution, as it sees them: clipped, gamma 2.2."""
    ours, theirs = (
        cv2.resize(np.clip(i, 0, 1), (256, 256), interpolation=cv2.INTER_AREA) ** (1 / 2.2)
        for i in (image, ideal)
    )
    return float(-10 * np.log10(np.mean((ours - theirs) ** 2)))
