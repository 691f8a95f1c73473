"""The rig's LEDs as point lights over the turned platter."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from turnlight.config import RigConfig, Vector
from turnlight.picture.pinhole import Pose, platter_pose
from turnlight.picture.warp import Image


@dataclass(frozen=True)
class Light:
    """One lit LED, in mm in the frame of the turned platter, z up from its top.

    origin_mm: the reference sample's centre on the axis; power: what white that faces the LED there
    reads in green; colour: (1,) or (3,), of the reading of white. The lobe is cos^exponent about the
    direction to aim_mm.
    """

    number: int
    position_mm: Image
    aim_mm: Image
    origin_mm: Image
    exponent: float
    power: np.float32
    colour: Image

    def at(self, points_mm: Image) -> tuple[Image, Image]:
        """Unit directions (..., 3) to the LED, and (..., 1 or 3) what white facing it there reads."""
        toward, reading = self.neutral_at(points_mm)
        return toward, reading * self.colour

    def neutral_at(self, points_mm: Image) -> tuple[Image, Image]:
        """As `at`, with (..., 1) the reading in green."""
        toward, distance, lobe = self._geometry(points_mm)
        _, reach, reference = self._geometry(self.origin_mm)
        return toward, self.power * (lobe / reference) * (reach / distance) ** 2

    def _geometry(self, points_mm: Image) -> tuple[Image, Image, Image]:
        offset = self.position_mm - points_mm
        distance = np.sqrt(np.sum(offset * offset, axis=-1, keepdims=True))
        toward = offset / distance
        axis = self.position_mm - self.aim_mm
        lobe = np.maximum(toward @ (axis / np.float32(np.linalg.norm(axis))), 0)[..., None]
        return toward, distance, lobe if self.exponent == 1 else lobe ** np.float32(self.exponent)


@dataclass(frozen=True)
class Stage:
    """What a subject on the platter is seen in.

    pose, angle_deg: the platter's; camera_mm: in its frame; ambient: reading of white by it alone.
    from_srgb: (3, 3) from linear sRGB under white light to what the camera reads, None if it reads that.
    """

    config: RigConfig
    angle_deg: float
    pose: Pose
    camera_mm: Image
    lights: list[Light]
    ambient: float
    from_srgb: Image | None

    def seen(self, radiance: Image) -> Image:
        """(..., 3) linear sRGB as the camera reads it."""
        return radiance if self.from_srgb is None else radiance @ self.from_srgb.T


def stage_of(config: RigConfig, angle_deg: float, leds: Sequence[int], ambient: float) -> Stage:
    """leds: level 0 to 255 of every LED of the rig."""
    colour = config.geometry.colour
    return Stage(
        config=config,
        angle_deg=angle_deg,
        pose=platter_pose(config, angle_deg),
        camera_mm=_in_platter_mm(config, config.camera_position_mm(0.0), angle_deg),
        lights=_lights(config, angle_deg, leds),
        ambient=ambient,
        from_srgb=None if colour is None else np.linalg.inv(colour.matrix).astype(np.float32),
    )


def _lights(config: RigConfig, angle_deg: float, leds: Sequence[int]) -> list[Light]:
    positions = _in_platter_mm(config, config.led_positions_mm(0.0), angle_deg)
    aims = _in_platter_mm(config, config.led_aims_mm(0.0), angle_deg)
    origin = _in_platter_mm(config, -config.lift_mm(0.0), angle_deg)
    colours = config.led_colours()
    if (colours == 1).all():
        colours = colours[:, :1]
    powers = config.led_powers() * np.array(leds) / 255
    return [
        Light(
            led,
            positions[led],
            aims[led],
            origin,
            float(config.led_exponents()[led]),
            np.float32(powers[led]),
            colours[led].astype(np.float32),
        )
        for led in np.flatnonzero(leds).tolist()
    ]


def _in_platter_mm(config: RigConfig, over_platter_mm: Vector, angle_deg: float) -> Image:
    """(..., 3) positions in the world of a sample of no thickness, in the turned platter's frame."""
    turned = config.to_sample_frame(over_platter_mm, angle_deg) * (config.sample.side_mm / 2)
    return np.asarray(turned, np.float32)
