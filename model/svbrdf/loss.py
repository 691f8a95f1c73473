"""The loss of section 4.3: log re-renderings under nine view/light pairs, and the maps themselves.

Departures, all for the normals. Under mirror pairs a rendering says little about a normal that is not
nearly right: measured halfway through a training, its gradient was five to ten times that of the normals'
own L1 and all but unrelated to it (cosine 0.05 to 0.16), and the normals stayed flat. So it counts a
tenth there, the normals' own term counts fully, and has a square beside its L1, whose median ignores
relief that is sparse.
"""

import math
from collections.abc import Callable

import torch
from torch import Tensor

from svbrdf.maps import Maps
from svbrdf.renderer import render
from svbrdf.scenes import Poses

Loss = Callable[[Maps, Maps, Poses], Tensor]
IRRADIANCE = 1.5 * math.pi
MAP_WEIGHT = 0.1
NORMAL_SHARE = 0.1
"""Of the rendering term's gradient, what reaches the normals."""
SQUARE_WEIGHT = 5.0


def loss(predicted: Maps, true: Maps, pairs: Poses) -> Tensor:
    """Scalar: mean |ln(r + .1) - ln(r' + .1)| + the weighted L1 of the maps, albedos in log."""
    held = predicted.normal * NORMAL_SHARE + predicted.normal.detach() * (1 - NORMAL_SHARE)
    rendered = Maps(held, predicted.diffuse, predicted.roughness, predicted.specular)
    ours, theirs = (_renderings(maps, pairs) for maps in (rendered, true))
    rendering = ((ours + 0.1).log() - (theirs + 0.1).log()).abs().mean()
    maps = (
        (predicted.roughness - true.roughness).abs().mean()
        + _log_difference(predicted.diffuse, true.diffuse)
        + _log_difference(predicted.specular, true.specular)
    )
    off = predicted.normal - true.normal
    normal = off.abs().mean() + SQUARE_WEIGHT * (off * off).mean()
    return rendering + MAP_WEIGHT * maps + normal


def _renderings(maps: Maps, pairs: Poses) -> Tensor:
    """(B, pairs, H, W, 3)"""
    light, view = (p[:, :, None, None] for p in (pairs.light, pairs.view))
    rendered: Tensor = render(maps.map(lambda a: a[:, None]), light, view, IRRADIANCE)
    return rendered


def _log_difference(predicted: Tensor, true: Tensor) -> Tensor:
    return (torch.log(predicted + 0.01) - torch.log(true + 0.01)).abs().mean()
