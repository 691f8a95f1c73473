"""The multi-image network: encode each picture, take the max over pictures, decode to maps.

Deschaintre et al., "Flexible SVBRDF Capture with a Multi-Image Deep Network", EGSR 2019, sections 4.1
and 4.2: a U-Net with a global track per picture and an order-agnostic max. `network_config.PAPER` is
the published architecture. Our own configurations depart from it where a picture's pixels say more than
features: a pixel-unshuffle stem, the brightest and darkest value of each pixel carried through the max, a
shading cue (see `shading_cue`), where the light is known what photometric stereo needs (see `photometric`), an
output that starts as the guess someone without a model would make, and a second, larger U-Net after the
max, which sees what all pictures say of each pixel at once.
"""

from typing import NamedTuple

import torch
from torch import Tensor, nn
from torch.nn import functional

from svbrdf import photometric
from svbrdf.encoding import (
    coordinates,
    known_cue,
    log_decoding,
    log_encoding,
    shading_cue,
)
from svbrdf.least_squares import STEEPEST
from svbrdf.light_estimate import LightEstimate
from svbrdf.maps import Maps
from svbrdf.network_config import NetworkConfig
from svbrdf.photometric import Poses, Reading
from svbrdf.unet import LEAK, Level, UNet

GUESSED_F0 = 0.04
GUESSED_ROUGHNESS = 0.5
SLOPE_RANGE = 3.0
TRUSTS = 3
"""Outputs beside the maps: how far to believe the slopes of either least squares, and a pixel's own albedo."""


class State(NamedTuple):
    """What the max is taken of: (B, channels, H/stem, W/stem) and (B, features)."""

    map: Tensor
    vector: Tensor


class Network(nn.Module):
    """pictures (B, N, 3, H, W), gamma 2.2 in [0, 1], square -> Maps (B, H, W, ...)."""

    def __init__(self, config: NetworkConfig) -> None:
        super().__init__()
        self.config = config
        self.encoder = Encoder(config)
        self.decoder = Decoder(config)
        if config.raw:
            self.apply(_keep_variance)
            nn.init.zeros_(self.decoder.last.weight)
        if config.poses:
            nn.init.zeros_(self.decoder.believe.weight)

    def forward(self, pictures: Tensor, poses: Poses | None = None) -> Maps:
        """poses: of the B N pictures, in their order."""
        batch, count = pictures.shape[0], pictures.shape[1] // self.config.inputs
        state = self.encode(pictures.flatten(0, 1), poses)
        fused = State(*(part.unflatten(0, (batch, count)).amax(dim=1) for part in state))
        return self.decode(fused)

    def encode(self, picture: Tensor, poses: Poses | None = None) -> State:
        """(B, 3, H, W) gamma-encoded pictures -> their states, (B / config.inputs, ...)."""
        if poses is None:
            poses = photometric.unknown(len(picture), picture.shape[-1], picture.device)
        return self.encoder(picture, poses)

    def decode(self, state: State) -> Maps:
        """A state, or the elementwise max of several -> Maps with arrays (B, H, W, channels)."""
        return self.decoder(state)


class Encoder(nn.Module):
    """One picture's U-Net with its global track."""

    def __init__(self, config: NetworkConfig) -> None:
        super().__init__()
        self.config = config
        channels = 3 * config.stem**2 + 2 + (2 + 2 * config.stem**2 if config.raw else 0)
        channels += photometric.inputs_count(config.stem) if config.poses else 0
        channels *= config.inputs
        beside = config.width if config.stem > 1 else 0
        if beside:
            self.stem = nn.Conv2d(channels, beside, 3, padding=1)
        self.unet = UNet(
            config, beside or channels, config.width, config.widest, config.features, beside
        )
        self.start = nn.Linear(channels, self.unet.track)
        if config.poses:
            self.estimate = LightEstimate()
        if config.stem > 1:
            self.mix = nn.Conv2d(config.features, config.features, 1)

    def forward(self, picture: Tensor, poses: Poses) -> State:
        entry, raw = self.entry(picture, poses)
        if self.config.inputs > 1:
            entry = entry.unflatten(0, (-1, self.config.inputs)).flatten(1, 2)
            raw = [part.unflatten(0, (-1, self.config.inputs)).amax(dim=1) for part in raw]
        vector = functional.selu(self.start(entry.mean(dim=(2, 3))))
        beside = None
        if self.config.stem > 1:
            beside = functional.leaky_relu(self.stem(entry), LEAK)
        x, vector = self.unet(entry if beside is None else beside, vector, beside)
        if beside is not None:
            x = self.mix(functional.leaky_relu(x, LEAK))
        return State(torch.cat([x.float(), *raw], dim=1), vector.float())

    def entry(self, picture: Tensor, poses: Poses) -> tuple[Tensor, list[Tensor]]:
        """What the U-Net sees, and the parts that go to the state past it, (B, channels, H/stem, W/stem).

        Nothing that is trained has a gradient from here.
        """
        stem = self.config.stem
        log = log_encoding(picture)
        fine = functional.pixel_unshuffle(log, stem)
        entry = [fine, coordinates(fine)]
        if not self.config.raw:
            return torch.cat(entry, dim=1), []
        direction, cue = shading_cue(log)
        direction = direction.expand(-1, -1, *fine.shape[2:])
        seen = None
        if self.config.poses:
            told = self._complete(log, poses)
            seen = photometric.observe(picture**2.2, told, stem)
            known = poses.known[:, None, None, None] > 0
            direction = torch.where(known, seen.tilt, direction)
            cue = torch.where(known, known_cue(seen, stem), cue)
        cue = functional.pixel_unshuffle(cue, stem)
        entry += [direction, cue]
        raw = [cue, -cue, fine, -fine]
        if seen:
            entry.append(seen.inputs)
            raw += seen.raw
        return torch.cat(entry, dim=1), raw

    def _complete(self, log: Tensor, poses: Poses) -> Poses:
        """The poses, guessed where they are not known."""
        known = poses.known[:, None] > 0
        light, view = (guess.detach() for guess in self.estimate(log))
        return poses._replace(
            light=torch.where(known, poses.light, light), view=torch.where(known, poses.view, view)
        )


class Fused(nn.Module):
    """What all pictures say of each pixel by itself, and then among its neighbours."""

    def __init__(self, config: NetworkConfig, channels: int, features: int) -> None:
        super().__init__()
        hidden, out = config.squeeze
        self.hidden = nn.Conv2d(channels, hidden, 1)
        self.squeeze = nn.Conv2d(hidden, out, 1, bias=False)
        self.unet = UNet(config, out, config.fused_width, config.fused_widest, features, out)

    def forward(self, x: Tensor, vector: Tensor) -> tuple[Tensor, Tensor]:
        x = self.squeeze(functional.leaky_relu(self.hidden(x), LEAK))
        fused: tuple[Tensor, Tensor] = self.unet(x, vector, x)
        return fused


class Decoder(nn.Module):
    """The fused state to maps (section 4.2): three convolutions and the global track.

    With `fused_width` the first of them is a U-Net, and the global track starts with the highlight's lobe.
    """

    def __init__(self, config: NetworkConfig) -> None:
        super().__init__()
        self.config = config
        raw = 10 * config.stem**2 if config.raw else 0
        state, (first, second) = config.features + raw, config.final
        outputs = (9 + (TRUSTS if config.poses else 0)) * config.stem**2
        self.exchange = nn.Linear(config.features, state, bias=False)
        entry = state + (photometric.derived_count(config.stem) if config.poses else 0)

        def level(i: int, o: int, track: int, track_out: int) -> Level:
            convolution = nn.Conv2d(i, o, 3, padding=1, bias=False)
            return Level(convolution, config.final_norms, track, True, track_out=track_out)

        if config.fused_width:
            self.first: Fused | Level = Fused(config, entry, first)
            tracks = self.first.unet.track, first
        else:
            self.first = level(entry, first, config.features, second)
            self.first.activate = False
            tracks = config.features, second
        told = photometric.LOBE_COUNT + photometric.FIT_COUNT if config.poses else 0
        self.update = nn.Linear(config.features + state + told, tracks[0])
        if config.poses:
            self.believe = nn.Linear(tracks[0], TRUSTS)
        self.second = level(first, second, tracks[1], 9)
        self.last = nn.Conv2d(second, outputs, 3, padding=1)

    def forward(self, state: State) -> Maps:
        widths = photometric.widths(self.config.stem) if self.config.poses else ()
        seen, *raw = state.map.split((self.exchange.out_features, *widths), dim=1)
        x = seen + self.exchange(state.vector)[:, :, None, None]
        whole = [state.vector, seen.mean(dim=(2, 3))]
        told = None
        if self.config.poses:
            told = self.read(raw)
            x = torch.cat([x, *told.derived], dim=1)
            whole += [told.lobe, told.fit]
        start = functional.selu(self.update(torch.cat(whole, dim=1)))
        x, vector = self.first(x, start)
        x, _ = self.second(x, vector)
        out = self.last(functional.leaky_relu(x, LEAK)).float()
        out = out.unflatten(1, (-1, self.config.stem**2))
        out, trust = torch.tanh(out[:, :9]), out[:, 9:]
        if told is not None:
            trust = torch.tanh(trust + self.believe(start)[:, :, None, None, None])
        if self.config.raw:
            guess = self._guess(seen, told, trust)
            out = (out + guess) / (1 + out * guess)  # tanh(a + b) of tanh a and tanh b
        return _maps(functional.pixel_shuffle(out.flatten(1, 2), self.config.stem))

    def read(self, raw: list[Tensor]) -> Reading:
        """What the pictures say of light and highlights; nothing that is trained has a gradient from here."""
        return photometric.read(raw, self.config.stem)

    def _guess(self, seen: Tensor, told: Reading | None, trust: Tensor) -> Tensor:
        """The output, (B, 9, fine, h, w) in (-1, 1), for the maps of someone without a model.

        Slopes and diffuse are those of photometric stereo; trust: (B, TRUSTS, fine, h, w) in (-1, 1), from
        flat to twice the careful slopes; what to add or take of the free ones; and how far to give up the
        albedo of a pixel, that a highlight may hide, for that around it. Where the light is only guessed, the
        level of the diffuse is halfway, in log, between the brightest and darkest that the pixels ever were; so
        is all of it where the network takes no poses.
        """
        fine = self.config.stem**2
        brightest, negative = seen[:, -6 * fine : -3 * fine], seen[:, -3 * fine :]
        middle = ((brightest - negative) / 2).unflatten(1, (3, fine))
        slopes = torch.zeros_like(middle[:, :2])
        diffuse = log_decoding(middle)
        if told is not None:
            slopes = told.slopes * (1 + trust[:, :1]) + told.free * trust[:, 1:2]
            slopes = slopes.clamp(-STEEPEST, STEEPEST)
            albedo = told.albedo + trust[:, 2:] * (photometric.around(told.albedo) - told.albedo)
            known = told.derived[0][:, :, None, :1, :1] > 0.75
            level = (middle - told.albedo).mean(dim=(2, 3, 4), keepdim=True)
            diffuse = torch.where(
                known, photometric.linear(albedo) / (1 - GUESSED_F0), log_decoding(albedo + level)
            )
        rest = torch.tensor([GUESSED_ROUGHNESS, *[GUESSED_F0] * 3], device=diffuse.device)
        rest = rest[:, None, None, None].expand(len(diffuse), 4, *diffuse.shape[2:])
        values = torch.cat([diffuse.clamp(0.002, 0.998), rest], dim=1) * 2 - 1
        return torch.cat([slopes / SLOPE_RANGE, values], dim=1)


def _keep_variance(module: nn.Module) -> None:
    """He initialisation: where there is no norm, nothing else keeps deep signals from fading."""
    if isinstance(module, nn.Conv2d):
        nn.init.kaiming_normal_(module.weight, a=LEAK)
    if isinstance(module, nn.Linear):
        nn.init.kaiming_normal_(module.weight, nonlinearity="linear")
    if isinstance(module, nn.Conv2d | nn.Linear) and module.bias is not None:
        nn.init.zeros_(module.bias)


def _maps(out: Tensor) -> Maps:
    """(B, 9, H, W) in [-1, 1]: nx, ny, diffuse, roughness, specular."""
    channels_last = out.permute(0, 2, 3, 1)
    slope, rest = SLOPE_RANGE * channels_last[..., :2], (channels_last[..., 2:] + 1) / 2
    normal = torch.cat([slope, torch.ones_like(slope[..., :1])], dim=-1)
    normal = normal / normal.norm(dim=-1, keepdim=True)
    return Maps(normal, rest[..., 0:3], rest[..., 3:4], rest[..., 4:7])
