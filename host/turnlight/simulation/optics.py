"""The simulated optics: what reaches the sensor from a lit sample on its platter.

Radiance is in readings: 1.0 is a white Lambertian patch at the reference sample's centre, facing a
LED of power 1, at 10 ms and gain 1. Limits: no cast shadows, no interreflection, no lens blur or
distortion.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from svbrdf.maps import Maps
from svbrdf.renderer import pixel_positions, shade
from turnlight.config import RigConfig
from turnlight.picture.pinhole import (
    Matrix,
    grid_to_plane,
    plane_homography,
    platter_pose,
    project,
)
from turnlight.picture.warp import Image, warp
from turnlight.simulation.platter import platter_albedo

STRIP_ROWS = 64
PLATTER_LIGHT_GRID = 64


@dataclass(frozen=True)
class Scene:
    """A sample on the rig, and what of it does not change between shots.

    albedo: the platter's, from `platter_albedo`; ambient: reading of white with every LED off.
    """

    config: RigConfig
    material: Maps
    thickness_mm: float
    albedo: Image
    ambient: float


def scene(config: RigConfig, material: Maps, thickness_mm: float, ambient: float = 0.02) -> Scene:
    """Put a sample on the rig. material: float32 numpy maps, taken as the whole square sample."""
    return Scene(config, material, thickness_mm, platter_albedo(config), ambient)


def sensor_radiance(scene: Scene, angle_deg: float, leds: Sequence[int]) -> Image:
    """(height, width, 3) linear readings at 10 ms, gain 1, with the table turned by angle_deg.

    leds: level 0 to 255 of every LED of the rig.
    """
    camera = scene.config.camera
    image = np.zeros((camera.height_px, camera.width_px, 3), np.float32)
    pose = platter_pose(scene.config, angle_deg)
    lights = _lights(scene, angle_deg, leds)
    platter = _platter_radiance(scene, lights)
    to_pixels = plane_homography(camera, pose, 0.0)
    _paint(image, platter, 2 * scene.config.platter.radius_mm, to_pixels)
    to_pixels = plane_homography(camera, pose, scene.thickness_mm)
    _paint(
        image, _sample_radiance(scene, angle_deg, lights), scene.config.sample.side_mm, to_pixels
    )
    return image


@dataclass(frozen=True)
class _Light:
    """One lit LED in the turned sample's frame; reading: of white facing it at the target."""

    position_mm: Image
    target_mm: Image
    reading: float

    def at(self, points_mm: Image) -> tuple[Image, Image]:
        """Unit directions (..., 3) to the LED, and (..., 1) what white facing it there reads."""
        offset = self.position_mm - points_mm
        distance = np.sqrt(np.sum(offset * offset, axis=-1, keepdims=True))
        toward = offset / distance
        axis = self.position_mm - self.target_mm
        reach = np.float32(np.linalg.norm(axis))
        lobe = np.maximum(toward @ (axis / reach), 0)[..., None]
        return toward, self.reading * lobe * (reach / distance) ** 2


def _lights(scene: Scene, angle_deg: float, leds: Sequence[int]) -> list[_Light]:
    config = scene.config
    half_side = config.sample.side_mm / 2
    positions = config.to_sample_frame(config.led_positions_mm(scene.thickness_mm), angle_deg)
    target = -config.lift_mm(scene.thickness_mm).astype(np.float32)
    return [
        _Light((position * half_side).astype(np.float32), target, float(power) * level / 255)
        for position, power, level in zip(positions, config.led_powers(), leds, strict=True)
        if level > 0
    ]


def _sample_radiance(scene: Scene, angle_deg: float, lights: list[_Light]) -> Image:
    """(h, w, 3) toward the camera, on the material's own grid; strips keep it in the cache."""
    config, material = scene.config, scene.material
    half_side = np.float32(config.sample.side_mm / 2)
    points = pixel_positions(np, *material.resolution, dtype=np.float32) * half_side
    camera = config.to_sample_frame(config.camera_position_mm(scene.thickness_mm), angle_deg)
    camera_mm = camera.astype(np.float32) * half_side
    result: Image = scene.ambient * (material.diffuse * (1 - material.specular) + material.specular)
    for top in range(0, len(points), STRIP_ROWS):
        rows = slice(top, top + STRIP_ROWS)
        maps, here = material.map(lambda a, rows=rows: a[rows]), points[rows]
        to_view = camera_mm - here
        to_view /= np.sqrt(np.sum(to_view * to_view, axis=-1, keepdims=True))
        for light in lights:
            to_light, reading = light.at(here)
            result[rows] += shade(maps, to_light, to_view, np.float32(np.pi) * reading)
    return result


def _platter_radiance(scene: Scene, lights: list[_Light]) -> Image:
    """(n, n) of the matte platter; its light varies slowly and is worked out on a coarse grid."""
    radius = np.float32(scene.config.platter.radius_mm)
    points = pixel_positions(np, PLATTER_LIGHT_GRID, PLATTER_LIGHT_GRID, dtype=np.float32) * radius
    points[..., 2] = -scene.thickness_mm
    light = np.full(points.shape[:2], scene.ambient, np.float32)
    for source in lights:
        toward, reading = source.at(points)
        light += (np.maximum(toward[..., 2:], 0) * reading)[..., 0]
    fine = cv2.resize(light, scene.albedo.shape[::-1], interpolation=cv2.INTER_LINEAR)
    return scene.albedo * fine


def _paint(image: Image, radiance: Image, side_mm: float, to_pixels: Matrix) -> None:
    """Lay a square of the plane over the image, its edges anti-aliased."""
    corners = project(to_pixels, np.array([(-1, 1), (1, 1), (1, -1), (-1, -1)]) * side_mm / 2)
    limit = (image.shape[1], image.shape[0])
    left, top = np.clip(np.floor(corners.min(axis=0)), 0, limit).astype(int)
    right, bottom = np.clip(np.ceil(corners.max(axis=0)), 0, limit).astype(int)
    width, height = int(right - left), int(bottom - top)
    if width == 0 or height == 0:
        return
    rows, columns = radiance.shape[:2]
    to_unit = np.diag([1 / columns, 1 / rows, 1.0])
    shift = np.array([[1.0, 0.0, -left], [0.0, 1.0, -top], [0.0, 0.0, 1.0]])
    seen = warp(
        radiance, shift @ to_pixels @ grid_to_plane(side_mm, 1) @ to_unit, width, height
    ).reshape(height, width, -1)
    under = image[top:bottom, left:right]
    under += _coverage(corners - [left, top], width, height)[..., None] * (seen - under)


def _coverage(corners: Matrix, width: int, height: int) -> Image:
    """(height, width) share of each pixel inside a polygon, from the distance to its edges."""
    x = np.arange(width, dtype=np.float32) + 0.5
    y = np.arange(height, dtype=np.float32)[:, None] + 0.5
    inside = np.full((height, width), np.inf, np.float32)
    for start, end in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        along = (end - start) / np.linalg.norm(end - start)
        # y points down and the corners run clockwise on screen: the inside is on the right.
        across = np.float32(along[0]) * (y - np.float32(start[1]))
        np.minimum(inside, across - np.float32(along[1]) * (x - np.float32(start[0])), out=inside)
    return np.asarray(np.clip(inside + 0.5, 0, 1), np.float32)
