"""Does a frame agree with the calibration? For the doctor, and for a look between captures."""

from dataclasses import dataclass
from datetime import datetime

import cv2
import numpy as np

from turnlight.config import RigConfig
from turnlight.errors import CalibrationError
from turnlight.frame import Exposure, Frame
from turnlight.picture.lighting import lighting
from turnlight.picture.pinhole import (
    Matrix,
    distort,
    lens,
    plane_homography,
    platter_pose,
    project,
)
from turnlight.picture.platter import locate
from turnlight.picture.radiometry import linear, vignetting

OLD_DAYS = 180
MOST_DEG, MOST_MM = 0.3, 2.0
MOST_LIGHT = 0.15
PATCH_MM = 4.0
PAPER_RESOLUTION = 64


@dataclass(frozen=True)
class CheckShot:
    """How far a frame is from what the calibration says.

    camera_deg, camera_mm: turn and shift of the camera against the table, whatever the table's angle;
    light: brightness of the platter's paper by the LED, relative to what it was.
    """

    camera_deg: float
    camera_mm: float
    light: float


def check(frame: Frame, config: RigConfig, led: int) -> CheckShot:
    """Compare a frame lit by one LED. Raises ImageError when the platter is not seen."""
    seen = locate(frame, config)
    rotation, translation = platter_pose(config, seen.angle_deg)
    turned, moved = seen.pose
    off = np.degrees(np.linalg.norm(cv2.Rodrigues(turned @ rotation.T)[0]))
    return CheckShot(
        camera_deg=float(off),
        camera_mm=float(np.linalg.norm(moved - translation)),
        light=paper_reflectance(frame, None, config, led) / max(config.geometry.paper, 1e-6),
    )


def judge(config: RigConfig, frame: Frame, led: int, now: datetime) -> str:
    """How old the calibration is and how well a frame lit by one LED agrees with it.

    Raises CalibrationError when it is too old or the frame disagrees, ImageError without platter.
    """
    seen = check(frame, config, led)
    if seen.camera_deg > MOST_DEG or seen.camera_mm > MOST_MM:
        raise CalibrationError(
            f"The camera stands {seen.camera_mm:.1f} mm and {seen.camera_deg:.2f} degrees from where "
            "it was calibrated; fasten it and run turnlight calibrate."
        )
    paper = config.geometry.paper
    if paper and abs(seen.light - 1) > MOST_LIGHT:
        raise CalibrationError(
            f"LED {led} gives {seen.light:.0%} of the light that it was calibrated with; wipe it and "
            "the platter, see that it warms up, or run turnlight calibrate --only white."
        )
    measured = config.geometry.measured.values()
    days = min(((now - step.date).days for step in measured), default=0)
    oldest = max(((now - step.date).days for step in measured), default=0)
    if oldest > OLD_DAYS:
        raise CalibrationError(
            f"The calibration, or a part of it, is {oldest} days old; run turnlight calibrate."
        )
    light = f", light {seen.light:.0%}" if paper else ""
    return (
        f"{days} days old; the camera is seen {seen.camera_mm:.1f} mm and {seen.camera_deg:.2f} "
        f"degrees from its place{light}"
    )


def paper_reflectance(frame: Frame, dark: Frame | None, config: RigConfig, led: int) -> float:
    """Median over places between the platter's markers, of the frame lit by one LED.

    Without a dark frame, the calibrated dark level is taken off. Raises ImageError.
    """
    seen = locate(frame, config)
    places = _between_markers(config)
    to_ideal = plane_homography(config, seen.pose, 0.0)
    on_sensor = distort(lens(config), project(to_ideal, places))
    side = np.linalg.norm(
        project(to_ideal, np.add(places, [PATCH_MM / 2, 0])) - project(to_ideal, places), axis=-1
    )
    reach = max(1, int(side.min()))
    light = _patches(frame, on_sensor, reach)
    if dark is None:
        light -= config.geometry.dark.level[1]
    else:
        light -= _patches(dark, on_sensor, reach)
    light /= vignetting(config, on_sensor)[:, 0]
    ratio = light / _white_lying(config, led, seen.angle_deg, frame.exposure, places)
    return float(np.nanmedian(ratio))


def _between_markers(config: RigConfig) -> Matrix:
    """(8, 2) bare paper, in the platter's frame."""
    side = [(0.5, 1), (-0.5, 1), (0.5, -1), (-0.5, -1)]
    return np.array(side + [(y, x) for x, y in side]) * config.platter.marker_offset_mm


def _white_lying(
    config: RigConfig, led: int, angle_deg: float, exposure: Exposure, places: Matrix
) -> Matrix:
    """(n,) what white paper on the platter would read in green at these places."""
    wide = config.sample.model_copy(update={"side_mm": 2 * config.platter.radius_mm})
    platter = config.model_copy(update={"sample": wide})
    light = lighting(platter, (led,), angle_deg, exposure, 0.0, PAPER_RESOLUTION).lights[0]
    places = places / config.platter.radius_mm
    pixel = (np.stack([places[:, 0], -places[:, 1]]) + 1) / 2 * PAPER_RESOLUTION
    column, row = np.clip(pixel.astype(int), 0, PAPER_RESOLUTION - 1)
    toward = light.position - np.column_stack([places, np.zeros(len(places))])
    cosine = toward[:, 2] / np.linalg.norm(toward, axis=1)
    result: Matrix = light.white[row, column, 1] * cosine
    return result


def _patches(frame: Frame, places_px: Matrix, reach_px: int) -> Matrix:
    """(n,) mean linear green around places on the sensor; NaN outside of it."""
    height, width = frame.pixels.shape[:2]
    means = []
    for x, y in np.floor(places_px).astype(int):
        inside = reach_px <= x < width - reach_px and reach_px <= y < height - reach_px
        rows, columns = slice(y - reach_px, y + reach_px + 1), slice(x - reach_px, x + reach_px + 1)
        mean = linear(frame, frame.pixels[rows, columns, 1]).mean() if inside else np.nan
        means.append(float(mean))
    return np.array(means)
