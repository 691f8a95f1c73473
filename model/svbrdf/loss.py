"""The loss of section 4.3: log re-renderings under nine view/light pairs, and the maps themselves.

Departures. With the published terms alone the network traded fine detail for the level of a rendering:
its albedo scored below the least squares' that it started from. So the structural similarity of the
re-renderings (Wang et al. 2004, over squares) counts as much as their log difference.

The others are for the normals. Under mirror pairs a rendering says little about a normal that is not
nearly right: measured halfway through a training, its gradient was five to ten times that of the normals'
own L1 and all but unrelated to it (cosine 0.05 to 0.16), and the normals stayed flat. So it counts a
tenth there, the normals' own term counts fully, and has a square beside its L1, whose median ignores
relief that is sparse. The roughness counts about four times as much as published: what a rendering says of it
is little where it is rough, and both networks before this left it at what it starts from. It counts in log, as
the tail of a highlight goes with its fourth power: of mirrors of 0.035 to 0.08 the product of that and F0 was
off by a factor of 0.5 to 8.
"""

import math
from collections.abc import Callable

import torch
from torch import Tensor
from torch.nn import functional

from svbrdf.maps import Maps
from svbrdf.renderer import render
from svbrdf.scenes import Poses

Loss = Callable[[Maps, Maps, Poses], Tensor]
IRRADIANCE = 1.5 * math.pi
MAP_WEIGHT = 0.1
NORMAL_SHARE = 0.1
"""Of the rendering term's gradient, what reaches the normals."""
SQUARE_WEIGHT = 5.0
ROUGHNESS_SHARE = 2.5
BLACK, SMOOTH = 0.01, 0.1
"""What albedos and roughness have added before the log: less than that hardly tells."""
WINDOW, STRIDE = 7, 2
SSIM_C1, SSIM_C2 = 1e-4, 9e-4


def loss(predicted: Maps, true: Maps, pairs: Poses) -> Tensor:
    """Scalar: mean |ln(r + .1) - ln(r' + .1)| + 1 - SSIM + the maps' weighted L1, all but normals in log."""
    held = predicted.normal * NORMAL_SHARE + predicted.normal.detach() * (1 - NORMAL_SHARE)
    rendered = Maps(held, predicted.diffuse, predicted.roughness, predicted.specular)
    ours, theirs = (_renderings(maps, pairs) for maps in (rendered, true))
    rendering = ((ours + 0.1).log() - (theirs + 0.1).log()).abs().mean()
    structure = 1 - _ssim(_display(ours), _display(theirs))
    maps = (
        ROUGHNESS_SHARE * _log_difference(predicted.roughness, true.roughness, SMOOTH)
        + _log_difference(predicted.diffuse, true.diffuse, BLACK)
        + _log_difference(predicted.specular, true.specular, BLACK)
    )
    off = predicted.normal - true.normal
    normal = off.abs().mean() + SQUARE_WEIGHT * (off * off).mean()
    return rendering + structure + MAP_WEIGHT * maps + normal


def _renderings(maps: Maps, pairs: Poses) -> Tensor:
    """(B, pairs, H, W, 3)"""
    light, view = (p[:, :, None, None] for p in (pairs.light, pairs.view))
    rendered: Tensor = render(maps.map(lambda a: a[:, None]), light, view, IRRADIANCE)
    return rendered


def _display(radiance: Tensor) -> Tensor:
    """(B, pairs, H, W, 3) -> (B pairs, 3, H, W) as a screen shows it; finite slope at black."""
    shown: Tensor = (radiance.clamp(0, 1) + 1e-3) ** (1 / 2.2)
    return shown.flatten(0, 1).permute(0, 3, 1, 2)


def _ssim(a: Tensor, b: Tensor) -> Tensor:
    mean_a, mean_b, aa, bb, ab = (_windowed(x) for x in (a, b, a * a, b * b, a * b))
    both = mean_a * mean_b
    spread = aa + bb - mean_a**2 - mean_b**2
    similar = (2 * both + SSIM_C1) * (2 * (ab - both) + SSIM_C2)
    return (similar / ((mean_a**2 + mean_b**2 + SSIM_C1) * (spread + SSIM_C2))).mean()


def _windowed(image: Tensor) -> Tensor:
    """Means of windows, along one axis and then the other: a compiler makes loops of that."""
    rows = functional.avg_pool2d(image, (WINDOW, 1), (STRIDE, 1))
    return functional.avg_pool2d(rows, (1, WINDOW), (1, STRIDE))


def _log_difference(predicted: Tensor, true: Tensor, floor: float) -> Tensor:
    return (torch.log(predicted + floor) - torch.log(true + floor)).abs().mean()
