"""Sets of simulated phone shots of one sample: most of them good, some made bad on purpose."""

import math
from dataclasses import dataclass, replace
from pathlib import Path

import cv2
import numpy as np

from svbrdf.maps import Maps
from svbrdf.procedural import TEST_SEEDS, material
from turnlight.handheld.verdict import Problem
from turnlight.picture.marked_frame import MarkedFrame
from turnlight.simulation.phone import Conditions, Phone, PhoneShot, phone, photograph, pose

APART_DEG = 10.0
DETAIL_DB = 34.0
SIDE_MM, OTHER_MM = 100, 80


@dataclass(frozen=True)
class Shot:
    """path: the file. bad: None for a good one. true: everything about it."""

    path: Path
    bad: Problem | None
    how: Conditions
    true: PhoneShot


@dataclass(frozen=True)
class Sample:
    """One sample's shots, by one phone."""

    phone: Phone
    material: Maps
    shots: list[Shot]

    @property
    def good(self) -> list[Shot]:
        return [shot for shot in self.shots if shot.bad is None]


def take(
    folder: Path,
    seed: int,
    good: int,
    bad: tuple[Problem, ...] = (),
    *,
    width_px: int = 4032,
    lamps: float = 0.2,
    maps: Maps | None = None,
    resolution: int = 512,
) -> Sample:
    """Shots of one material with one phone, written under folder. lamps: share that a lamp lights."""
    rng = np.random.default_rng(seed)
    used = phone(rng, width_px, width_px * 3 // 4)
    used = replace(used, tells_focal=bool(rng.random() < 0.7))
    maps = maps or material(TEST_SEEDS[seed % len(TEST_SEEDS)], 1024)
    frame = MarkedFrame(SIDE_MM)
    shots: list[Shot] = []
    directions: list[np.ndarray] = []
    for number, kind in enumerate((*[None] * good, *bad)):
        how = _good(rng, used, frame, directions, lamps)
        taken_in = frame
        match kind:
            case Problem.FRAME:
                covered = rng.choice(8, int(rng.integers(5, 8)), replace=False)
                how = replace(how, hidden=tuple(int(place) for place in covered))
            case Problem.SMALL:
                elevation = float(rng.uniform(40, 80))
                how = replace(
                    how,
                    pose=pose(
                        rng, used, frame, elevation, rng.uniform(0.06, 0.13) * 3024 / used.height_px
                    ),
                    light_mm=None,
                )
            case Problem.OBLIQUE:
                elevation = float(rng.uniform(14, 22))
                how = replace(how, pose=pose(rng, used, frame, elevation, 0.6), light_mm=None)
            case Problem.SIZE:
                taken_in = MarkedFrame(OTHER_MM)
                how = replace(how, pose=pose(rng, used, taken_in, 60, 0.7), light_mm=None)
            case Problem.CLIPPED:
                how = replace(how, exposure=float(rng.uniform(1.8, 3)))
            case Problem.BLURRED if rng.random() < 0.5 and _has_detail(maps):
                how = replace(how, sample_blur=float(rng.uniform(2, 4)) / 512)
            case Problem.BLURRED:
                length = float(rng.uniform(0.008, 0.02)) * used.height_px
                how = replace(how, motion_px=length, motion_rad=float(rng.uniform(0, math.pi)))
            case Problem.SHADOW:
                hand = (rng.uniform(0, 50), rng.uniform(25, 60), rng.uniform(0, 2 * math.pi))
                how = replace(how, shadow=hand, darkness=float(rng.uniform(0.3, 0.65)))
            case Problem.DUPLICATE:
                how = replace(shots[0].how, exposure=how.exposure, tint=how.tint)
        true = photograph(used, taken_in, maps, how, rng, resolution=resolution)
        path = folder / f"{seed:04d}-{number:02d}.jpg"
        path.write_bytes(true.jpeg)
        shots.append(Shot(path, kind, how, true))
    return Sample(used, maps, shots)


def _has_detail(maps: Maps) -> bool:
    """Whether a blur of the sample alone takes anything away."""
    image = maps.diffuse.mean(axis=-1) ** (1 / 2.2)
    blurred = cv2.GaussianBlur(image, (0, 0), 2 / 512 * len(image))
    return float(np.mean((image - blurred) ** 2)) > 10 ** (-DETAIL_DB / 10)


def _good(
    rng: np.random.Generator,
    used: Phone,
    frame: MarkedFrame,
    directions: list[np.ndarray],
    lamps: float,
) -> Conditions:
    """From a side that no other has been taken from."""
    while True:
        elevation = math.degrees(math.asin(rng.uniform(math.sin(math.radians(30)), 1)))
        where = pose(rng, used, frame, elevation, rng.uniform(0.55, 0.75))
        rotation, translation = where
        camera = -rotation.T @ translation
        toward = camera / np.linalg.norm(camera)
        far = math.cos(math.radians(APART_DEG))
        if all(float(toward @ other) < far for other in directions):
            directions.append(toward)
            break
    lamp = None
    if rng.random() < lamps:
        height, around = math.radians(rng.uniform(35, 75)), rng.uniform(0, 2 * math.pi)
        flat = math.cos(height)
        direction = np.array([flat * math.cos(around), flat * math.sin(around), math.sin(height)])
        lamp = direction * rng.uniform(250, 400)
    scale = used.height_px / 3024
    return Conditions(
        where,
        light_mm=lamp,
        exposure=float(rng.uniform(0.3, 0.45)),
        ambient=float(rng.uniform(0, 0.08)),
        tint=(float(rng.normal(1, 0.08)), 1.0, float(rng.normal(1, 0.08))),
        blur_px=float(rng.uniform(0.6, 1.1)) * max(scale, 0.6),
        noise=float(rng.uniform(0.004, 0.012)),
        hidden=tuple(int(p) for p in rng.choice(8, int(rng.integers(0, 3)), replace=False)),
    )
