"""The simulated optics: what reaches the sensor from what lies, lit, on the platter.

Radiance is in readings: 1.0 is a white Lambertian patch at the reference sample's centre, facing a
LED of power 1, at 10 ms and gain 1. Limits: no cast shadows, no interreflection, no lens blur.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import cv2
import numpy as np

from svbrdf.maps import Maps
from svbrdf.renderer import pixel_positions
from turnlight.config import RigConfig
from turnlight.picture.radiometry import vignetting
from turnlight.picture.warp import Image, dense
from turnlight.simulation.light import Light, Stage, stage_of
from turnlight.simulation.paint import paint
from turnlight.simulation.platter import platter_albedo
from turnlight.simulation.sample import FlatSample

PLATTER_LIGHT_GRID = 64


class Subject(Protocol):
    """What lies on the platter, and turns with it."""

    @property
    def hides_mm(self) -> float:
        """Side of the square of the platter that cannot be seen for it."""

    def paint(self, image: Image, stage: Stage) -> None:
        """Lay it over (h, w, 3) radiance."""


@dataclass(frozen=True)
class Scene:
    """A subject on the rig, and what of it does not change between shots.

    albedo: the platter's, from `platter_albedo`; ambient: reading of white with every LED off.
    """

    config: RigConfig
    subject: Subject
    albedo: Image
    ambient: float


def scene(config: RigConfig, material: Maps, thickness_mm: float, ambient: float = 0.02) -> Scene:
    """Put a sample on the rig. material: float32 numpy maps, taken as the whole square sample."""
    sample = FlatSample(material, thickness_mm, config.sample.side_mm)
    return scene_of(config, sample, ambient)


def scene_of(config: RigConfig, subject: Subject, ambient: float = 0.02) -> Scene:
    """Put anything on the rig."""
    return Scene(config, subject, platter_albedo(config, subject.hides_mm), ambient)


def sensor_radiance(scene: Scene, angle_deg: float, leds: Sequence[int]) -> Image:
    """(height, width, 3) linear readings at 10 ms, gain 1, with the table turned by angle_deg.

    leds: level 0 to 255 of every LED of the rig.
    """
    config = scene.config
    camera = config.camera
    image = np.zeros((camera.height_px, camera.width_px, 3), np.float32)
    stage = stage_of(config, angle_deg, leds, scene.ambient)
    platter = _platter_radiance(scene, stage.lights)
    paint(image, platter, 2 * config.platter.radius_mm, config, stage.pose)
    scene.subject.paint(image, stage)
    if any(config.geometry.lens.vignetting):
        places = dense(lambda points: points, camera.width_px, camera.height_px)
        image *= vignetting(config, places)
    return image


def _platter_radiance(scene: Scene, lights: list[Light]) -> Image:
    """(n, n[, 3]) of the matte platter; its light varies slowly and is worked out on a coarse grid."""
    radius = np.float32(scene.config.platter.radius_mm)
    points = pixel_positions(np, PLATTER_LIGHT_GRID, PLATTER_LIGHT_GRID, dtype=np.float32) * radius
    light = np.full((*points.shape[:2], 1), scene.ambient, np.float32)
    for source in lights:
        toward, reading = source.at(points)
        light = light + np.maximum(toward[..., 2:], 0) * reading
    fine = cv2.resize(light, scene.albedo.shape[::-1], interpolation=cv2.INTER_LINEAR)
    return scene.albedo.reshape(*scene.albedo.shape, *[1] * (fine.ndim - 2)) * fine
