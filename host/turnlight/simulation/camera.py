"""A simulated camera: it sees the light and the table that the board's side channel reports."""

from typing import Protocol

import numpy as np
import numpy.typing as npt

from svbrdf.maps import Maps
from turnlight.config import CameraConfig, RigConfig
from turnlight.frame import Exposure, Frame
from turnlight.picture.warp import Image
from turnlight.simulation.optics import Subject, scene_of, sensor_radiance
from turnlight.simulation.sample import FlatSample

FULL_WELL_ELECTRONS = 10_000.0
"""Collected at reading 1.0 and gain 1."""
READ_NOISE_ELECTRONS = 3.0
STRIP_ROWS = 64


class PhysicalState(Protocol):
    """The light and the table as they are, whatever the host asked for."""

    @property
    def time_us(self) -> int: ...
    @property
    def angle_deg(self) -> float: ...
    @property
    def leds(self) -> tuple[int, ...]: ...


class SideChannel(Protocol):
    """The part of the simulated board that the camera needs."""

    def state(self) -> PhysicalState: ...
    def advance(self, ms: float) -> PhysicalState: ...


class SimulatedCamera:
    """A Camera that images `material` on the rig; noise repeats with the seed.

    config: of the rig as it is, which need not be what the software knows of it.
    """

    def __init__(
        self, config: RigConfig, material: Maps, thickness_mm: float, board: SideChannel, seed: int
    ) -> None:
        self._config = config
        self._camera = config.camera
        self._black = np.array(config.geometry.dark.level, np.float32)
        self._board = board
        self._random = np.random.Generator(np.random.SFC64(seed))
        self.place(FlatSample(material, thickness_mm, config.sample.side_mm))

    def place(self, subject: Subject) -> None:
        """Take what lies on the platter off, and put this there."""
        self._scene = scene_of(self._config, subject)

    def capture(self, exposure: Exposure) -> Frame:
        before = self._board.state()
        after = self._board.advance(exposure.exposure_us / 1000)
        radiance = sensor_radiance(self._scene, before.angle_deg, before.leds)
        if (after.angle_deg, after.leds) != (before.angle_deg, before.leds):
            radiance += sensor_radiance(self._scene, after.angle_deg, after.leds)
            radiance /= 2
        return Frame(
            pixels=develop(radiance, self._camera, exposure, self._random, self._black),
            bit_depth=self._camera.bit_depth,
            gamma=self._camera.gamma,
            exposure=exposure,
            started_us=before.time_us,
        )

    @property
    def description(self) -> str:
        return "simulated camera"

    def recover(self) -> None:
        pass

    def close(self) -> None:
        pass


def develop(
    radiance: Image,
    camera: CameraConfig,
    exposure: Exposure,
    random: np.random.Generator,
    black: Image | float = 0.0,
) -> npt.NDArray[np.uint16]:
    """(h, w, 3) pixels of linear readings at 10 ms, gain 1: expose, add noise, clip, encode.

    black: what the camera reads without light, as a share of full scale.
    """
    top = (1 << camera.bit_depth) - 1
    pixels = np.empty(radiance.shape, np.uint16)
    for start in range(0, len(radiance), STRIP_ROWS):
        rows = slice(start, start + STRIP_ROWS)
        electrons = radiance[rows] * (exposure.exposure_us / 10_000 * FULL_WELL_ELECTRONS)
        noise = random.standard_normal(electrons.shape, dtype=np.float32)
        electrons += noise * np.sqrt(electrons + READ_NOISE_ELECTRONS**2)
        signal = np.clip(electrons * (exposure.gain / FULL_WELL_ELECTRONS) + black, 0, 1)
        pixels[rows] = np.rint(signal ** (1 / camera.gamma) * top)
    return pixels
