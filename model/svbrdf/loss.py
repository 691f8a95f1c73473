"""The loss of section 4.3: log re-renderings under nine view/light pairs, and the maps themselves.

One departure: the normals weigh ten times as much as published. Under mirror pairs the renderings say
little about a normal that is not nearly right, and short trainings never got it nearly right.
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
NORMAL_WEIGHT = 1.0


def loss(predicted: Maps, true: Maps, pairs: Poses) -> Tensor:
    """Scalar: mean |ln(r + .1) - ln(r' + .1)| + the weighted L1 of the maps, albedos in log."""
    ours, theirs = (_renderings(maps, pairs) for maps in (predicted, true))
    rendering = ((ours + 0.1).log() - (theirs + 0.1).log()).abs().mean()
    maps = (
        (predicted.roughness - true.roughness).abs().mean()
        + _log_difference(predicted.diffuse, true.diffuse)
        + _log_difference(predicted.specular, true.specular)
    )
    normal = (predicted.normal - true.normal).abs().mean()
    return rendering + MAP_WEIGHT * maps + NORMAL_WEIGHT * normal


def _renderings(maps: Maps, pairs: Poses) -> Tensor:
    """(B, pairs, H, W, 3)"""
    light, view = (p[:, :, None, None] for p in (pairs.light, pairs.view))
    rendered: Tensor = render(maps.map(lambda a: a[:, None]), light, view, IRRADIANCE)
    return rendered


def _log_difference(predicted: Tensor, true: Tensor) -> Tensor:
    return (torch.log(predicted + 0.01) - torch.log(true + 0.01)).abs().mean()
