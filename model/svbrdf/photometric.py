"""What known light tells of each pixel: sums over pictures that a running max can carry.

Photometric stereo (Woodham 1980) wants every pixel's values under every light, but the state keeps only
maxima. So each of a few directions of light has a slot, for which the pictures compete: a picture's key
is high where its light comes from near that direction, and what the picture says rides on the key:
max(key + value) - max(key) is the value of the picture that won, wherever keys differ by more than
values. Two rings of slots of light from around, away from the mirror direction where there is a choice, give
slopes and albedo by least squares; the second ring carries no colour, which the first tells as well. Three
slots of the half vector's angle say how the highlight falls off, which all pixels together say better than
each (see `lobe`).
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import torch
from torch import Tensor
from torch.nn import functional

from svbrdf.least_squares import Slots, fits

RING, POLARS = 6, (math.radians(45), math.radians(65))
"""Slots of one ring of lights, and how far from the normal each ring's lights are."""
SLOTS = RING * len(POLARS)
HALF_ANGLES = (0.0, 0.22, 0.5)
LOBE_BINS, NEAREST_ANGLE, FARTHEST_ANGLE = 8, 0.02, 1.0
"""In radians; the bins are even in ln(angle + NEAREST_ANGLE)."""
LOBE_COUNT = 3 * LOBE_BINS
KEY = 200.0
MIRROR_PENALTY, MIRROR_COSINE = 0.5, 0.95
LOWEST_COSINE = 0.15
DARK = 0.01
CLIPPED, CLIPPED_PENALTY = 0.97, 0.4
DOUBT = 10.0
"""A slot's weight falls by e^-DOUBT for a penalty of 1."""
USUALLY_OFF = 0.1
FEW, FAINT = 1e-3, 0.03
"""A share of the pixels (or a mean over them) that says little, and an excess over white that does."""
FIT_COUNT = 3
MIDDLE = math.log(0.2)
"""Where guessed light puts a picture's mean brightness: what an unknown material reflects on average."""
AROUND, DARKER = 8, 5.0
"""Cells per side of the albedo around; how much less what is bright counts there, as it may be highlight."""
_SCALE = 2 / (math.log(1 + DARK) - math.log(DARK))


class Poses(NamedTuple):
    """What is known of B pictures: where known, (B,), is 1; elsewhere it is 0 and positions are guesses.

    light, view: (B, 3) positions in the sample's frame; white: (B, 3, H, W), what a white Lambertian patch
    that faces the light would record, ignored where it is not known.
    """

    light: Tensor
    view: Tensor
    white: Tensor
    known: Tensor


def unknown(batch: int, side: int, device: torch.device | None = None) -> Poses:
    """Poses of pictures of which nothing is known."""
    above = torch.tensor([[0.0, 0.0, 2.0]], device=device).expand(batch, 3)
    white = torch.ones(1, 1, 1, 1, device=device).expand(batch, 3, side, side)
    return Poses(above, above, white, torch.zeros(batch, device=device))


@dataclass(frozen=True)
class Observation:
    """One batch of pictures under known light, all (B, channels, h, w) at the stem's resolution.

    inputs: for the encoder. raw: for the state, of `widths` channels. tilt: (B, 2, h, w) tangent of the
    light's angle.
    brightness: (B, 3, H, W) the log picture over what a flat white sample would have recorded.
    """

    inputs: Tensor
    raw: tuple[Tensor, ...]
    tilt: Tensor
    brightness: Tensor


def inputs_count(stem: int) -> int:
    """Channels of Observation.inputs."""
    return 3 * stem**2 + 9


def widths(stem: int) -> tuple[int, ...]:
    """Channels of each of Observation.raw: how much is known, then keys and what rides on them."""
    fine, halves = stem**2, len(HALF_ANGLES)
    ridden = SLOTS, 2 * SLOTS, 3 * fine * RING, fine * (SLOTS - RING)
    return 1, SLOTS, *ridden, halves, halves, fine * halves


def derived_count(stem: int) -> int:
    """Channels that `read` gives the decoder, the last ones idle: onnxruntime wants multiples of 8."""
    fine = stem**2
    shown = 1 + RING * (3 + 3 * fine) + len(HALF_ANGLES) * (2 + fine)
    return -(-(shown + 7 * fine + 1) // 8) * 8


def observe(linear: Tensor, poses: Poses, stem: int) -> Observation:
    """linear: (B, 3, H, W) in [0, 1].

    Of pictures whose light is only guessed, a smooth surface fitted to their own brightness stands for
    what a flat white sample would have recorded, up to a factor.
    """
    batch, _, height, width = linear.shape
    known = poses.known[:, None, None, None]
    points = _positions(linear, height // stem, width // stem)
    light = _unit(poses.light[:, :, None, None] - points)
    view = _unit(poses.view[:, :, None, None] - points)
    cosine = light[:, 2:].clamp(min=LOWEST_COSINE)
    flat = poses.white * functional.interpolate(cosine, size=(height, width), mode="nearest")
    value, flat = torch.log(linear + DARK), torch.log(flat + DARK)
    flat = torch.where(known > 0, flat, _smooth(value.mean(dim=1, keepdim=True)) - MIDDLE)
    brightness = (value - flat) * _SCALE + 1
    tilt = light[:, :2] / cosine
    half = _unit(light + view)[:, 2:]
    angle = torch.acos(half.clamp(-0.999999, 0.999999))
    fine = functional.pixel_unshuffle(brightness, stem)
    grey = functional.pixel_unshuffle(brightness.mean(dim=1, keepdim=True), stem)
    trust = (0.5 + 0.5 * known).expand(batch, 1, *fine.shape[2:])
    penalty = MIRROR_PENALTY * ((half - MIRROR_COSINE) / (1 - MIRROR_COSINE)).clamp(0, 1)
    clipped = (linear.amax(dim=1, keepdim=True) > CLIPPED).float()
    penalty = penalty + CLIPPED_PENALTY * functional.max_pool2d(clipped, stem)
    towards = (light[:, None] * _slot_directions(linear.device)).sum(dim=2)
    keys = KEY * (towards - penalty)
    first, second = keys.split(RING, dim=1)
    off = angle - torch.tensor(HALF_ANGLES, device=linear.device)[:, None, None]
    falls = -KEY * off.abs()
    raw = (
        trust, keys, keys + penalty, _ridden(keys, tilt), _ridden(first, fine), _ridden(second, grey),
        falls, falls + angle, _ridden(falls, grey),
    )  # fmt: skip
    level = functional.avg_pool2d(flat.mean(dim=1, keepdim=True), stem) * known
    told = torch.cat([fine, light, view, half, level, trust], dim=1)
    return Observation(told, raw, tilt, brightness)


class Reading(NamedTuple):
    """What the fused raw state says.

    derived: for the decoder, together (B, derived_count, h, w), the first whether light is known. slopes:
    (B, 2, fine, h, w), of the careful least squares. free: the same of the free ones; albedo:
    (B, 3, fine, h, w), theirs in log, its level only where light is known; `linear` has its scale. lobe: see
    there. fit: (B, FIT_COUNT), ln of how far the slots are from the free ones, and of how steep these and the
    careful ones are, all in the mean.
    """

    derived: tuple[Tensor, ...]
    slopes: Tensor
    free: Tensor
    albedo: Tensor
    lobe: Tensor
    fit: Tensor


def read(raw: Sequence[Tensor], stem: int) -> Reading:
    """raw: the max over pictures of each of Observation.raw."""
    fine = stem**2
    told, keys, doubts, tilts, values, greys, falls, angles, fallen = raw
    tilts, doubts = _carried(keys, tilts), doubts - keys
    values = _carried(keys[:, :RING], values).unflatten(2, (3, fine))
    mean = values.mean(dim=2)
    greys = torch.cat([mean, _carried(keys[:, RING:], greys)], dim=1)
    angles, fallen = angles - falls, _carried(falls, fallen)
    slots = Slots(
        tilts[:, :, :, None],
        greys,
        values,
        torch.exp(-DOUBT * doubts)[:, :, None],
        told > 0.75,
    )
    careful, free, albedo = fits(slots, _SCALE)
    slopes = careful.slopes
    derived = [
        told,
        keys[:, :RING] / KEY,
        tilts[:, :RING].flatten(1, 2),
        values.flatten(1, 3),
        torch.cat([falls[:, :, None] / KEY, angles[:, :, None], fallen], dim=2).flatten(1, 2),
        slopes.flatten(1, 2),
        albedo.flatten(1, 2),
        free.slopes.flatten(1, 2),
        free.off / USUALLY_OFF,
    ]
    idle = derived_count(stem) - sum(part.shape[1] for part in derived)
    derived.append(torch.zeros_like(told).expand(-1, idle, -1, -1))
    shine = lobe(angles, fallen.mean(dim=2), albedo.mean(dim=(1, 2)))
    sizes = free.off, free.slopes.abs(), slopes.abs()
    fit = torch.stack([torch.log(size.flatten(1).mean(dim=1) + FEW) for size in sizes], dim=1)
    return Reading(tuple(derived), slopes, free.slopes, albedo, shine, fit)


def lobe(angle: Tensor, grey: Tensor, albedo: Tensor) -> Tensor:
    """How the highlight of all pixels together falls off with the half vector's angle, (B, LOBE_COUNT).

    angle, grey: (B, slots, h, w), radians and log brightness; albedo: (B, h, w) in log. For each bin of
    angles the mean log of brightness over albedo; the log of how much brighter in the mean; how many have it.
    Every other row and column speaks for its neighbours.
    """
    angle, grey = angle[:, :, ::2, ::2], grey[:, :, ::2, ::2]
    albedo = albedo[:, None, ::2, ::2]
    above, excess = grey - albedo, linear(grey) - linear(albedo)
    place = torch.log(angle.clamp(min=0) + NEAREST_ANGLE) - math.log(NEAREST_ANGLE)
    place = place * ((LOBE_BINS - 1) / math.log(FARTHEST_ANGLE / NEAREST_ANGLE))
    bins = torch.arange(LOBE_BINS, device=angle.device)[:, None, None, None]
    weight = (1 - (place[:, None] - bins).abs()).clamp(min=0)
    shares, ratios, means = (
        part.mean(dim=(2, 3, 4))
        for part in (weight, weight * above[:, None], weight * excess[:, None])
    )
    excesses = (means / (shares + FEW)).clamp(min=0)
    excesses = torch.log(excesses + FAINT) - math.log(FAINT)
    return torch.cat([ratios / (shares + FEW), excesses, shares.sqrt()], dim=1)


def linear(albedo: Tensor) -> Tensor:
    """The albedo whose encoded logarithm `read` gives."""
    return torch.exp((albedo - 1) / _SCALE)


def around(albedo: Tensor) -> Tensor:
    """Of the log albedo (B, 3, fine, h, w) that of a coarse pixel's surroundings, the darker of them mostly."""
    grey = albedo.mean(dim=1, keepdim=True)
    weight = torch.exp(DARKER * (grey.mean(dim=(2, 3, 4), keepdim=True) - grey))
    weighted = torch.cat([weight.mean(dim=2), (weight * albedo).mean(dim=2)], dim=1)
    cells = functional.interpolate(weighted, size=(AROUND, AROUND), mode="area")
    cells = functional.avg_pool2d(cells, 3, 1, 1)
    mean = cells[:, 1:] / cells[:, :1]
    return functional.interpolate(mean, size=albedo.shape[3:], mode="bilinear")[:, :, None]


def _smooth(value: Tensor) -> Tensor:
    """The quadratic surface nearest to (B, 1, H, W)."""
    height, width = value.shape[2:]
    points = _positions(value, height, width)[0]
    x, y = points[0].flatten(), points[1].flatten()
    # Legendre polynomials up to the second degree are orthogonal over the square
    x2, y2 = (3 * x * x - 1) / 2, (3 * y * y - 1) / 2
    basis = torch.stack([torch.ones_like(x), x, y, x * y, x2, y2])
    basis = basis / basis.norm(dim=1, keepdim=True)
    return ((value.flatten(1) @ basis.T) @ basis).unflatten(1, (1, height, width))


def _slot_directions(device: torch.device) -> Tensor:
    """(SLOTS, 3, 1, 1) unit vectors."""
    directions = []
    for slot in range(SLOTS):
        ring, place = divmod(slot, RING)
        azimuth = 2 * math.pi * (place + ring / 2) / RING
        flat = math.sin(POLARS[ring])
        directions += [flat * math.cos(azimuth), flat * math.sin(azimuth), math.cos(POLARS[ring])]
    return torch.tensor(directions, device=device).reshape(SLOTS, 3, 1, 1)


def _ridden(keys: Tensor, values: Tensor) -> Tensor:
    """Each of the keys (B, K, h, w) plus all values (B, C, h, w), (B, K C, h, w)."""
    return (keys[:, :, None] + values[:, None]).flatten(1, 2)


def _carried(keys: Tensor, ridden: Tensor) -> Tensor:
    """The values (B, K, C, h, w) that `_ridden` put on the keys."""
    return ridden.unflatten(1, (keys.shape[1], -1)) - keys[:, :, None]


def _positions(like: Tensor, height: int, width: int) -> Tensor:
    """(1, 3, h, w) of the pixel centres on the sample."""
    x = (torch.arange(width, dtype=like.dtype, device=like.device) + 0.5) / width * 2 - 1
    y = 1 - (torch.arange(height, dtype=like.dtype, device=like.device) + 0.5) / height * 2
    columns, rows = x[None, :].expand(height, width), y[:, None].expand(height, width)
    return torch.stack([columns, rows, torch.zeros_like(columns)])[None]


def _unit(vector: Tensor) -> Tensor:
    return vector / vector.norm(dim=1, keepdim=True)
