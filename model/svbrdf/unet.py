"""The U-Net beside a global track, as published: Deschaintre et al., EGSR 2019, section 4.1."""

import torch
from torch import Tensor, nn
from torch.nn import functional

from svbrdf.network_config import NetworkConfig

LEAK = 0.2


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
