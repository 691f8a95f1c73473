"""The training materials: a pool of base maps on the training device, mixed without end.

Convex mixes of random pairs, rotation, scale and crop as in section 5.1 of the paper; recolouring and
changes of relief and gloss are ours.
"""

from collections.abc import Iterable
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

import numpy as np
import torch
from torch import Tensor
from torch.nn import functional

from svbrdf import materials, procedural
from svbrdf.maps import Maps
from svbrdf.renderer import ROUGHNESS_FLOOR

TEXELS = 512
"""Of a base material's side: sharp enough for the crops that networks are judged by, half a set across 256."""
REAL_SHARE = 0.5
"""Share of draws from material folders, when there are any."""
METAL_SHARE, POLISHED_SHARE, RESURFACED_SHARE, STEEP_SHARE = 0.25, 0.2, 0.5, 0.15
"""Of the samples, how many are made metal, how many smoother than they were, how many as rough as chance has
it, and how many steeper: sets have few of the first two and the last, and most of theirs are half rough, which
a network would learn to say of everything."""
POLISHED_METAL_SHARE = 0.6
"""Of the metals. With a fifth a training lost 0.1 of SSIM on mirrors, and nothing elsewhere."""


class MaterialPool:
    """Base materials as slopes and albedos, all tileable, float16, and the same from twice as far."""

    def __init__(self, base: Tensor, real: int, device: torch.device) -> None:
        """base: (M, 9, S, S), of which the first `real` come from folders."""
        base = base.to(device)
        levels = base, functional.avg_pool2d(base, 2)
        self.levels = [functional.pad(level, (1, 1, 1, 1), mode="circular") for level in levels]
        self.device, self.real = device, real

    def sample(self, batch: int, resolution: int, rng: torch.Generator) -> Maps:
        """New maps (batch, resolution, resolution, channels) on the pool's device."""
        first, second = self._draw(batch, resolution, rng), self._draw(batch, resolution, rng)
        share = 0.1 + 0.8 * self._uniform(batch, rng)
        share = torch.where(self._uniform(batch, rng) < 0.5, share, 1.0)[..., None]
        mixed = first * share + second * (1 - share)
        return self._to_maps(self._vary(mixed, rng))

    def _draw(self, batch: int, resolution: int, rng: torch.Generator) -> Tensor:
        """Random base materials under a random rotation, scale and offset, wrapped around.

        A pixel is 0.8 to 2 texels, of the base or of its half: far enough for detail, near enough not to alias.
        """
        base = self.levels[int(torch.randint(len(self.levels), (1,), generator=rng))]
        total, size = base.shape[0], base.shape[-1] - 2
        real = torch.rand(batch, generator=rng) < (REAL_SHARE if self.real else 0.0)
        if self.real == total:
            real[:] = True
        low = torch.where(real, 0, self.real)
        count = torch.where(real, max(self.real, 1), total - self.real)
        index = low + (torch.rand(batch, generator=rng) * count).long()
        textures = base[index.to(base.device)].float()
        turn = self._uniform(batch, rng) * 2 * torch.pi
        scale = (0.8 + 1.2 * self._uniform(batch, rng)) * resolution / size
        offset = torch.rand(batch, 1, 1, 2, generator=rng).to(textures)
        axis = ((torch.arange(resolution) + 0.5) / resolution - 0.5).to(textures)
        y, x = torch.meshgrid(-axis, axis, indexing="ij")
        cosine, sine = turn.cos(), turn.sin()
        u = (cosine * x + sine * y) * scale + offset[..., 0]
        v = (-sine * x + cosine * y) * scale + offset[..., 1]
        place = torch.stack([u % 1, (-v) % 1], dim=-1)
        place = (place * size + 1) / (size + 2) * 2 - 1
        drawn = functional.grid_sample(textures, place, align_corners=False)
        sx, sy = drawn[:, 0:1], drawn[:, 1:2]
        cosine, sine = cosine[:, None], sine[:, None]
        turned = torch.cat([cosine * sx - sine * sy, sine * sx + cosine * sy], dim=1)
        return torch.cat([turned, drawn[:, 2:]], dim=1)

    def _vary(self, packed: Tensor, rng: torch.Generator) -> Tensor:
        batch = len(packed)
        relief = (0.35 * self._normal((batch, 1, 1, 1), rng)).exp()
        steeper = 1 + 1.5 * self._uniform(batch, rng)[..., None]
        steep = (self._uniform(batch, rng) < STEEP_SHARE)[..., None]
        relief = relief * torch.where(steep, steeper, 1.0)
        slopes, diffuse = packed[:, 0:2] * relief, packed[:, 2:5]
        rough, specular = packed[:, 5:6], packed[:, 6:9]
        colour = 0.25 * self._normal((batch, 1, 1, 1), rng) + 0.12 * self._normal(
            (batch, 3, 1, 1), rng
        )
        diffuse = (diffuse * colour.exp()).clamp(0, 0.98)
        chance = 0.05 + 0.95 * self._uniform(batch, rng)[..., None]
        resurfaced = (self._uniform(batch, rng) < RESURFACED_SHARE)[..., None]
        level = rough.mean(dim=(2, 3), keepdim=True)
        rough = rough + torch.where(resurfaced, chance - level, 0.0)
        metal = (self._uniform(batch, rng) < METAL_SHARE)[..., None]
        polish = 1 - 0.95 * self._uniform(batch, rng)[..., None]
        polished = torch.where(metal, POLISHED_METAL_SHARE, POLISHED_SHARE)
        polished = self._uniform(batch, rng)[..., None] < polished
        rough = (rough * torch.where(polished, polish, 1.0)).clamp(ROUGHNESS_FLOOR, 1)
        specular = torch.where(metal, self._metallic(diffuse, rng), specular)
        diffuse = diffuse * torch.where(metal, 0.01, 1.0)
        order = torch.randperm(3, generator=rng).to(diffuse.device)
        return torch.cat([slopes, diffuse[:, order], rough, specular[:, order]], dim=1)

    def _metallic(self, colour: Tensor, rng: torch.Generator) -> Tensor:
        """F0 of a metal, (B, 3, H, W): from one tint, to one that follows the colour.

        Bare metals reflect half of the light (iron, chromium, titanium) to nearly all (silver, aluminium); of
        a mirror whose highlight clips nothing but this prior tells how much.
        """
        batch = len(colour)
        tint = 0.98 - 0.58 * self._uniform(batch, rng)[..., None] ** 2
        contrast = self._uniform(batch, rng)[..., None] ** 3
        brightest = colour.amax(dim=(1, 2, 3), keepdim=True).clamp(min=1e-3)
        return tint * (1 - contrast * (1 - colour / brightest))

    @staticmethod
    def _to_maps(packed: Tensor) -> Maps:
        last = packed.permute(0, 2, 3, 1)
        normal = torch.cat([last[..., 0:2], torch.ones_like(last[..., :1])], dim=-1)
        normal = normal / normal.norm(dim=-1, keepdim=True)
        return Maps(normal, last[..., 2:5], last[..., 5:6], last[..., 6:9])

    def _uniform(self, batch: int, rng: torch.Generator) -> Tensor:
        return torch.rand(batch, 1, 1, generator=rng).to(self.device)

    def _normal(self, shape: tuple[int, ...], rng: torch.Generator) -> Tensor:
        return torch.randn(shape, generator=rng).to(self.device)


def build(
    folders: Iterable[Path], seeds: Iterable[int], device: torch.device, workers: int
) -> MaterialPool:
    """Load the folders and make the procedural materials."""
    real = [pack(materials.averaged(materials.load(folder), TEXELS)) for folder in folders]
    with ProcessPoolExecutor(workers) as processes:
        made = list(processes.map(_make, seeds, chunksize=8))
    return MaterialPool(torch.from_numpy(np.stack([*real, *made])), len(real), device)


def pack(maps: Maps) -> np.ndarray:
    """(9, H, W) float16: slopes, diffuse, roughness, specular."""
    slopes = maps.normal[..., :2] / np.maximum(maps.normal[..., 2:], 0.05)
    packed = np.concatenate([slopes, maps.diffuse, maps.roughness, maps.specular], axis=-1)
    return np.ascontiguousarray(packed.transpose(2, 0, 1)).astype(np.float16)


def _make(seed: int) -> np.ndarray:
    return pack(procedural.material(seed, TEXELS))
