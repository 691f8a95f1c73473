"""A flat sample on the simulated platter."""

from dataclasses import dataclass

import numpy as np

from svbrdf.maps import Maps
from svbrdf.renderer import pixel_positions, shade
from turnlight.picture.warp import Image
from turnlight.simulation.light import Stage
from turnlight.simulation.paint import paint

STRIP_ROWS = 64


@dataclass(frozen=True)
class FlatSample:
    """material: float32 numpy maps, taken as the whole square sample."""

    material: Maps
    thickness_mm: float
    hides_mm: float
    """Side of the square of the platter that cannot be seen for it."""

    def paint(self, image: Image, stage: Stage) -> None:
        rotation, translation = stage.pose
        surface = rotation, translation + rotation[:, 2] * self.thickness_mm
        paint(image, self.radiance(stage), stage.config.sample.side_mm, stage.config, surface)

    def radiance(self, stage: Stage) -> Image:
        """(h, w, 3) toward the camera, on the material's own grid; strips keep it in the cache."""
        material = self.material
        half_side = np.float32(stage.config.sample.side_mm / 2)
        points = pixel_positions(np, *material.resolution, dtype=np.float32) * half_side
        points[..., 2] = self.thickness_mm
        white = material.diffuse * (1 - material.specular) + material.specular
        result: Image = stage.seen(stage.ambient * white)
        for top in range(0, len(points), STRIP_ROWS):
            rows = slice(top, top + STRIP_ROWS)
            maps, here = material.map(lambda a, rows=rows: a[rows]), points[rows]
            to_view = stage.camera_mm - here
            to_view /= np.sqrt(np.sum(to_view * to_view, axis=-1, keepdims=True))
            for light in stage.lights:
                to_light, reading = light.neutral_at(here)
                radiance = shade(maps, to_light, to_view, np.float32(np.pi) * reading)
                result[rows] += stage.seen(radiance) * light.colour
        return result
