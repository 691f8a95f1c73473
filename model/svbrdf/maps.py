"""The four maps of a spatially varying BRDF."""

from dataclasses import dataclass, fields
from typing import Any

import numpy as np


@dataclass(frozen=True)
class Maps:
    """Maps of a flat sample, as numpy or torch arrays of equal leading shape (..., H, W).

    Row 0 is the top (+y) of the sample, which is the square [-1, 1]^2 at z = 0.
    """

    normal: Any
    """(..., H, W, 3) unit vectors, x right, y up, z toward the viewer."""
    diffuse: Any
    """(..., H, W, 3) linear RGB albedo in [0, 1]."""
    roughness: Any
    """(..., H, W, 1) in [0, 1]; GGX alpha is its square."""
    specular: Any
    """(..., H, W, 3) linear RGB reflectance at normal incidence (F0) in [0, 1]."""

    def map(self, function: Any) -> "Maps":
        """The same function applied to each of the four arrays."""
        return Maps(*(function(getattr(self, field.name)) for field in fields(self)))

    @property
    def resolution(self) -> tuple[int, int]:
        height, width = self.normal.shape[-3:-1]
        return int(height), int(width)


def flat(height: int, width: int, albedo: float = 0.5, roughness: float = 0.5) -> Maps:
    """Uniform float32 numpy maps of a dielectric with a flat normal and F0 0.04."""
    return Maps(
        normal=np.broadcast_to(np.array([0, 0, 1], np.float32), (height, width, 3)).copy(),
        diffuse=np.full((height, width, 3), albedo, np.float32),
        roughness=np.full((height, width, 1), roughness, np.float32),
        specular=np.full((height, width, 3), 0.04, np.float32),
    )
