"""Base colour and metalness, the four numbers per pixel that many programs take for our six: lossy."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from svbrdf.maps import Maps
from svbrdf.materials import DIELECTRIC_F0

Array = npt.NDArray[np.float32]
_LUMINANCE = np.array([0.2126, 0.7152, 0.0722], np.float32)


@dataclass(frozen=True)
class BaseColour:
    """base: (H, W, 3) linear; metalness: (H, W, 1). diffuse = base (1 - m), F0 = 0.04 (1 - m) + base m."""

    base: Array
    metalness: Array

    @property
    def diffuse(self) -> Array:
        return self.base * (1 - self.metalness)

    @property
    def specular(self) -> Array:
        return DIELECTRIC_F0 * (1 - self.metalness) + self.base * self.metalness

    def error(self, maps: Maps) -> dict[str, float]:
        """What the conversion loses: root mean square error of both albedos."""
        return {
            "diffuse_rmse": _rms(self.diffuse - maps.diffuse),
            "specular_rmse": _rms(self.specular - maps.specular),
        }


def to_base_colour(maps: Maps) -> BaseColour:
    """Exact where the maps came from base colour and metalness, else the nearest base colour.

    The metalness is that which explains the luminances of both albedos exactly; it is 0 where F0 is below
    0.04. The base colour is then least squares per channel.
    """
    diffuse, specular = (a @ _LUMINANCE[:, None] for a in (maps.diffuse, maps.specular))
    linear = diffuse + specular - 2 * DIELECTRIC_F0
    excess = np.maximum(specular - DIELECTRIC_F0, 0)
    root = np.sqrt(linear**2 + 4 * DIELECTRIC_F0 * excess)
    metalness = np.clip(2 * excess / np.maximum(linear + root, 1e-6), 0, 1).astype(np.float32)
    rest = 1 - metalness
    tinted = maps.specular - DIELECTRIC_F0 * rest
    base = (maps.diffuse * rest + tinted * metalness) / (rest**2 + metalness**2)
    return BaseColour(np.clip(base, 0, 1).astype(np.float32), metalness)


def _rms(difference: Array) -> float:
    return float(np.sqrt(np.mean(np.square(difference, dtype=np.float64))))
