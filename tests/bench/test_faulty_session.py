"""One LED dead, one shot blurred, one shadowed, 3 % of the pixels clipped: what ten shots are still worth.

TURNLIGHT_MATERIALS: a folder of material sets, of which the validation split's take the place of the procedural
ones.
"""

import os
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest

from svbrdf import materials, split
from svbrdf.maps import Maps
from svbrdf.procedural import VALIDATION_SEEDS, material
from svbrdf.scores import renderings, score
from turnlight.estimate.estimator import Estimator
from turnlight.estimate.refine import Refinement, refine
from turnlight.picture.picture import Picture
from turnlight.study import SimulatedRig

pytestmark = [pytest.mark.bench, pytest.mark.timeout(3600)]
LIBRARY = os.environ.get("TURNLIGHT_MATERIALS")
PROCEDURAL, CROP, RESOLUTION, SHOTS = 4, 512, 128, 10
DEAD, BLURRED, SHADOWED = 2, 4, 7
SENSOR_NOISE, BLUR, UMBRA, CLIPPED = 3e-4, 1.5 / 128, 0.35, 0.03


def test_three_bad_shots_and_clipping_cost_little() -> None:
    print()
    lost: list[float] = []
    named: list[set[int]] = []
    for seed, (name, truth) in enumerate(truths()):
        rig = SimulatedRig(truth, seed)
        clean = [rig.take(shot) for shot in rig.plan(SHOTS)]
        expected, found = refined(clean), refined(spoiled(clean))
        true = materials.reduced(truth, RESOLUTION, RESOLUTION)
        shown = renderings(true)
        before, after = (score(r.maps, true, shown).ssim for r in (expected, found))
        print(
            f"{name:18} SSIM {before:.3f}, spoiled {after:.3f}; bad: {found.quality.bad}",
            flush=True,
        )
        lost.append(before - after)
        named.append(set(found.quality.bad))
    assert all(bad == {DEAD, BLURRED, SHADOWED} for bad in named)
    assert max(lost) < 0.02


def truths() -> Iterator[tuple[str, Maps]]:
    if LIBRARY:
        for folder in split.folders(Path(LIBRARY), split.VALIDATION):
            yield folder.name, materials.averaged(materials.load(folder), CROP, CROP)
    else:
        for seed in VALIDATION_SEEDS[:PROCEDURAL]:
            yield f"seed {seed}", material(seed, CROP)


def refined(pictures: list[Picture]) -> Refinement:
    network = Estimator()
    return refine(pictures, [network.add(picture) for picture in pictures][-1], RESOLUTION)


def spoiled(pictures: list[Picture]) -> list[Picture]:
    result = [overexposed(picture) for picture in pictures]
    noise = np.random.default_rng(0).normal(0, SENSOR_NOISE, pictures[DEAD].image.shape)
    result[DEAD] = replace(pictures[DEAD], image=noise.astype(np.float32))
    size = len(pictures[BLURRED].image)
    soft = cv2.GaussianBlur(result[BLURRED].image, (0, 0), BLUR * size)
    result[BLURRED] = replace(result[BLURRED], image=soft.astype(np.float32))
    x = (np.arange(size) + 0.5) / size
    edge = np.clip((x[:, None] + x - 0.9) / 0.1, 0, 1)[..., None]
    shade = (UMBRA + (1 - UMBRA) * edge).astype(np.float32)
    result[SHADOWED] = replace(result[SHADOWED], image=result[SHADOWED].image * shade)
    return result


def overexposed(picture: Picture) -> Picture:
    """The sensor full where the brightest 3 % are."""
    full = np.quantile(picture.image.max(axis=-1), 1 - CLIPPED)
    clipped = picture.clipped | (picture.image.max(axis=-1) >= full)
    return replace(picture, image=np.minimum(picture.image, full), clipped=clipped)
