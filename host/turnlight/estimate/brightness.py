"""How bright the diffuse map has to be for the maps to explain how bright the pictures are.

A network judges albedo by what it has been trained on; where the lights are known, the pictures say it.
"""

import math
from dataclasses import replace

import numpy as np

from svbrdf import materials, renderer
from svbrdf.maps import Maps
from turnlight.estimate.observations import scaled
from turnlight.picture.picture import Picture

SIDE = 32
_FEWEST = 2
"""One picture alone leaves open what of it is a highlight."""
_MOSTLY_MATTE, _LEAST, _ENOUGH = 0.3, 1e-3, 0.01
"""Where a picture counts: the specular part over the diffuse one, that one's radiance, and of how many pixels
this must be so. A black metal has some too, and they say nothing."""


class Brightness:
    """Remembers pictures of one sample, small; their order makes no difference."""

    def __init__(self) -> None:
        self._seen: list[Picture] = []
        self._all_lit = True

    def add(self, picture: Picture) -> None:
        """One without lighting says nothing, and then nothing is known of the others' maps either."""
        if picture.lighting is None:
            self._all_lit = False
        else:
            self._seen.append(scaled(picture, SIDE))

    def balanced(self, maps: Maps) -> Maps:
        """maps, with the diffuse one scaled as the middle picture asks; as they are if too few do."""
        small = materials.reduced(maps, SIDE, SIDE)
        ratios = [_ratio(small, picture) for picture in self._seen] if self._all_lit else []
        asked = [ratio for ratio in ratios if ratio is not None]
        if len(asked) < _FEWEST:
            return maps
        diffuse = np.clip(maps.diffuse * np.float32(np.median(asked)), 0, 1)
        return replace(maps, diffuse=diffuse)


def _ratio(maps: Maps, picture: Picture) -> float | None:
    """What is left of a picture without the maps' specular part, over their diffuse part."""
    assert picture.lighting is not None
    mirror = replace(maps, diffuse=np.zeros_like(maps.diffuse))
    whole, specular = (
        sum(
            renderer.render(m, light.position, picture.lighting.view, math.pi * light.white)
            for light in picture.lighting.lights
        )
        for m in (maps, mirror)
    )
    diffuse = whole - specular
    usable = (picture.valid & ~picture.clipped)[..., None]
    matte = usable & (diffuse > _LEAST) & (specular < _MOSTLY_MATTE * diffuse)
    if matte.mean() < _ENOUGH:
        return None
    return float((picture.image - specular)[matte].sum() / diffuse[matte].sum())
