"""The adaptive plan: after each shot, the one to take next."""

from collections.abc import Iterable, Sequence

from svbrdf.lighting import Lighting
from svbrdf.maps import Maps
from turnlight.capture.manifest import Manifest
from turnlight.capture.plan import (
    FIRST_BLOCK,
    STEP_DEG,
    TURN_DEG_PER_S,
    WORK_S,
    Shot,
    plan,
    turn_deg,
)
from turnlight.config import RigConfig
from turnlight.estimate import next_shot
from turnlight.estimate.brdf_kernel import from_maps
from turnlight.estimate.learning import Learned, learn
from turnlight.estimate.next_shot import Candidate
from turnlight.estimate.noise import noise_of
from turnlight.estimate.observations import scaled
from turnlight.estimate.refine import resized
from turnlight.frame import Exposure
from turnlight.picture.lighting import lighting
from turnlight.picture.picture import Picture
from turnlight.preset import Preset

RESOLUTION = 64
"""Of pictures, for choosing."""
ARC = 5
"""Neighbouring LEDs of a ring that an extended shot lights together."""


def first_shots(config: RigConfig, preset: Preset, thickness_mm: float) -> tuple[Shot, ...]:
    """The shots that a session starts with: all of them, or of an adaptive order the first few."""
    adaptive = preset.order == "adaptive"
    shots = min(preset.shots, FIRST_BLOCK) if adaptive else preset.shots
    return plan(config, shots, thickness_mm)


class Chooser:
    """Chooses a session's next shot by the pictures so far; keeps none of them for a fixed order."""

    def __init__(self, manifest: Manifest) -> None:
        self._manifest = manifest
        self._pictures: list[Picture] = []
        self._maps: Maps | None = None

    def add(self, picture: Picture, maps: Maps) -> None:
        """One more picture, and the maps by all so far."""
        if self._manifest.preset.order == "adaptive":
            self._pictures.append(scaled(picture, RESOLUTION))
            self._maps = maps

    def choose(self, before: Sequence[Shot]) -> Shot:
        """The shot after those of the plan so far; without pictures, the fixed plan's."""
        config, thickness_mm = self._manifest.config, self._manifest.thickness_mm
        if self._maps is None:
            return plan(config, len(before) + 1, thickness_mm)[-1]
        noises = noise_of(self._pictures)
        guess = resized(from_maps(self._maps), RESOLUTION)
        learned = learn(self._pictures, noises, guess)
        return next_best(config, learned, before, thickness_mm)


def next_best(
    config: RigConfig, learned: Learned, planned: Sequence[Shot], thickness_mm: float
) -> Shot:
    """The shot, among those not planned, that tells most per second; arcs of LEDs too for a shiny sample.

    learned: from the pictures of all shots so far, at least one.
    """
    config = _known(config)
    before = {(shot.angle_deg, shot.leds) for shot in planned}
    lit = led_choices(config, arcs=next_shot.shiny(learned))
    asked = [
        (float(angle), leds)
        for angle in range(0, 360, STEP_DEG)
        for leds in lit
        if (float(angle), leds) not in before
    ]
    here_deg = planned[-1].angle_deg
    candidates = [
        Candidate(
            light_at_centre(config, angle, leds, thickness_mm),
            WORK_S + turn_deg(here_deg, angle) / TURN_DEG_PER_S,
        )
        for angle, leds in asked
    ]
    angle, leds = asked[next_shot.best(learned, candidates)]
    exposure_us = max(100, config.camera.exposure_us // len(leds))
    return Shot(len(planned), angle, leds, exposure_us, config.camera.gain)


def reachable_share(config: RigConfig, learned: Learned, thickness_mm: float) -> float:
    """The share of the sample whose highlight some shot of this rig can catch."""
    config = _known(config)
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


def _known(config: RigConfig) -> RigConfig:
    """The same, its geometry worked out once for all candidates."""
    return config.calibrated(config.geometry)


def _arc(first: int, start: int, count: int) -> tuple[int, ...]:
    return tuple(sorted(first + (start + k) % count for k in range(ARC)))
