"""Calibration targets on the simulated platter: a leaning board, a glossy ball, a white board, a chart."""

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from svbrdf.maps import Maps, flat
from svbrdf.renderer import pixel_positions, shade
from turnlight.picture.chart import patch_numbers
from turnlight.picture.charuco import board_side_mm, draw_board
from turnlight.picture.pinhole import Pose, distort, lens, project, undistort
from turnlight.picture.warp import Image, dense
from turnlight.simulation import spectra
from turnlight.simulation.light import Light, Stage
from turnlight.simulation.paint import paint

PAPER, INK = 0.8, 0.04
BOARD_PIXELS_PER_SQUARE = 96
LIGHT_GRID = 32
BALL_SAMPLES = 3
"""Per pixel and axis."""
CHART_RESOLUTION = 512
CHART_FRAME, CHART_BESIDE = 0.03, 0.6


@dataclass(frozen=True)
class Nothing:
    """The bare platter."""

    hides_mm: float = 0.0

    def paint(self, *_: object) -> None:
        pass


@dataclass(frozen=True)
class LeaningBoard:
    """The ChArUco board, its lower edge on the platter, leaning back by lean_deg."""

    square_mm: float
    lean_deg: float = 25.0
    turn_deg: float = 7.0
    foot_mm: float = -38.0
    hides_mm: float = 0.0

    def paint(self, image: Image, stage: Stage) -> None:
        side = board_side_mm(self.square_mm)
        to_platter, centre = self.pose()
        points = pixel_positions(np, LIGHT_GRID, LIGHT_GRID, dtype=np.float32) * (side / 2)
        points = (points @ to_platter.T + centre).astype(np.float32)
        light = np.full((*points.shape[:2], 3), stage.ambient, np.float32)
        for source in stage.lights:
            toward, reading = source.at(points)
            light += np.maximum(toward @ to_platter[:, 2], 0)[..., None] * reading
        paper = draw_board(BOARD_PIXELS_PER_SQUARE)
        fine = cv2.resize(light, paper.shape[::-1], interpolation=cv2.INTER_LINEAR)
        radiance = np.asarray((INK + (PAPER - INK) * paper)[..., None] * fine, np.float32)
        rotation, translation = stage.pose
        board = rotation @ to_platter, rotation @ centre + translation
        paint(image, radiance, side, stage.config, board)

    def pose(self) -> Pose:
        """From the board's axes (x right, y up on it) about its centre to the platter's."""
        lean = cv2.Rodrigues(np.array([np.radians(self.lean_deg), 0.0, 0.0]))[0]
        turn = cv2.Rodrigues(np.array([0.0, 0.0, np.radians(self.turn_deg)]))[0]
        rotation = np.asarray(turn @ lean, dtype=float)
        foot = turn @ [0.0, self.foot_mm, 0.5]
        return rotation, foot + rotation[:, 1] * board_side_mm(self.square_mm) / 2


@dataclass(frozen=True)
class GlossyBall:
    """A dark, glossy ball that lies on the platter."""

    diameter_mm: float
    place_mm: tuple[float, float]
    hides_mm: float = 0.0

    def paint(self, image: Image, stage: Stage) -> None:
        radius = self.diameter_mm / 2
        centre = np.array([*self.place_mm, radius])
        eye = stage.camera_mm.astype(float)
        rotation, translation = stage.pose
        rig_lens = lens(stage.config)
        depth = float(rotation[2] @ centre + translation[2])
        middle = distort(rig_lens, project(rig_lens.matrix, _flat(rotation @ centre + translation)))
        reach = 1.3 * radius * rig_lens.matrix[0, 0] / depth
        limit = np.array([image.shape[1], image.shape[0]])
        left, top = np.clip(np.floor(middle - reach), 0, limit).astype(int)
        right, bottom = np.clip(np.ceil(middle + reach), 0, limit).astype(int)
        width, height = int(right - left), int(bottom - top)

        def rays(points: Image) -> Image:
            ideal = undistort(rig_lens, np.add(points / BALL_SAMPLES, [left, top]))
            straight = (ideal - rig_lens.matrix[:2, 2]) / rig_lens.matrix[[0, 1], [0, 1]]
            return np.asarray(straight, np.float32)

        ray = dense(rays, width * BALL_SAMPLES, height * BALL_SAMPLES)
        ahead = np.concatenate([ray, np.ones_like(ray[..., :1])], axis=-1) @ rotation
        ahead /= np.linalg.norm(ahead, axis=-1, keepdims=True)
        offset = eye - centre
        along = ahead @ offset
        inside = along**2 - (offset @ offset - radius**2)
        hit = inside > 0
        points = eye + (-along - np.sqrt(np.maximum(inside, 0)))[..., None] * ahead
        normal = ((points - centre) / radius).astype(np.float32)
        seen = self._shade(normal, points.astype(np.float32), eye.astype(np.float32), stage.lights)
        covered = hit[..., None].astype(np.float32)
        size = (width, height)
        share = cv2.resize(covered, size, interpolation=cv2.INTER_AREA)[..., None]
        light = cv2.resize(seen * covered, size, interpolation=cv2.INTER_AREA)
        under = image[top:bottom, left:right]
        under *= 1 - share
        under += light

    def _shade(self, normal: Image, points: Image, eye: Image, lights: list[Light]) -> Image:
        height, width = normal.shape[:2]
        maps = flat(height, width, albedo=0.01, roughness=0.2)
        maps = Maps(normal, maps.diffuse, maps.roughness, maps.specular)
        to_view = eye - points
        to_view /= np.linalg.norm(to_view, axis=-1, keepdims=True)
        seen = np.zeros((*normal.shape[:2], 3), np.float32)
        for light in lights:
            toward, reading = light.at(points)
            seen += shade(maps, toward, to_view, np.float32(np.pi) * reading)
        return seen


@dataclass(frozen=True)
class Chart:
    """The 24-patch chart, flat; warmth: of every LED of the rig, as `spectra.led` takes it."""

    thickness_mm: float
    warmth: Sequence[float]
    hides_mm: float

    def paint(self, image: Image, stage: Stage) -> None:
        side = stage.config.sample.side_mm
        numbers = patch_numbers(side, CHART_RESOLUTION)
        points = pixel_positions(np, LIGHT_GRID, LIGHT_GRID, dtype=np.float32) * (side / 2)
        points[..., 2] = self.thickness_mm
        radiance = np.full((*numbers.shape, 3), stage.ambient * CHART_BESIDE, np.float32)
        for source in stage.lights:
            toward, reading = source.at(points)
            light = np.maximum(toward[..., 2:], 0) * reading * np.ones(3, np.float32)
            fine = cv2.resize(light, numbers.shape, interpolation=cv2.INTER_LINEAR)
            patches = spectra.patch_readings(spectra.led(self.warmth[source.number]))
            others = np.array([[CHART_BESIDE] * 3, [CHART_FRAME] * 3])
            radiance += np.concatenate([patches, others])[numbers].astype(np.float32) * fine
        rotation, translation = stage.pose
        surface = rotation, translation + rotation[:, 2] * self.thickness_mm
        paint(image, radiance, side, stage.config, surface)


def white_board(reflectance: float) -> Maps:
    """Matte white, as a sample."""
    maps = flat(LIGHT_GRID, LIGHT_GRID, albedo=reflectance, roughness=1.0)
    return Maps(maps.normal, maps.diffuse, maps.roughness, maps.specular * 0)


def _flat(point: Image) -> Image:
    result: Image = point[:2] / point[2]
    return result
