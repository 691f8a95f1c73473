"""The adaptive plan: after each shot, the one to take next."""

from collections.abc import Iterable, Sequence

from svbrdf.lighting import Lighting
from turnlight.capture.plan import STEP_DEG, TURN_DEG_PER_S, WORK_S, Shot, turn_deg
from turnlight.config import RigConfig
from turnlight.estimate import next_shot
from turnlight.estimate.learning import Learned
from turnlight.estimate.next_shot import Candidate
from turnlight.frame import Exposure
from turnlight.picture.lighting import lighting

ARC = 5
"""Neighbouring LEDs of a ring that an extended shot lights together."""


def next_best(
    config: RigConfig, learned: Learned, taken: Sequence[Shot], thickness_mm: float
) -> Shot:
    """The shot, among those not taken, that tells most per second; arcs of LEDs too for a shiny sample.

    learned: from the pictures of all shots taken so far, at least one.
    """
    before = {(shot.angle_deg, shot.leds) for shot in taken}
    lit = led_choices(config, arcs=next_shot.shiny(learned))
    asked = [
        (float(angle), leds)
        for angle in range(0, 360, STEP_DEG)
        for leds in lit
        if (float(angle), leds) not in before
    ]
    here_deg = taken[-1].angle_deg
    candidates = [
        Candidate(
            light_at_centre(config, angle, leds, thickness_mm),
            WORK_S + turn_deg(here_deg, angle) / TURN_DEG_PER_S,
        )
        for angle, leds in asked
    ]
    angle, leds = asked[next_shot.best(learned, candidates)]
    exposure_us = max(100, config.camera.exposure_us // len(leds))
    return Shot(len(taken), angle, leds, exposure_us, config.camera.gain)


def reachable_share(config: RigConfig, learned: Learned, thickness_mm: float) -> float:
    """The share of the sample whose highlight some shot of this rig can catch."""
    angles = range(0, 360, STEP_DEG)
    singles = led_choices(config, arcs=False)
    shots = [
        light_at_centre(config, float(angle), leds, thickness_mm)
        for angle in angles
        for leds in singles
    ]
    return next_shot.reachable_share(learned, shots)


def led_choices(config: RigConfig, arcs: bool) -> tuple[tuple[int, ...], ...]:
    """Every LED alone, and with `arcs` every ARC neighbours of a ring that has more than that."""
    choices: list[tuple[int, ...]] = [(led,) for led in range(config.led_count)]
    first = 0
    for ring in config.ring if arcs else ():
        if ring.count > ARC:
            choices += [_arc(first, start, ring.count) for start in range(ring.count)]
        first += ring.count
    return tuple(choices)


def light_at_centre(
    config: RigConfig, angle_deg: float, leds: Iterable[int], thickness_mm: float
) -> Lighting:
    """A shot's lighting, its white being that at the sample's centre, (1, 1, 3)."""
    exposure = Exposure(config.camera.exposure_us, config.camera.gain)
    return lighting(config, tuple(leds), angle_deg, exposure, thickness_mm, 1)


def _arc(first: int, start: int, count: int) -> tuple[int, ...]:
    return tuple(sorted(first + (start + k) % count for k in range(ARC)))
