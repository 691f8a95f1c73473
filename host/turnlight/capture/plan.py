"""Which shots to take: view and light pairs spread evenly, in an order that spares the table."""

import itertools
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from turnlight.config import RigConfig
from turnlight.errors import ConfigError

STEP_DEG = 15
FIRST_BLOCK = 3
TURN_DEG_PER_S = 150.0
WORK_S = 2.0
"""What one shot takes besides turning and exposing: storing, rectifying and estimating."""


@dataclass(frozen=True)
class Shot:
    """What is asked of the rig for one picture.

    index: place in the plan, from 0. angle_deg: table angle in [0, 360). leds: numbers of the LEDs
    that are lit, all others being dark.
    """

    index: int
    angle_deg: float
    leds: tuple[int, ...]
    exposure_us: int
    gain: float


@dataclass(frozen=True)
class _Candidate:
    angle_deg: float
    led: int


def plan(config: RigConfig, shots: int, thickness_mm: float) -> tuple[Shot, ...]:
    """The `shots` best shots of a sample this thick, always the same for the same rig.

    Farthest-point sampling over (half vector, light direction) in the sample's frame, from the
    mirror pair of a flat sample on. The shots are then reordered inside blocks of 3, 3, 6, 12, ...
    (each doubles the capture so far), every block one sweep of the table: the table turns little,
    and whenever the capture ends, what it has is spread well.
    """
    candidates = _candidates(config)
    if not 1 <= shots <= len(candidates):
        raise ConfigError(f"{shots} shots cannot be planned; ask for 1 to {len(candidates)}.")
    spread = _farthest_points(_features(config, candidates, thickness_mm), shots)
    ordered = _sweep_in_blocks([candidates[i] for i in spread])
    exposure_us, gain = config.camera.exposure_us, config.camera.gain
    return tuple(
        Shot(index, c.angle_deg, (c.led,), exposure_us, gain) for index, c in enumerate(ordered)
    )


def total_turn_deg(angles_deg: Iterable[float], start_deg: float = 0.0) -> float:
    """How far the table turns in all from `start_deg` (home) on, the shorter way each time."""
    return sum(turn_deg(a, b) for a, b in itertools.pairwise([start_deg, *angles_deg]))


def expected_s(shots: Sequence[Shot]) -> float:
    """About how long a capture of these shots takes."""
    exposed = sum(shot.exposure_us for shot in shots) / 1e6
    turned = total_turn_deg(shot.angle_deg for shot in shots) / TURN_DEG_PER_S
    return len(shots) * WORK_S + turned + exposed


def turn_deg(from_deg: float, to_deg: float) -> float:
    """The shorter way between two table angles, in [0, 180]."""
    return abs(signed_turn_deg(from_deg, to_deg))


def signed_turn_deg(from_deg: float, to_deg: float) -> float:
    """The turn that leads from one table angle to another the shorter way, in [-180, 180)."""
    return (to_deg - from_deg + 180) % 360 - 180


def _candidates(config: RigConfig) -> list[_Candidate]:
    angles = range(0, 360, STEP_DEG)
    return [_Candidate(float(angle), led) for angle in angles for led in range(config.led_count)]


def _features(
    config: RigConfig, candidates: list[_Candidate], thickness_mm: float
) -> npt.NDArray[np.float64]:
    """(candidates, 6): half vector and light direction at the sample's centre, in its own frame."""
    camera = config.camera_position_mm(thickness_mm)
    leds = config.led_positions_mm(thickness_mm)
    rows = []
    for c in candidates:
        view = _unit(config.to_sample_frame(camera, c.angle_deg))
        light = _unit(config.to_sample_frame(leds[c.led], c.angle_deg))
        rows.append(np.concatenate([_unit(view + light), light]))
    return np.stack(rows)


def _farthest_points(features: npt.NDArray[np.float64], count: int) -> list[int]:
    # Rounded, so that candidates which are equal by symmetry are told apart by their number and not
    # by the last bit, which differs between machines.
    chosen = [int(np.argmax(np.round(features[:, 2], 9)))]
    nearest = np.full(len(features), np.inf)
    while len(chosen) < count:
        to_last = np.linalg.norm(features - features[chosen[-1]], axis=1)
        nearest = np.minimum(nearest, to_last)
        chosen.append(int(np.argmax(np.round(nearest, 9))))
    return chosen


def _sweep_in_blocks(spread: list[_Candidate]) -> list[_Candidate]:
    ordered: list[_Candidate] = []
    while len(ordered) < len(spread):
        block = spread[len(ordered) : 2 * len(ordered) or FIRST_BLOCK]
        ordered += _sweep(block, ordered[-1].angle_deg if ordered else 0.0)
    return ordered


def _sweep(block: list[_Candidate], start_deg: float) -> list[_Candidate]:
    """The block in the shortest order among: from each of its angles on, once around either way."""
    around = sorted(block, key=lambda c: (c.angle_deg, c.led))
    rotations = [around[i:] + around[:i] for i in range(len(around))]
    orders = [order for r in rotations for order in (r, r[:1] + r[:0:-1])]
    return min(orders, key=lambda o: total_turn_deg((c.angle_deg for c in o), start_deg))


def _unit(vector: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    result: npt.NDArray[np.float64] = vector / np.linalg.norm(vector)
    return result
