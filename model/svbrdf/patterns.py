"""Periodic height fields with the structure of real surfaces: what procedural materials are cut from.

Every pattern is a function (rng, n) -> Pattern on the unit torus sampled at (n, n).
"""

from collections.abc import Callable
from dataclasses import dataclass

import cv2
import numpy as np
import numpy.typing as npt

Field = npt.NDArray[np.float32]
Rng = np.random.Generator


@dataclass(frozen=True)
class Pattern:
    """Fields of shape (n, n) in [0, 1]."""

    height: Field
    piece: Field
    """A random value per brick, cell, thread or plank; constant where there are no pieces."""
    seam: Field
    """1 in mortar, gaps and creases, 0 elsewhere."""


def noise(rng: Rng, n: int, slope: float = 2.0, low: float = 1.0, stretch: float = 1.0) -> Field:
    """Gaussian noise with a power-law spectrum, mapped to [0, 1] by its own quantiles.

    slope: amplitude falls as frequency^-slope/2 x ...; low: lowest frequency in cycles per tile;
    stretch: > 1 elongates features along x.
    """
    fy = np.fft.fftfreq(n)[:, None] * n
    fx = np.fft.rfftfreq(n)[None, :] * n * stretch
    radius = np.hypot(fx, fy)
    amplitude = np.where(radius < low, 0.0, (np.maximum(radius, 1e-6) + low) ** (-slope))
    own = np.random.default_rng(rng.integers(2**63))  # so that rng does not depend on n
    spectrum = amplitude * np.fft.rfft2(own.standard_normal((n, n)))
    return equalize(np.fft.irfft2(spectrum, s=(n, n)))


def equalize(field: npt.NDArray[np.floating]) -> Field:
    """Smooth monotone map of a field to [0, 1] through the normal distribution of its values."""
    z = (field - field.mean()) / (field.std() + 1e-12)
    return (0.5 * (1 + np.tanh(0.8 * z))).astype(np.float32)


def grid(n: int) -> tuple[Field, Field]:
    """u to the right and v upward in [0, 1), (n, n) each."""
    axis = ((np.arange(n) + 0.5) / n).astype(np.float32)
    return np.broadcast_to(axis, (n, n)), np.broadcast_to(axis[::-1, None], (n, n))


def warp(rng: Rng, n: int, amount: float, low: float = 2.0) -> tuple[Field, Field]:
    """The grid displaced by smooth noise of the given amplitude."""
    u, v = grid(n)
    du, dv = (noise(rng, n, 3.0, low) - 0.5 for _ in range(2))
    return u + amount * du, v + amount * dv


def hashed(rng: Rng, *indices: npt.NDArray[np.integer]) -> Field:
    """A random value in [0, 1) for each tuple of small integers."""
    table = rng.random((64,) * len(indices)).astype(np.float32)
    return np.asarray(table[tuple(i % 64 for i in indices)])


def smoothstep(edge0: float, edge1: float, x: Field) -> Field:
    t = np.clip((x - edge0) / (edge1 - edge0), 0, 1)
    return (t * t * (3 - 2 * t)).astype(np.float32)


def worley(
    rng: Rng, n: int, count: int, jitter: float, amount: float
) -> tuple[Field, Field, Field]:
    """Distances to the nearest and second nearest of count^2 points (in cells), and a value per cell."""
    u, v = warp(rng, n, amount)
    x, y = (u % 1) * count, (v % 1) * count
    ix, iy = np.floor(x).astype(int), np.floor(y).astype(int)
    offsets = 0.5 + jitter * (rng.random((count, count, 2)) - 0.5)
    values = rng.random((count, count)).astype(np.float32)
    first, second = np.full((n, n), 9.0), np.full((n, n), 9.0)
    owner = np.zeros((n, n), np.float32)
    for dx in (-1, 0, 1):
        for dy in (-1, 0, 1):
            jx, jy = (ix + dx) % count, (iy + dy) % count
            px, py = ix + dx + offsets[jx, jy, 0], iy + dy + offsets[jx, jy, 1]
            distance = np.hypot(x - px, y - py)
            nearer = distance < first
            second = np.where(nearer, first, np.minimum(second, distance))
            owner = np.where(nearer, values[jx, jy], owner)
            first = np.where(nearer, distance, first)
    return first.astype(np.float32), second.astype(np.float32), owner


def rough_ground(rng: Rng, n: int) -> Pattern:
    height = noise(rng, n, rng.uniform(1.0, 2.2), rng.choice([1.0, 3.0, 8.0, 20.0]))
    if rng.random() < 0.4:
        height = np.abs(2 * height - 1)
    return Pattern(height, np.zeros_like(height), smoothstep(0.75, 1.0, 1 - height))


def pebbles(rng: Rng, n: int) -> Pattern:
    count = int(rng.integers(4, 16))
    first, second, owner = worley(rng, n, count, rng.uniform(0.5, 1), rng.uniform(0, 0.1))
    gap = second - first
    dome = np.sqrt(np.clip(1 - (first / rng.uniform(0.7, 1.1)) ** 2, 0, 1))
    height = np.minimum(dome, smoothstep(0.0, rng.uniform(0.15, 0.5), gap)) * (0.5 + 0.5 * owner)
    return Pattern(height.astype(np.float32), owner, 1 - smoothstep(0.02, 0.15, gap))


def cracked(rng: Rng, n: int) -> Pattern:
    count = int(rng.integers(3, 10))
    first, second, owner = worley(rng, n, count, 1.0, rng.uniform(0.05, 0.2))
    seam = 1 - smoothstep(0.0, rng.uniform(0.04, 0.15), second - first)
    height = (1 - seam) * (0.8 + 0.2 * owner) + 0.15 * noise(rng, n, 1.6, 4)
    return Pattern(height, owner, seam)


def leather(rng: Rng, n: int) -> Pattern:
    count = int(rng.integers(14, 40))
    first, second, owner = worley(rng, n, count, 0.9, rng.uniform(0.02, 0.08))
    crease = 1 - smoothstep(0.0, rng.uniform(0.2, 0.6), second - first)
    height = 0.7 * (1 - crease) + 0.3 * noise(rng, n, 2.5, 2) - 0.1 * first
    return Pattern(height.astype(np.float32), owner, crease)


def bricks(rng: Rng, n: int) -> Pattern:
    columns, rows = int(rng.integers(2, 8)), 2 * int(rng.integers(2, 8))
    shift = rng.choice([0.0, 0.5, 1 / 3])
    return _blocks(rng, n, columns, rows, shift, wobble=rng.uniform(0, 0.02))


def tiles(rng: Rng, n: int) -> Pattern:
    count = int(rng.integers(2, 9))
    return _blocks(rng, n, count, count, 0.0, wobble=0.0)


def _blocks(rng: Rng, n: int, columns: int, rows: int, shift: float, wobble: float) -> Pattern:
    u, v = warp(rng, n, wobble, 6.0)
    y = (v % 1) * rows
    row = np.floor(y).astype(int)
    x = ((u + (row % 2) * shift / columns) % 1) * columns
    column = np.floor(x).astype(int)
    fx, fy = x - column, y - row
    size = np.array([1 / columns, 1 / rows], np.float32)
    edge = np.minimum(np.minimum(fx, 1 - fx) * size[0], np.minimum(fy, 1 - fy) * size[1])
    joint = rng.uniform(0.02, 0.12) * size.min()
    bevel = rng.uniform(0.02, 0.25) * size.min()
    inside = smoothstep(joint, joint + bevel, edge)
    piece = hashed(rng, column, row)
    tilt = (hashed(rng, column, row) - 0.5) * (fx - 0.5) + (hashed(rng, column, row) - 0.5) * (
        fy - 0.5
    )
    height = inside * (0.75 + rng.uniform(0, 0.3) * piece + rng.uniform(0, 0.4) * tilt)
    height = height + rng.uniform(0, 0.15) * noise(rng, n, 1.5, 8)
    return Pattern(height.astype(np.float32), piece, 1 - inside)


def herringbone(rng: Rng, n: int) -> Pattern:
    count, ratio = 4 * int(rng.integers(1, 4)), 2
    u, v = grid(n)
    x, y = u * count, v * count
    ix, iy = np.floor(x).astype(int), np.floor(y).astype(int)
    phase = (ix - iy) % (2 * ratio)
    horizontal = phase < ratio
    along = np.where(horizontal, x - ix + phase, y - iy + (2 * ratio - 1 - phase))
    across = np.where(horizontal, y - iy, x - ix)
    ox = np.where(horizontal, ix - phase, ix)
    oy = np.where(horizontal, iy, iy - (2 * ratio - 1 - phase))
    edge = np.minimum(np.minimum(along, ratio - along), np.minimum(across, 1 - across))
    inside = smoothstep(0.02, rng.uniform(0.06, 0.2), edge.astype(np.float32))
    piece = hashed(rng, ox % count, oy % count)
    height = inside * (0.8 + 0.2 * piece) + 0.1 * noise(rng, n, 1.5, 6, stretch=1)
    return Pattern(height.astype(np.float32), piece, 1 - inside)


def wood(rng: Rng, n: int) -> Pattern:
    u, v = grid(n)
    planks = int(rng.choice([1, 1, 2, 4, 6]))
    row = np.floor(v * planks).astype(int)
    piece = hashed(rng, row)
    fibre = noise(rng, n, 1.2, 4, stretch=rng.uniform(0.04, 0.12))
    swirl = noise(rng, n, 3.0, 1, stretch=0.3)
    rings = v * rng.integers(3, 14) + rng.uniform(0.5, 3) * swirl + 7 * piece
    grain = (0.5 + 0.5 * np.sin(2 * np.pi * rings)).astype(np.float32) ** rng.uniform(0.5, 2)
    gap = np.abs((v * planks) % 1 - 0.5) * 2
    seam = smoothstep(0.97, 0.995, gap.astype(np.float32)) if planks > 1 else np.zeros_like(u)
    height = (0.35 * grain + 0.35 * fibre + 0.3) * (1 - seam)
    return Pattern(height.astype(np.float32), np.clip(0.6 * grain + 0.4 * piece, 0, 1), seam)


def weave(rng: Rng, n: int) -> Pattern:
    count = 2 * int(rng.integers(6, 28))
    u, v = warp(rng, n, rng.uniform(0, 0.015), 4.0)
    x, y = (u % 1) * count, (v % 1) * count
    ix, iy = np.floor(x).astype(int), np.floor(y).astype(int)
    step = int(rng.integers(1, 4))
    over = ((ix + step * iy) % (2 if step == 1 else 4)) < (1 if step == 1 else 2)
    warp_thread = np.sin(np.pi * (x - ix)) * (0.6 + 0.4 * np.sin(np.pi * (y - iy)))
    weft_thread = np.sin(np.pi * (y - iy)) * (0.6 + 0.4 * np.sin(np.pi * (x - ix)))
    height = np.where(over, warp_thread, weft_thread).astype(np.float32)
    piece = np.where(over, hashed(rng, ix) * 0.4, 0.6 + hashed(rng, iy) * 0.4).astype(np.float32)
    height = height + 0.15 * noise(rng, n, 0.8, 20)
    return Pattern(height, piece, 1 - smoothstep(0.1, 0.5, height))


def knit(rng: Rng, n: int) -> Pattern:
    count = 2 * int(rng.integers(4, 14))
    u, v = warp(rng, n, rng.uniform(0, 0.01), 3.0)
    x = (u % 1) * count
    column = np.floor(x).astype(int)
    lean = np.where(column % 2 == 0, x - column, 1 - (x - column))
    y = (v % 1) * count * 1.0 + rng.uniform(0.4, 0.8) * lean
    row = np.floor(y).astype(int)
    height = np.sin(np.pi * (y - row)) ** 0.7 * np.sin(np.pi * (x - column)) ** 0.5
    height = (height + 0.2 * noise(rng, n, 0.8, 24)).astype(np.float32)
    return Pattern(height, hashed(rng, row % count), 1 - smoothstep(0.1, 0.4, height))


def brushed(rng: Rng, n: int) -> Pattern:
    lines = noise(rng, n, rng.uniform(0.3, 1.0), 10, stretch=rng.uniform(0.01, 0.05))
    if rng.random() < 0.5:
        lines = lines.T.copy()
    return Pattern(0.3 * lines + 0.7 * noise(rng, n, 2.5, 1), np.zeros_like(lines), 0 * lines)


def scratched(rng: Rng, n: int) -> Pattern:
    canvas = np.zeros((n, n), np.float32)
    for _ in range(int(rng.integers(20, 160))):
        start = rng.random(2) * n
        end = start + rng.normal(0, 0.25, 2) * n
        line = np.zeros_like(canvas)
        points = [tuple(int(c * 16) for c in p) for p in (start, end)]
        cv2.line(line, points[0], points[1], float(rng.uniform(0.2, 1)), 1, cv2.LINE_AA, 4)
        canvas = np.maximum(canvas, line)
    base = noise(rng, n, 2.5, rng.choice([1.0, 4.0]))
    return Pattern(0.4 * base + 0.6 - 0.3 * canvas, base, canvas)


def terrazzo(rng: Rng, n: int) -> Pattern:
    first, second, owner = worley(rng, n, int(rng.integers(8, 24)), 1.0, rng.uniform(0.02, 0.1))
    size = owner * 0.5 + 0.1
    chip = smoothstep(0.0, 0.06, (size - first)) * smoothstep(0.0, 0.1, second - first)
    height = 0.5 + 0.02 * chip + 0.05 * noise(rng, n, 1.5, 6)
    return Pattern(height.astype(np.float32), owner * chip, 1 - chip)


def embossed(rng: Rng, n: int) -> Pattern:
    count = int(rng.integers(3, 16))
    u, v = grid(n)
    x, y = u * count, v * count
    ix, iy = np.floor(x).astype(int), np.floor(y).astype(int)
    fx, fy = x - ix - 0.5, y - iy - 0.5
    flip = (ix + iy) % 2 == 0
    shape = int(rng.integers(4))
    if shape == 0:
        distance = np.hypot(fx, fy)
    elif shape == 1:
        a, b = np.where(flip, fx + fy, fx - fy), np.where(flip, fx - fy, fx + fy)
        distance = np.hypot(a * 0.6, b * 1.8)
    elif shape == 2:
        distance = np.maximum(np.abs(fx), np.abs(fy))
    else:
        distance = np.abs(fx) + np.abs(fy)
    radius, bevel = rng.uniform(0.2, 0.42), rng.uniform(0.03, 0.2)
    bump = 1 - smoothstep(radius - bevel, radius, distance.astype(np.float32))
    sign = rng.choice([-1.0, 1.0])
    height = 0.5 + sign * 0.4 * bump + 0.04 * noise(rng, n, 2, 4)
    return Pattern(height.astype(np.float32), bump, 1 - bump)


def printed(rng: Rng, n: int) -> Pattern:
    """One surface with an ink pattern that its relief knows nothing of."""
    ink = PATTERNS[int(rng.integers(len(PATTERNS) - 1))](rng, n)
    surface = noise(rng, n, rng.uniform(1.5, 3), rng.choice([1.0, 6.0, 20.0]))
    area = smoothstep(0.45, 0.55, ink.height)
    return Pattern(surface, np.clip(0.5 * area + 0.5 * ink.piece, 0, 1), ink.seam)


PATTERNS: tuple[Callable[[Rng, int], Pattern], ...] = (
    rough_ground, pebbles, cracked, leather, bricks, tiles, herringbone, wood, weave, knit,
    brushed, scratched, terrazzo, embossed, printed,
)  # fmt: skip
