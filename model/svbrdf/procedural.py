"""Procedural materials: a pattern, dressed as stone, fabric, wood, plastic, metal or paint over metal.

A seed gives the same material at every run. Seeds below VALIDATION_SEEDS.start are for training.
"""

import math
from collections.abc import Callable

import numpy as np

from svbrdf.maps import Maps
from svbrdf.patterns import PATTERNS, Field, Pattern, Rng, noise, smoothstep

TRAINING_SEEDS = range(0, 1_000_000)
VALIDATION_SEEDS = range(1_000_000, 1_001_000)
TEST_SEEDS = range(2_000_000, 2_001_000)


def material(seed: int, resolution: int) -> Maps:
    """Tileable float32 numpy maps (resolution, resolution, ...) of the material with this seed."""
    rng = np.random.default_rng(seed)
    pattern = PATTERNS[int(rng.integers(len(PATTERNS)))](rng, resolution)
    fields = _Fields(rng, pattern)
    normal = _normals(rng, pattern.height)
    roughness = _roughness(rng, fields)
    paint = _ramp(rng, fields.blend(), _palette(rng, _paint))
    metal = _ramp(rng, fields.blend(), _palette(rng, _metal))
    f0 = 0.04 if rng.random() < 0.6 else rng.uniform(0.02, 0.08)
    metalness = _metalness(rng, fields)[..., None]
    diffuse = paint * (1 - metalness) + rng.uniform(0, 0.02) * metalness
    specular = f0 * (1 - metalness) + metal * metalness
    maps = (normal, diffuse, roughness[..., None], specular)
    return Maps(*(np.ascontiguousarray(a, np.float32) for a in maps))


def mirror(seed: int, resolution: int) -> Maps:
    """That material as a polished metal, of which the material sets have few."""
    maps, rng = material(seed, resolution), np.random.default_rng((seed, 1))
    polish = rng.uniform(0.05, 0.25) / maps.roughness.mean()
    roughness = np.clip(maps.roughness * polish, 0.05, 1)
    contrast = rng.random() ** 2
    specular = rng.uniform(0.3, 0.98) * (1 - contrast * (1 - maps.diffuse / maps.diffuse.max()))
    parts = (maps.normal, 0.01 * maps.diffuse, roughness, specular)
    return Maps(*(np.asarray(part, np.float32) for part in parts))


def steep(seed: int, resolution: int) -> Maps:
    """That material in deep relief, 20 to 45 degrees in the mean unless it is flat."""
    maps, rng = material(seed, resolution), np.random.default_rng((seed, 2))
    slopes = maps.normal[..., :2] / maps.normal[..., 2:]
    wanted = math.tan(math.radians(rng.uniform(20, 45)))
    slopes = slopes * (wanted / max(float(np.linalg.norm(slopes, axis=-1).mean()), 1e-3))
    normal = np.concatenate([slopes, np.ones_like(slopes[..., :1])], axis=-1)
    normal = normal / np.linalg.norm(normal, axis=-1, keepdims=True)
    return Maps(normal, maps.diffuse, maps.roughness, maps.specular)


class _Fields:
    """The scalar fields a map may follow: the pattern's own and noises it knows nothing of."""

    def __init__(self, rng: Rng, pattern: Pattern) -> None:
        n = pattern.height.shape[0]
        self._rng = rng
        self.pattern = pattern
        self.fine = noise(rng, n, rng.uniform(0.4, 1.2), 10)
        self.coarse = noise(rng, n, rng.uniform(1.5, 3), rng.choice([1.0, 2.0, 4.0]))

    def blend(self) -> Field:
        """A random mixture, stretched to [0, 1]."""
        pattern = self.pattern
        parts = (pattern.height, pattern.piece, pattern.seam, self.fine, self.coarse)
        weights = self._rng.dirichlet(np.full(len(parts), 0.5)) * self._rng.choice(
            [-1, 1], len(parts)
        )
        mixture = sum(w * p for w, p in zip(weights, parts, strict=True))
        low, high = np.percentile(mixture, [1, 99])
        return np.clip((mixture - low) / (high - low + 1e-6), 0, 1).astype(np.float32)


def _normals(rng: Rng, height: Field) -> Field:
    n = height.shape[0]
    if rng.random() < 0.08:
        height = np.zeros_like(height)
    slope_x = (np.roll(height, -1, 1) - np.roll(height, 1, 1)) * n / 2
    slope_y = (np.roll(height, 1, 0) - np.roll(height, -1, 0)) * n / 2
    typical = math.sqrt(float((slope_x**2 + slope_y**2).mean())) + 1e-6
    strength = math.exp(rng.uniform(math.log(0.03), math.log(0.5))) / typical
    normal = np.stack([-strength * slope_x, -strength * slope_y, np.ones_like(height)], axis=-1)
    return normal / np.linalg.norm(normal, axis=-1, keepdims=True)


def _roughness(rng: Rng, fields: _Fields) -> Field:
    middle = rng.beta(2.0, 1.5) * 0.9 + 0.05
    spread = rng.choice([0.02, 0.1, 0.25, 0.5]) * rng.random()
    rough = middle + spread * (fields.blend() - 0.5)
    if rng.random() < 0.3:
        rough = rough + rng.uniform(-0.3, 0.3) * fields.pattern.seam
    return np.clip(rough, 0.05, 1.0).astype(np.float32)


def _metalness(rng: Rng, fields: _Fields) -> Field:
    kind = rng.random()
    shape = fields.coarse.shape
    if kind < 0.84:
        return np.zeros(shape, np.float32)
    if kind < 0.94:
        return np.ones(shape, np.float32)
    threshold = rng.uniform(0.3, 0.7)
    return smoothstep(threshold - 0.03, threshold + 0.03, fields.blend())


def _ramp(rng: Rng, position: Field, colours: Field) -> Field:
    """(n, n, 3) colours along a palette (k, 3)."""
    stops = np.sort(np.concatenate([[0.0, 1.0], rng.random(len(colours) - 2)]))
    channels = [np.interp(position, stops, colours[:, c]) for c in range(3)]
    return np.stack(channels, axis=-1).astype(np.float32)


def _palette(rng: Rng, colour: Callable[[Rng], Field]) -> Field:
    first = colour(rng)
    contrast = rng.choice([0.1, 0.4, 1.0], p=[0.3, 0.4, 0.3])
    others = [first * (1 - contrast) + colour(rng) * contrast for _ in range(rng.integers(1, 5))]
    return np.stack([first, *others])


def _paint(rng: Rng) -> Field:
    luminance = math.exp(rng.uniform(math.log(0.02), math.log(0.85)))
    chroma = rng.normal(0, 1, 3) * rng.choice([0.05, 0.25, 0.7])
    earthy = np.array([0.25, 0.0, -0.35]) * rng.random() * (rng.random() < 0.6)
    return np.clip(luminance * np.exp(chroma - chroma.mean() + earthy), 0.005, 0.95).astype(
        np.float32
    )


def _metal(rng: Rng) -> Field:
    known = np.array(
        [
            [0.56, 0.57, 0.58],
            [0.91, 0.92, 0.92],
            [1.0, 0.71, 0.29],
            [0.95, 0.64, 0.54],
            [0.55, 0.5, 0.42],
        ]
    )
    tint = known[rng.integers(len(known))] * rng.uniform(0.5, 1.05)
    return np.clip(tint * np.exp(rng.normal(0, 0.05, 3)), 0.1, 0.99).astype(np.float32)
