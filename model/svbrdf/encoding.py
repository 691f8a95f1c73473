"""What the network sees of a picture's pixels: their logarithm, where they are, and what shades them."""

import torch
from torch import Tensor
from torch.nn import functional

from svbrdf.photometric import Observation


def log_encoding(picture: Tensor) -> Tensor:
    """Gamma-encoded [0, 1] to the network's scale: -1 for black, 1 for white, log between."""
    linear = picture**2.2
    low, high = torch.tensor(0.01).log(), torch.tensor(1.01).log()
    return (torch.log(linear + 0.01) - low) / (high - low) * 2 - 1


def log_decoding(value: Tensor) -> Tensor:
    """The linear [0, 1] value of the network's scale."""
    low, high = torch.tensor(0.01).log(), torch.tensor(1.01).log()
    return torch.exp((value + 1) / 2 * (high - low) + low) - 0.01


def shading_cue(log: Tensor) -> tuple[Tensor, Tensor]:
    """Where the light seems to come from, (B, 2, 1, 1), and that times the pixels' brightness, (B, 2, H, W).

    A light's fall-off makes a flat sample brighter toward it, so the plane fitted to the log brightness
    of a picture (B, 3, H, W) points to the light. A slope brightens a pixel under light from one side
    and darkens it under light from the other: times the direction, both have the same sign, while the
    albedo's part changes sign. The max and the min over pictures then leave the slope in their sum.
    """
    brightness = log.mean(dim=1, keepdim=True)
    centred = brightness - brightness.mean(dim=(2, 3), keepdim=True)
    place = coordinates(log)
    tilt = 3 * (place * centred).mean(dim=(2, 3), keepdim=True)
    detail = centred - (tilt * place).sum(dim=1, keepdim=True)
    direction = torch.tanh(5 * tilt)
    return direction, direction * detail


def known_cue(seen: Observation, stem: int) -> Tensor:
    """The shading cue of pictures whose light is known, (B, 2, H, W)."""
    brightness = seen.brightness.mean(dim=1, keepdim=True)
    tilt = functional.interpolate(seen.tilt, scale_factor=float(stem), mode="nearest")
    return tilt * (brightness - brightness.mean(dim=(2, 3), keepdim=True))


def coordinates(like: Tensor) -> Tensor:
    """(B, 2, H, W) of the pixels on the sample, x right and y up, in [-1, 1]."""
    batch, _, height, width = like.shape
    x = (torch.arange(width, dtype=like.dtype, device=like.device) + 0.5) / width * 2 - 1
    y = 1 - (torch.arange(height, dtype=like.dtype, device=like.device) + 0.5) / height * 2
    plane = torch.stack([x[None, :].expand(height, width), y[:, None].expand(height, width)])
    return plane[None].expand(batch, 2, height, width)
