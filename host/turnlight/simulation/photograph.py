"""Photographs of a sample as the simulated rig takes them, without controller and session: for studies."""

from dataclasses import replace

import numpy as np

from svbrdf.maps import Maps
from turnlight.config import RigConfig
from turnlight.frame import Exposure, Frame
from turnlight.picture.lighting import REFERENCE_EXPOSURE_US, lighting
from turnlight.picture.picture import Picture
from turnlight.picture.rectify import rectify
from turnlight.simulation.camera import develop
from turnlight.simulation.optics import scene, sensor_radiance

SENSOR_SHARE = 0.9
"""Of full scale, what the brightest but MOST_CLIPPED of the sample's values are exposed for."""
MOST_CLIPPED = 0.005
STEPS_PER_OCTAVE = 2
LONGEST = 4
PICTURE_RESOLUTION = 512


class Photographer:
    """Takes a sample's pictures on the rig that `truth` describes; software knows only `config`."""

    def __init__(
        self, config: RigConfig, truth: RigConfig, material: Maps, thickness_mm: float, seed: int
    ) -> None:
        self._config = config
        self._truth = truth
        self._thickness_mm = thickness_mm
        self._scene = scene(truth, material, thickness_mm)
        self._random = np.random.Generator(np.random.SFC64(seed))
        self._darks: dict[Exposure, Frame] = {}

    def take(self, angle_deg: float, leds: tuple[int, ...]) -> Picture:
        """One picture, exposed for the sample, rectified, with what is believed of its light."""
        levels = [255 * (led in leds) for led in range(self._truth.led_count)]
        radiance = sensor_radiance(self._scene, angle_deg, levels)
        exposure = self._exposure(radiance)
        if exposure not in self._darks:
            nothing = sensor_radiance(self._scene, angle_deg, [0] * len(levels))
            self._darks[exposure] = self._frame(nothing, exposure)
        frame = self._frame(radiance, exposure)
        seen = rectify(
            frame, self._darks[exposure], self._config, self._thickness_mm, PICTURE_RESOLUTION, leds
        )
        lit = lighting(
            self._config, leds, seen.measured_angle_deg % 360, exposure, self._thickness_mm,
            PICTURE_RESOLUTION,
        )  # fmt: skip
        return replace(seen.picture, lighting=lit)

    def _exposure(self, radiance: np.ndarray) -> Exposure:
        """In steps of half a stop, so that few of the sample's values clip."""
        camera = self._config.camera
        height, width = radiance.shape[:2]
        middle = radiance[height // 4 : -height // 4 : 4, width // 4 : -width // 4 : 4].max(axis=-1)
        bright = float(np.quantile(middle, 1 - MOST_CLIPPED))
        stops = np.log2(SENSOR_SHARE / max(bright * camera.gain, 1e-6)) * STEPS_PER_OCTAVE
        steps = min(np.floor(stops), STEPS_PER_OCTAVE * np.log2(LONGEST))
        exact_us = REFERENCE_EXPOSURE_US * 2 ** (steps / STEPS_PER_OCTAVE)
        return Exposure(max(100, int(exact_us / 100) * 100), camera.gain)

    def _frame(self, radiance: np.ndarray, exposure: Exposure) -> Frame:
        camera = self._truth.camera
        pixels = develop(radiance, camera, exposure, self._random)
        return Frame(pixels, camera.bit_depth, camera.gamma, exposure, 0)
