"""Slopes and albedo of each pixel from a few slots of known light, by robust least squares.

Photometric stereo (Woodham 1980) in the log, ln value = ln albedo + ln(1 + slopes . tilt): damped Gauss-Newton,
the slots weighted by how well the round before fits them. A highlight is bright, so what is brighter than the
fit is believed far less than what is darker.
"""

from typing import NamedTuple

import torch
from torch import Tensor

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
    """Of coarse pixels: slopes (B, 2, 1, h, w), and per slot (B, K, 1, h, w) shading and share of the trust."""

    slopes: Tensor
    shading: Tensor
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
    fine = slots.value / scale
    grey = fine.mean(dim=2, keepdim=True)
    fine = fine - grey
    flat, even = torch.zeros_like(slots.tilt[:, 0]), torch.ones_like(grey)
    guess = _Guess(flat, even, _shares(slots.weight))
    careful = _round(slots, grey, _round(slots, grey, guess, CAREFUL).found, CAREFUL)
    free = _round(slots, grey, careful.found, FREE)
    changes = [_applied(last.rows, fine) for last in (careful, free)]
    first, second = (
        Fit(_limited(last.found.slopes + change), last.residual.abs().mean(dim=1))
        for last, change in zip((careful, free), changes, strict=True)
    )
    return first, second, _albedo(slots, free, changes[1], second.slopes, scale)


def _round(slots: Slots, grey: Tensor, before: _Guess, damping: Damping) -> _Round:
    tilt_x, tilt_y = slots.tilt[:, :, 0], slots.tilt[:, :, 1]
    inverse = before.shading.reciprocal()
    x, y = tilt_x * inverse, tilt_y * inverse
    z = grey - before.shading.log() + x * before.slopes[:, :1] + y * before.slopes[:, 1:]
    x, y, z = (a - (before.trusted * a).sum(dim=1, keepdim=True) for a in (x, y, z))
    wx, wy = before.trusted * x, before.trusted * y
    damped = torch.where(slots.known, damping.known, damping.guessed)
    xx, yy = (wx * x).sum(dim=1) + damped, (wy * y).sum(dim=1) + damped
    xy = (wx * y).sum(dim=1)
    over_determinant = (xx * yy - xy * xy).reciprocal()
    xx, xy, yy = ((a * over_determinant)[:, None] for a in (xx, xy, yy))
    rows = yy * wx - xy * wy, xx * wy - xy * wx
    slopes = _limited(_applied(rows, z))
    shading = 1 + tilt_x * slopes[:, :1] + tilt_y * slopes[:, 1:]
    shading = shading.clamp(min=DARKEST_SHADING)
    residual = grey - shading.log()
    residual = residual - (before.trusted * residual).sum(dim=1, keepdim=True)
    deviation = residual * torch.where(residual > 0, 1 / BRIGHTER, 1 / DARKER)
    trusted = _shares(slots.weight / (1 + deviation * deviation))
    return _Round(_Guess(slopes, shading, trusted), rows, residual)


def _albedo(slots: Slots, last: _Round, change: Tensor, slopes: Tensor, scale: float) -> Tensor:
    """slopes: of the fine pixels, which differ by `change` from the coarse ones."""
    off = last.residual - last.residual.mean(dim=1, keepdim=True)
    alike = _shares(1 / (1 + (off / DARKER) ** 2))
    facing = (alike * last.found.shading.log()).sum(dim=1)
    for axis in range(2):
        slant = (alike * slots.tilt[:, :, axis] / last.found.shading).sum(dim=1)
        facing = facing + slant * change[:, axis]
    facing = facing - 0.5 * torch.log1p((slopes**2).sum(dim=1))
    grey = (alike * slots.value).sum(dim=1) - scale * facing
    first = slots.colour.shape[1]
    coloured = _shares(alike[:, :first])
    grey = grey - (coloured * slots.value[:, :first]).sum(dim=1)
    albedo = grey[:, None] + (coloured[:, :, None] * slots.colour).sum(dim=1)
    level = scale * ((last.found.trusted - alike) * last.residual).sum(dim=1).mean(dim=(1, 2, 3))
    return albedo + level[:, None, None, None, None]


def _limited(slopes: Tensor) -> Tensor:
    return slopes.clamp(-STEEPEST, STEEPEST)


def _applied(rows: tuple[Tensor, Tensor], values: Tensor) -> Tensor:
    return torch.stack([(row * values).sum(dim=1) for row in rows], dim=1)


def _shares(weight: Tensor) -> Tensor:
    return weight * weight.sum(dim=1, keepdim=True).reciprocal()
