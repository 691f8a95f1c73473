"""Slopes and albedo of each pixel from a few slots of known light, by robust least squares.

Photometric stereo (Woodham 1980) in the log, ln value = ln albedo + ln(1 + slopes . tilt): damped Gauss-Newton,
the slots weighted by how well the round before fits them. A highlight is bright, so what is brighter than the
fit is believed far less than what is darker.
"""

from typing import NamedTuple

import torch
from torch import Tensor
from torch.nn import functional

BRIGHTER, DARKER = 0.05, 0.3
"""In ln: a slot that is so much brighter than the fit, or darker, has half its weight."""
STEEPEST, DARKEST_SHADING = 2.0, 0.1


class Damping(NamedTuple):
    """What draws slopes to flat where light is known, and where it is only guessed."""

    known: float
    guessed: float


CAREFUL, FREE = Damping(0.15, 0.3), Damping(0.03, 0.06)
"""Right for what shines, and for what is matte and steep; the network says where to believe which."""


class Slots(NamedTuple):
    """K lights of B samples, at h x w coarse pixels of `fine` fine ones each.

    tilt: (B, K, 2, 1, h, w), tangent of the light's angle. value: (B, K, fine, h, w), the log picture over
    what a flat white sample would have recorded, mean of colours; colour: (B, J, 3, fine, h, w), the same
    of each, in the first J. weight: (B, K, 1, h, w). known: (B, 1, h, w), whether light is.
    """

    tilt: Tensor
    value: Tensor
    colour: Tensor
    weight: Tensor
    known: Tensor


class Fit(NamedTuple):
    """slopes: (B, 2, fine, h, w). off: (B, 1, h, w), how far in ln the slots are from it in the mean."""

    slopes: Tensor
    off: Tensor


class _Guess(NamedTuple):
    """Of coarse pixels.

    slopes: (B, 2, 1, h, w). Per slot, (B, K, 1, h, w), lean: slopes . tilt; shading: 1 + lean, but never
    dark; off: ln of the value over that; trusted: its share of the trust.
    """

    slopes: Tensor
    lean: Tensor
    shading: Tensor
    off: Tensor
    trusted: Tensor


class _Round(NamedTuple):
    """One of Gauss-Newton: what it found; what each slot's value adds to either slope; the slots' residuals."""

    found: _Guess
    rows: tuple[Tensor, Tensor]
    residual: Tensor


def fits(slots: Slots, scale: float) -> tuple[Fit, Fit, Tensor]:
    """The careful fit, the free one, and its log albedo (B, 3, fine, h, w). scale: of values, to ln.

    Two careful rounds on the coarse pixels, and from there a free one. A fine pixel differs little from the
    mean of its coarse one: its slopes and albedo follow in one linear step, with the same weights. The
    albedo's detail is that of all slots alike, as that of the few trusted ones is noisy; its level is that
    of the trusted ones.
    """
    grey = slots.value.mean(dim=2, keepdim=True) / scale
    nothing = torch.zeros_like(grey)
    flat = _Guess(nothing[:, :2], nothing, nothing + 1, grey, _shares(slots.weight))
    careful = _round(slots, grey, _round(slots, grey, flat, CAREFUL).found, CAREFUL)
    free = _round(slots, grey, careful.found, FREE)
    changes = [_change(last.rows, slots.value) / scale for last in (careful, free)]
    first, second = (
        Fit(_limited(last.found.slopes + change), last.residual.abs().mean(dim=1))
        for last, change in zip((careful, free), changes, strict=True)
    )
    return first, second, _albedo(slots, free, changes[1], second.slopes, scale)


def _round(slots: Slots, grey: Tensor, before: _Guess, damping: Damping) -> _Round:
    """Sums of products less products of sums: few operations then have all slots, which take long."""
    inverse, trusted = before.shading.reciprocal(), before.trusted
    x, y = slots.tilt[:, :, 0] * inverse, slots.tilt[:, :, 1] * inverse
    z = before.off + before.lean * inverse
    wx, wy = trusted * x, trusted * y
    mean_x, mean_y, mean_z = (_summed(part) for part in (wx, wy, trusted * z))
    damped = torch.where(slots.known, damping.known, damping.guessed)[:, None]
    xx = _summed(wx * x) - mean_x * mean_x + damped
    yy = _summed(wy * y) - mean_y * mean_y + damped
    xy = _summed(wx * y) - mean_x * mean_y
    xz, yz = _summed(wx * z) - mean_x * mean_z, _summed(wy * z) - mean_y * mean_z
    over_determinant = (xx * yy - xy * xy).reciprocal()
    xx, xy, yy = (a * over_determinant for a in (xx, xy, yy))
    slopes = _limited(torch.cat([yy * xz - xy * yz, xx * yz - xy * xz], dim=1))
    rows = (
        yy * wx - xy * wy - (yy * mean_x - xy * mean_y) * trusted,
        xx * wy - xy * wx - (xx * mean_y - xy * mean_x) * trusted,
    )
    lean = slots.tilt[:, :, 0] * slopes[:, :1] + slots.tilt[:, :, 1] * slopes[:, 1:]
    shading = (1 + lean).clamp(min=DARKEST_SHADING)
    off = grey - shading.log()
    residual = off - _summed(trusted * off)
    deviation = functional.leaky_relu(residual, BRIGHTER / DARKER)
    believed = _shares(slots.weight / (BRIGHTER**2 + deviation * deviation))
    return _Round(_Guess(slopes, lean, shading, off, believed), rows, residual)


def _albedo(slots: Slots, last: _Round, change: Tensor, slopes: Tensor, scale: float) -> Tensor:
    """slopes: of the fine pixels, which differ by `change` from the coarse ones."""
    off = last.residual - last.residual.mean(dim=1, keepdim=True)
    alike = _shares(1 / (1 + (off / DARKER) ** 2))
    facing = _summed(alike * last.found.shading.log())[:, 0]
    slanted = alike / last.found.shading
    for axis in range(2):
        facing = facing + _summed(slanted * slots.tilt[:, :, axis])[:, 0] * change[:, axis]
    facing = facing - 0.5 * torch.log1p((slopes**2).sum(dim=1))
    grey = _summed(alike * slots.value) - scale * facing[:, None]
    coloured = _shares(alike[:, : slots.colour.shape[1]])
    albedo = _summed(coloured[:, :, None] * slots.colour)[:, 0]
    albedo = albedo + grey - albedo.mean(dim=1, keepdim=True)
    level = scale * _summed((last.found.trusted - alike) * last.residual).mean(dim=(2, 3, 4))
    return albedo + level[:, :, None, None, None]


def _change(rows: tuple[Tensor, Tensor], value: Tensor) -> Tensor:
    """(B, 2, fine, h, w): how far fine pixels are from the mean of their coarse one."""
    slopes = torch.cat([_summed(row * value) for row in rows], dim=1)
    return slopes - slopes.mean(dim=2, keepdim=True)


def _summed(slots: Tensor) -> Tensor:
    """Over K, (B, 1, ...). As a matrix product: a reduction of a middle axis is slow in onnxruntime."""
    ones = slots.new_ones(1, slots.shape[1])
    with torch.autocast(slots.device.type, enabled=False):
        total: Tensor = (ones @ slots.flatten(2)).unflatten(2, slots.shape[2:])
    return total


def _limited(slopes: Tensor) -> Tensor:
    return slopes.clamp(-STEEPEST, STEEPEST)


def _shares(weight: Tensor) -> Tensor:
    return weight * _summed(weight).reciprocal()
