"""The shapes of networks: the published one, the one we train to ship, and the paper's baseline."""

from dataclasses import dataclass, replace


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
