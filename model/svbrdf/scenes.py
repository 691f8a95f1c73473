"""Random lights, views and cameras: the pictures a network is trained and tested on.

Section 5.2 of the paper; numbers marked [A] in docstrings are from the authors' code. Beside the paper's
handheld camera with a separate light there are the phone's own flash and the rig's fixed camera.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import torch
from torch import Tensor
from torch.nn import functional

from svbrdf import photometric
from svbrdf.lighting import Light, Lighting
from svbrdf.maps import Maps
from svbrdf.renderer import pixel_positions, render

TONED_SHARES, CONTRAST = {"handheld": 0.5, "flash": 0.9}, (0.4, 1.0)
"""Of materials, how many are seen through a phone's tone curve, and how steep it is."""
TAILED_SHARES, TAIL = {"handheld": 0.25, "flash": 0.6}, (0.1, 0.6)
"""Of materials, how many shine wider than one lobe allows, and how much of their shine is that wide."""
GLARE = {"handheld": 0.01, "flash": 0.02}
"""Median share of the light that a phone's lens scatters."""

Render = Callable[[Maps, Tensor, Tensor, Tensor | float], Tensor]


@dataclass(frozen=True)
class Poses:
    """Positions in the sample's frame, (B, N, 3) each."""

    light: Tensor
    view: Tensor


@dataclass(frozen=True)
class Shots:
    """Pictures of B materials, N of each, and what a rig would know of them.

    pictures: (B, N, 3, H, W) gamma-encoded, 8-bit; white: (B, N, 3, H, W), what a white Lambertian patch
    that faces the light would record at each pixel, the weak light of the surroundings left out.
    """

    pictures: Tensor
    poses: Poses
    white: Tensor


def handheld(batch: int, count: int, rng: torch.Generator) -> Poses:
    """A camera and a separate light over the hemisphere; the first picture near-frontal [A]."""
    view = _hemisphere((batch, count), rng, lowest_deg=20)
    light = _hemisphere((batch, count), rng, lowest_deg=8)
    frontal = torch.tensor([0.0, 0.0, 1.0])
    view[:, 0] = _unit(frontal + 0.1 * torch.randn(batch, 3, generator=rng))
    light[:, 0] = _unit(frontal + 0.25 * torch.randn(batch, 3, generator=rng))
    light[..., 2], view[..., 2] = light[..., 2].abs(), view[..., 2].abs()
    return Poses(
        light * _jitter(2.2, 0.1, (batch, count), rng),
        view * _jitter(2.75, 0.1, (batch, count), rng),
    )


def clean(batch: int, count: int, rng: torch.Generator) -> Poses:
    """Handheld, with every camera and every light at its own one distance."""
    poses = handheld(batch, count, rng)
    return Poses(2.2 * _unit(poses.light), 2.75 * _unit(poses.view))


def flash(batch: int, count: int, rng: torch.Generator) -> Poses:
    """A phone whose flash sits beside the lens, from as far as people hold one and crop its picture."""
    view = handheld(batch, count, rng).view * _jitter(1.15, 0.25, (batch, count), rng)
    beside = 0.1 * torch.randn(batch, count, 3, generator=rng)
    light = view + beside
    light[..., 2] = light[..., 2].clamp(min=0.3)
    return Poses(light, view)


def rig(batch: int, count: int, rng: torch.Generator) -> Poses:
    """A fixed camera and LEDs on two rings over a turntable, in the turning sample's frame.

    The reference rig's geometry with its angles and distances varied; the second picture is near the
    mirror pair of a flat sample.
    """
    shape = (batch, count)
    polar = torch.deg2rad(35 + 4 * torch.randn(batch, 1, generator=rng)).expand(shape)
    turn = 2 * math.pi * torch.rand(shape, generator=rng)
    view = _polar(polar, turn) * _jitter(6.0, 0.1, shape, rng)
    ring = torch.where(torch.rand(shape, generator=rng) < 0.6, 35.0, 65.0)
    elevation = torch.deg2rad(ring + 3 * torch.randn(batch, 1, generator=rng))
    azimuth = 2 * math.pi * torch.rand(shape, generator=rng)
    if count > 1:
        elevation[:, 1] = polar[:, 1]
        azimuth[:, 1] = turn[:, 1] + math.pi + 0.05 * torch.randn(batch, generator=rng)
    return Poses(_polar(elevation, azimuth) * _jitter(5.0, 0.05, shape, rng), view)


def shots(
    maps: Maps, count: int, rng: torch.Generator, kind: str, renderer: Render = render
) -> Shots:
    """`count` pictures of each of B materials under random scenes.

    kind: "paper" for section 5.2 as written; "handheld", "flash" and "rig" also vary the exposure, and the
    first two of them, which phones take, the tone curve, the highlight's tail and the lens's glare; "clean" is
    "paper" without its perturbations, the paper's ablation. A flash lights more evenly than the paper's lamp;
    to a network that knows only that, an even picture is a surface that is dark in the middle. Likewise a
    highlight under a phone's tone curve is brighter than one that knows gamma 1/2.2 alone would expect, and its
    surroundings darker; and real wood and leather shine wider than the one lobe of our BRDF.
    """
    batch, height, width = maps.normal.shape[:3]
    device = maps.normal.device
    make = {"paper": handheld, "handheld": handheld, "flash": flash, "rig": rig, "clean": clean}
    poses = make[kind](batch, count, rng)
    light, view = (p.flatten(0, 1)[:, None, None].to(device) for p in (poses.light, poses.view))
    shape = (batch * count, 1, 1, 1)
    distance = light.norm(dim=-1, keepdim=True)
    reference = {"rig": 1.0}.get(kind, 10 / 2.2**2)
    per_shot = {"rig": 0.05, "clean": 0.0}.get(kind, 0.4)
    vary = 0.0 if kind == "clean" else 1.0
    power = (
        (math.log(1.0 if kind == "rig" else 1.5) + per_shot * torch.randn(shape, generator=rng))
        .exp()
        .to(device)
    )
    white = 1 + 0.03 * vary * torch.randn(*shape[:3], 3, generator=rng).to(device)
    middle, spread = {"rig": (1.0, 0.35), "flash": (1.5, 0.8)}.get(kind, (5.0, 0.35))
    lobe = (math.log(middle) + spread * vary * torch.randn(shape, generator=rng)).exp()
    positions = pixel_positions(torch, height, width, device=device)
    ray = positions - light
    length = ray.norm(dim=-1, keepdim=True)
    axis = ((-light / distance * ray).sum(dim=-1, keepdim=True) / length).clamp(min=0.01)
    falloff = axis ** lobe.to(device) * (distance / length) ** 2
    strength = reference * power * (2.2 / distance) ** (0 if kind == "rig" else 2)
    repeated = maps.map(lambda a: a.repeat_interleave(count, dim=0))
    reading = strength * white * falloff
    radiance = renderer(repeated, light, view, math.pi * reading)
    if kind in TAILED_SHARES:
        wider, share = _tail(repeated, count, kind, rng)
        radiance = radiance.lerp(renderer(wider, light, view, math.pi * reading), share)
    radiance = radiance + _surroundings(repeated, view, batch, count, kind, rng, renderer)
    if kind in GLARE:
        radiance = radiance + _glare(radiance, GLARE[kind], rng)
    if kind not in ("paper", "clean"):
        exposure = _exposure(radiance.unflatten(0, (batch, count)), kind, rng)
        radiance, reading = radiance * exposure, reading * exposure
    contrast = _contrast(batch, count, kind, rng).to(device)
    seen, reading = (
        image.permute(0, 3, 1, 2).unflatten(0, (batch, count))
        for image in (_camera(radiance, vary, contrast, rng), reading)
    )
    return Shots(seen, Poses(poses.light.to(device), poses.view.to(device)), reading)


@dataclass(frozen=True)
class Knowledge:
    """What is known of poses, and how wrongly.

    share: of the materials, how many have their poses known. light_deg: standard deviation of a light's
    direction along each axis. power: relative standard deviation of a light's power.
    """

    share: float = 1.0
    light_deg: float = 0.0
    power: float = 0.0


def known(shots: Shots, rng: torch.Generator, knowledge: Knowledge) -> photometric.Poses:
    """What the network is told of the B N pictures, errors of calibration included."""
    light, view, white = shots.poses.light, shots.poses.view, shots.white
    batch, count = light.shape[:2]
    off = math.radians(knowledge.light_deg) * torch.randn(batch, count, 3, generator=rng)
    light = light + light.norm(dim=-1, keepdim=True) * off.to(light)
    factor = (knowledge.power * torch.randn(batch, count, 1, 1, 1, generator=rng)).exp()
    told = (torch.rand(batch, 1, generator=rng) < knowledge.share).float().expand(batch, count)
    return photometric.Poses(
        light.flatten(0, 1),
        view.flatten(0, 1),
        (white * factor.to(white)).flatten(0, 1),
        told.flatten().to(light),
    )


def lighting(shots: Shots, index: int) -> Lighting:
    """Where camera and light of one picture of the first material truly were."""
    light, view = (p[0, index].numpy() for p in (shots.poses.light, shots.poses.view))
    return Lighting(view, (Light(light, shots.white[0, index].permute(1, 2, 0).numpy()),))


def rendering_pairs(batch: int, rng: torch.Generator, thirds: int = 3) -> Poses:
    """View/light pairs of the rendering loss, `thirds` of cosine-weighted directions and twice as many
    mirror pairs [A]: nine as published; fewer keep the mixture and cost less per step."""
    diffuse_view, diffuse_light = (_cosine((batch, thirds), rng) for _ in range(2))
    mirrors = (batch, 2 * thirds)
    direction = _cosine(mirrors, rng)
    mirrored = direction * torch.tensor([-1.0, -1.0, 1.0])
    shift = 2 * torch.rand(*mirrors, 3, generator=rng) - 1
    shift[..., 2] = 0
    near, far = ((0.5 + 0.75 * torch.randn(*mirrors, 1, generator=rng)).exp() for _ in range(2))
    view = torch.cat([diffuse_view, direction * near + shift], dim=1)
    light = torch.cat([diffuse_light, mirrored * far + shift], dim=1)
    return Poses(light, view)


def _surroundings(
    maps: Maps,
    view: Tensor,
    batch: int,
    count: int,
    kind: str,
    rng: torch.Generator,
    renderer: Render,
) -> Tensor:
    """A weak, distant light, the same for all pictures of a material."""
    place = _hemisphere((batch, 1), rng, lowest_deg=8) * 8
    place = place.repeat_interleave(count, dim=0)[:, :, None].to(view)
    strength = (math.log(0.1) + 0.8 * torch.randn(batch, 1, 1, 1, generator=rng)).exp()
    if kind in ("rig", "clean"):
        strength = strength * 0
    strength = strength.repeat_interleave(count, dim=0).to(view)
    return renderer(maps, place, view, math.pi * strength)


def _tail(maps: Maps, count: int, kind: str, rng: torch.Generator) -> tuple[Maps, Tensor]:
    """The B N maps with a wider lobe, and how much of their shine is in it, (B N, 1, 1, 1).

    Both are the same for all `count` pictures of a material.
    """
    shape = (len(maps.roughness) // count, 1, 1, 1)
    wider = 0.15 + 0.55 * torch.rand(shape, generator=rng)
    least, most = TAIL
    share = least + (most - least) * torch.rand(shape, generator=rng)
    share = torch.where(torch.rand(shape, generator=rng) < TAILED_SHARES[kind], share, 0.0)
    wider, share = (a.repeat_interleave(count, dim=0).to(maps.roughness) for a in (wider, share))
    return replace(maps, roughness=maps.roughness + wider * (1 - maps.roughness)), share


def _glare(radiance: Tensor, median: float, rng: torch.Generator) -> Tensor:
    """What a lens scatters of an image (B N, H, W, 3), highlights that clip included: smooth, and a little."""
    scattered = (math.log(median) + 0.7 * torch.randn(len(radiance), 1, 1, 1, generator=rng)).exp()
    image = radiance.permute(0, 3, 1, 2)
    blurred = functional.adaptive_avg_pool2d(image, 6)
    blurred = functional.interpolate(blurred, image.shape[2:], mode="bicubic").clamp(min=0)
    return scattered.to(radiance) * blurred.permute(0, 2, 3, 1)


def _exposure(radiance: Tensor, kind: str, rng: torch.Generator) -> Tensor:
    """Factors (B N, 1, 1, 1) of a camera that exposes by itself, for half of the handheld pictures."""
    batch, count = radiance.shape[:2]
    device = radiance.device
    if kind == "rig":
        return (
            (0.15 * torch.randn(batch, 1, 1, 1, generator=rng))
            .exp()
            .repeat_interleave(count, dim=0)
            .to(device)
        )
    middle = radiance.detach().mean(dim=-1).flatten(2).quantile(0.6, dim=-1).clamp(min=0.003)
    target = (math.log(0.22) + 0.6 * torch.randn(batch, count, generator=rng)).exp().to(device)
    automatic = (torch.rand(batch, 1, generator=rng) < 0.6).to(device)
    return torch.where(automatic, target / middle, 1.0).flatten()[:, None, None, None]


def _contrast(batch: int, count: int, kind: str, rng: torch.Generator) -> Tensor:
    """(B N, 1, 1, 1): how steep the tone curve of a phone is, the same for all pictures of a material.

    At 0.7 mid grey is 1.7 times as steep as under gamma 1/2.2 alone, black and white 0.3 times.
    """
    if kind not in TONED_SHARES:
        return torch.zeros(batch * count, 1, 1, 1)
    least, most = CONTRAST
    steep = least + (most - least) * torch.rand(batch, 1, 1, 1, generator=rng)
    toned = torch.rand(batch, 1, 1, 1, generator=rng) < TONED_SHARES[kind]
    return torch.where(toned, steep, 0.0).repeat_interleave(count, dim=0)


def _camera(radiance: Tensor, noisy: float, contrast: Tensor, rng: torch.Generator) -> Tensor:
    """Noise, clipping, gamma 1/2.2, the phone's tone curve and 8 bits."""
    count = radiance.shape[0]
    sigma = (math.log(0.005) + 0.3 * torch.randn(count, 1, 1, 1, generator=rng)).exp()
    noise = noisy * torch.randn(radiance.shape, generator=rng) * sigma
    exposed = (radiance + noise.to(radiance.device)).clamp(0, 1)
    encoded = exposed ** (1 / 2.2)
    toned = encoded - contrast / (2 * math.pi) * (2 * math.pi * encoded).sin()
    return (toned * 255).round() / 255


def _hemisphere(shape: tuple[int, ...], rng: torch.Generator, lowest_deg: float) -> Tensor:
    """Uniform unit directions at least lowest_deg above the horizon."""
    low = math.sin(math.radians(lowest_deg))
    z = low + (1 - low) * torch.rand(shape, generator=rng)
    return _polar(torch.acos(z), 2 * math.pi * torch.rand(shape, generator=rng))


def _cosine(shape: tuple[int, ...], rng: torch.Generator) -> Tensor:
    """Cosine-weighted unit directions, kept off the horizon."""
    z = torch.rand(shape, generator=rng).sqrt().clamp(min=0.05)
    return _polar(torch.acos(z), 2 * math.pi * torch.rand(shape, generator=rng))


def _polar(polar: Tensor, azimuth: Tensor) -> Tensor:
    flat = polar.sin()
    return torch.stack([flat * azimuth.cos(), flat * azimuth.sin(), polar.cos()], dim=-1)


def _jitter(middle: float, sigma: float, shape: tuple[int, ...], rng: torch.Generator) -> Tensor:
    return middle * (sigma * torch.randn(*shape, 1, generator=rng)).exp()


def _unit(vector: Tensor) -> Tensor:
    return vector / vector.norm(dim=-1, keepdim=True)
