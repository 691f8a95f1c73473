"""The multi-image network: encode each picture, take the max over pictures, decode to maps.

Deschaintre et al., "Flexible SVBRDF Capture with a Multi-Image Deep Network", EGSR 2019, sections 4.1
and 4.2: a U-Net with a global track per picture and an order-agnostic max. `PAPER` is the published
architecture. Our own configurations depart from it where a picture's pixels say more than features:
a pixel-unshuffle stem, the brightest and darkest value of each pixel carried through the max, a shading
cue (see `shading_cue`), where the light is known what photometric stereo needs (see `photometric`), an
output that starts as the guess someone without a model would make, and a second, larger U-Net after the
max, which sees what all pictures say of each pixel at once.
"""

from dataclasses import dataclass, replace
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
from svbrdf.light_estimate import LightEstimate
from svbrdf.maps import Maps
from svbrdf.photometric import Poses, Reading

LEAK = 0.2
GUESSED_F0 = 0.04
GUESSED_ROUGHNESS = 0.5
SLOPE_RANGE = 3.0


@dataclass(frozen=True)
class NetworkConfig:
    """The shape of a network; defaults are the published one at ngf 64."""

    width: int = 64
    """Channels of the first encoder level; doubled per level up to width x widest."""
    levels: int = 8
    """Encoder levels, each halving the resolution; the picture's side over stem must be >= 2^levels."""
    widest: int = 8
    stem: int = 1
    """Pixel-unshuffle factor before the U-Net; 1 for none. Above 1 a 3x3 stem skips to the last level."""
    features: int = 64
    """Learned channels of the state."""
    decoder_convolutions: int = 2
    decoder_kernel: int = 4
    final_norms: bool = True
    """Instance norms after the max too; they hide how bright the pictures were."""
    raw: bool = False
    """Carry the log picture, the shading cue and their negatives through the max, and start the output
    at the guess that the brightest and darkest pixels make."""
    poses: bool = False
    """Take where camera and light were, and how bright, where that is known. Needs raw."""
    inputs: int = 1
    """Pictures encoded together, always so many: the paper's baseline. 1 for any number, fused by max."""
    final: tuple[int, int] = (64, 32)
    """Channels of the two hidden layers of the decoder of the state."""
    fused_width: int = 0
    """Width of a second U-Net, that of the fused state; 0 for none, as published."""
    fused_widest: int = 8
    squeeze: tuple[int, int] = (128, 48)
    """Channels, hidden and out, of the two 1x1 convolutions that reduce the state before that U-Net."""


PAPER = NetworkConfig()
EDGE = NetworkConfig(
    width=16, levels=5, widest=6, stem=2, features=32, decoder_convolutions=1, decoder_kernel=3,
    final_norms=False, raw=True, poses=True, final=(48, 48), fused_width=32,
)  # fmt: skip
FIVE = replace(EDGE, inputs=5)


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
        entry, raw = self._entry(picture, poses)
        if self.config.inputs > 1:
            entry = entry.unflatten(0, (-1, self.config.inputs)).flatten(1, 2)
            raw = raw.unflatten(0, (-1, self.config.inputs)).amax(dim=1)
        vector = functional.selu(self.start(entry.mean(dim=(2, 3))))
        beside = None
        if self.config.stem > 1:
            beside = functional.leaky_relu(self.stem(entry), LEAK)
        x, vector = self.unet(entry if beside is None else beside, vector, beside)
        if beside is not None:
            x = self.mix(functional.leaky_relu(x, LEAK))
        return State(torch.cat([x.float(), raw], dim=1), vector.float())

    def _entry(self, picture: Tensor, poses: Poses) -> tuple[Tensor, Tensor]:
        """What the U-Net sees, and what goes to the state past it, (B, channels, H/stem, W/stem)."""
        stem = self.config.stem
        log = log_encoding(picture)
        fine = functional.pixel_unshuffle(log, stem)
        entry = [fine, coordinates(fine)]
        if not self.config.raw:
            return torch.cat(entry, dim=1), fine[:, :0]
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
            raw.append(seen.raw)
        return torch.cat(entry, dim=1), torch.cat(raw, dim=1)

    def _complete(self, log: Tensor, poses: Poses) -> Poses:
        """The poses, guessed where they are not known."""
        known = poses.known[:, None] > 0
        light, view = (guess.detach() for guess in self.estimate(log))
        return poses._replace(
            light=torch.where(known, poses.light, light), view=torch.where(known, poses.view, view)
        )


class UNet(nn.Module):
    """Levels down and up, each halving or doubling the resolution, beside a global track."""

    def __init__(
        self,
        config: NetworkConfig,
        channels: int,
        width: int,
        widest: int,
        features: int,
        beside: int,
    ) -> None:
        """channels: that come in. features: that come out. beside: that come in past it all, at the end."""
        super().__init__()
        widths = [min(width * 2**i, width * widest) for i in range(config.levels)]
        self.track = widths[1]
        last = config.levels - 1
        self.down = nn.ModuleList(
            Level(
                convolution=nn.Conv2d(i, o, 4, 2, 1, bias=False),
                norm=0 < level < last,
                track=None if level == 0 else widths[level],
                activate=level > 0,
                track_out=widths[min(level + 1, last)],
            )
            for level, (i, o) in enumerate(zip([channels, *widths], widths, strict=False))
        )
        ups, below, track = [], widths[-1], widths[-1]
        for level in reversed(range(config.levels)):
            skip = 0 if level == last else widths[level]
            target = features if level == 0 else widths[level - 1]
            rise = Rise(config, below + skip, target, beside if level == 0 else 0)
            ups.append(Level(rise, norm=level > 0, track=track, activate=True, channels=target))
            below = track = target
        self.up = nn.ModuleList(ups)

    def forward(
        self, x: Tensor, vector: Tensor, beside: Tensor | None = None
    ) -> tuple[Tensor, Tensor]:
        """(B, channels, h, w) and (B, track) -> (B, features, h, w) and (B, features)."""
        skips: list[Tensor] = []
        for level in self.down:
            x, vector = level(x, vector)
            skips.append(x)
        for i, level in enumerate(self.up):
            last = beside if i == len(self.up) - 1 else None
            x = x if i == 0 else torch.cat([x, skips[-1 - i]], dim=1)
            x, vector = level(x, vector, last)
        return x, vector


class Level(nn.Module):
    """[leaky ReLU], convolution, [instance norm], and the exchange with the global track.

    track: size of the incoming global vector, or None for the first level, which leaves it alone.
    """

    def __init__(
        self,
        convolution: nn.Module,
        norm: bool,
        track: int | None,
        activate: bool,
        channels: int | None = None,
        track_out: int | None = None,
    ) -> None:
        super().__init__()
        out = channels or convolution.out_channels
        assert isinstance(out, int)
        self.activate = activate
        self.convolution = convolution
        self.norm = nn.InstanceNorm2d(out, affine=True) if norm else None
        self.exchange = None if track is None else nn.Linear(track, out, bias=False)
        self.update = None if track is None else nn.Linear(track + out, track_out or out)

    def forward(
        self, x: Tensor, vector: Tensor, beside: Tensor | None = None
    ) -> tuple[Tensor, Tensor]:
        if self.activate:
            x = functional.leaky_relu(x, LEAK)
        x = self.convolution(x) if beside is None else self.convolution(x, beside)
        if self.exchange is None or self.update is None:
            return x, vector
        mean = x.mean(dim=(2, 3))
        x = x if self.norm is None else self.norm(x)
        x = x + self.exchange(vector)[:, :, None, None].to(x.dtype)
        return x, functional.selu(self.update(torch.cat([vector, mean], dim=1)))


class Rise(nn.Module):
    """Nearest x2, then the level's convolutions with nothing between them.

    Where the stem comes in beside, so does its product with the coarse features: light direction,
    which is coarse, times brightness gradient, which is fine, is what tells a slope.
    """

    def __init__(self, config: NetworkConfig, channels: int, out: int, beside: int) -> None:
        super().__init__()
        size = config.decoder_kernel
        self.pad = ((size - 1) // 2, size // 2) * 2
        self.reduce = nn.Conv2d(channels, out, 1) if config.decoder_convolutions == 1 else None
        inner = out if self.reduce else channels
        self.convolutions = nn.ModuleList(
            nn.Conv2d(
                (inner if i == 0 else out) + (2 * beside if i == 0 else 0), out, size, bias=False
            )
            for i in range(config.decoder_convolutions)
        )

    def forward(self, x: Tensor, beside: Tensor | None = None) -> Tensor:
        if self.reduce is not None:
            x = functional.leaky_relu(self.reduce(x), LEAK)
        x = functional.interpolate(x, scale_factor=2.0, mode="nearest")
        if beside is not None:
            x = torch.cat([x, beside, x[:, : beside.shape[1]] * beside], dim=1)
        for convolution in self.convolutions:
            x = convolution(functional.pad(x, self.pad))
        return x


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
        outputs = 9 * config.stem**2
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
        lobe = photometric.lobe_count() if config.poses else 0
        self.update = nn.Linear(config.features + state + lobe, tracks[0])
        self.second = level(first, second, tracks[1], 9)
        self.last = nn.Conv2d(second, outputs, 3, padding=1)

    def forward(self, state: State) -> Maps:
        seen = state.map[:, : self.exchange.out_features]
        x = seen + self.exchange(state.vector)[:, :, None, None]
        whole = [state.vector, seen.mean(dim=(2, 3))]
        told = None
        if self.config.poses:
            fused = state.map[:, self.exchange.out_features :]
            told = photometric.read(fused, self.config.stem)
            x = torch.cat([x, told.derived], dim=1)
            whole.append(told.lobe)
        vector = functional.selu(self.update(torch.cat(whole, dim=1)))
        x, vector = self.first(x, vector)
        x, _ = self.second(x, vector)
        out = self.last(functional.leaky_relu(x, LEAK)).float()
        out = functional.pixel_shuffle(out, self.config.stem)
        out = torch.tanh(out)
        if self.config.raw:
            guess = self._guess(seen, state.map, told)
            out = (out + guess) / (1 + out * guess)  # tanh(a + b) of tanh a and tanh b
        return _maps(out)

    def _guess(self, seen: Tensor, whole: Tensor, told: Reading | None) -> Tensor:
        """The output, (B, 9, H, W) in (-1, 1), for the maps of someone without a model.

        Slopes and diffuse are those of photometric stereo. Where the light is only guessed, the level of
        the diffuse is halfway, in log, between the brightest and darkest that the pixels ever were; so is
        all of it where the network takes no poses.
        """
        fine = 3 * self.config.stem**2
        brightest, negative = seen[:, -2 * fine : -fine], seen[:, -fine:]
        middle = functional.pixel_shuffle((brightest - negative) / 2, self.config.stem)
        slopes = torch.zeros_like(middle[:, :2])
        diffuse = log_decoding(middle)
        if told is not None:
            slopes, albedo = told.slopes, told.albedo
            known = whole[:, self.exchange.out_features, None, :1, :1] > 0.75
            level = (middle - albedo).mean(dim=(2, 3), keepdim=True)
            diffuse = torch.where(
                known, photometric.linear(albedo) / (1 - GUESSED_F0), log_decoding(albedo + level)
            )
        rest = torch.tensor([GUESSED_ROUGHNESS, *[GUESSED_F0] * 3], device=diffuse.device)
        rest = rest[None, :, None, None].expand(len(diffuse), 4, *diffuse.shape[2:])
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
