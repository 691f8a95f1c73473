"""Where the light and the camera of one picture were, guessed from the picture.

For pictures of unknown poses, as in uncalibrated photometric stereo with a network that estimates lights
(Chen et al., "Self-calibrating Deep Photometric Stereo Networks", CVPR 2019): a light's fall-off and its
highlight say much of where it was.
"""

import itertools
import math

import torch
from torch import Tensor, nn
from torch.nn import functional

SIDE = 32
LOWEST_Z = 0.12


class LightEstimate(nn.Module):
    """(B, 3, H, W) log-encoded pictures -> positions (B, 3) of light and camera in the sample's frame."""

    def __init__(self) -> None:
        super().__init__()
        widths = [5, 32, 64, 64]
        self.convolutions = nn.ModuleList(
            nn.Conv2d(i, o, 3, 2, 1) for i, o in itertools.pairwise(widths)
        )
        self.hidden = nn.Linear(widths[-1] * (SIDE // 8) ** 2, 96)
        self.last = nn.Linear(96, 6)

    def forward(self, log: Tensor) -> tuple[Tensor, Tensor]:
        small = functional.interpolate(log, size=(SIDE, SIDE), mode="area")
        small = small - small.mean(dim=(1, 2, 3), keepdim=True)
        axis = (torch.arange(SIDE, dtype=log.dtype, device=log.device) + 0.5) / SIDE * 2 - 1
        x = axis[None, None, None, :].expand(len(log), 1, SIDE, SIDE)
        y = -axis[None, None, :, None].expand(len(log), 1, SIDE, SIDE)
        value = torch.cat([small, x, y], dim=1)
        for convolution in self.convolutions:
            value = functional.leaky_relu(convolution(value), 0.2)
        value = functional.leaky_relu(self.hidden(value.flatten(1)), 0.2)
        out = self.last(value).float()
        light, view = (_position(out[:, i : i + 3]) for i in (0, 3))
        return light, view


def error(estimated: tuple[Tensor, Tensor], true: tuple[Tensor, Tensor]) -> Tensor:
    """Scalar to train with: distance of unit directions, the light's counting thrice, and of log distances."""
    terms = []
    for weight, ours, theirs in zip((3.0, 1.0), estimated, true, strict=True):
        ours_far, theirs_far = ours.norm(dim=1, keepdim=True), theirs.norm(dim=1, keepdim=True)
        off = (ours / ours_far - theirs / theirs_far).norm(dim=1)
        terms.append(weight * off.mean() + 0.1 * (ours_far / theirs_far).log().abs().mean())
    return sum(terms, torch.zeros(()).to(terms[0]))


def _position(out: Tensor) -> Tensor:
    """Direction from two unbounded numbers that are 0 straight above, and a log distance."""
    flat = out[:, :2]
    length = flat.norm(dim=1, keepdim=True) + 1e-6
    sine = math.sqrt(1 - LOWEST_Z**2) * torch.tanh(length)
    direction = torch.cat([flat / length * sine, (1 - sine**2).sqrt()], dim=1)
    return direction * torch.exp(1 + out[:, 2:].clamp(-2, 2))
