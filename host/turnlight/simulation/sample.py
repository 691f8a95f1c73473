"""A flat sample on the simulated platter."""

from dataclasses import dataclass

import numpy as np

from svbrdf.maps import Maps
from svbrdf.renderer import pixel_positions, shade
from turnlight.config import RigConfig
from turnlight.picture.pinhole import Pose
from turnlight.picture.warp import Image
from turnlight.simulation.light import Light, in_platter_mm
from turnlight.simulation.paint import paint

STRIP_ROWS = 64


@dataclass(frozen=True)
class FlatSample:
    """material: float32 numpy maps, taken as the whole square sample."""

    material: Maps
    thickness_mm: float
    hides_mm: float
    """Side of the square of the platter that cannot be seen for it."""

    def paint(
        self,
        image: Image,
        config: RigConfig,
        pose: Pose,
        angle_deg: float,
        lights: list[Light],
        ambient: float,
    ) -> None:
        rotation, translation = pose
        surface = rotation, translation + rotation[:, 2] * self.thickness_mm
        radiance = self.radiance(config, angle_deg, lights, ambient)
        paint(image, radiance, config.sample.side_mm, config, surface)

    def radiance(
        self, config: RigConfig, angle_deg: float, lights: list[Light], ambient: float
    ) -> Image:
        """(h, w, 3) toward the camera, on the material's own grid; strips keep it in the cache."""
        material = self.material
        half_side = np.float32(config.sample.side_mm / 2)
        points = pixel_positions(np, *material.resolution, dtype=np.float32) * half_side
        points[..., 2] = self.thickness_mm
        camera_mm = in_platter_mm(config, config.camera_position_mm(0.0), angle_deg)
        result: Image = ambient * (material.diffuse * (1 - material.specular) + material.specular)
        for top in range(0, len(points), STRIP_ROWS):
            rows = slice(top, top + STRIP_ROWS)
            maps, here = material.map(lambda a, rows=rows: a[rows]), points[rows]
            to_view = camera_mm - here
            to_view /= np.sqrt(np.sum(to_view * to_view, axis=-1, keepdims=True))
            for light in lights:
                to_light, reading = light.at(here)
                result[rows] += shade(maps, to_light, to_view, np.float32(np.pi) * reading)
        return result
