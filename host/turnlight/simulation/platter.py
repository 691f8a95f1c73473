"""The simulated platter: matte paper with the printed markers, dark where the sample covers it."""

import numpy as np

from turnlight.config import RigConfig
from turnlight.picture.markers import draw_platter
from turnlight.picture.warp import Image

PAPER_ALBEDO, INK_ALBEDO = 0.8, 0.04


def platter_albedo(config: RigConfig, hidden_mm: float) -> Image:
    """(n, n) grey albedo of the square around the disc, row 0 at +y, as fine as the camera sees it.

    Zero off the disc, and under a sample of side hidden_mm, whose dark sides the camera then sees.
    """
    camera, radius = config.camera, config.platter.radius_mm
    pixels_per_mm = camera.focal_px / (camera.distance_mm + radius)
    paper = draw_platter(config.platter, config.marker_corners_mm(), pixels_per_mm)
    size = len(paper)
    offset = np.abs(np.arange(size, dtype=np.float32) + 0.5 - size / 2) * (2 * radius / size)
    distance = np.hypot(offset[:, None], offset[None])
    disc = np.clip((radius - distance) * size / (2 * radius) + 0.5, 0, 1)
    bare = np.maximum(offset[:, None], offset[None]) >= hidden_mm / 2
    albedo = (INK_ALBEDO + (PAPER_ALBEDO - INK_ALBEDO) * paper) * disc * bare
    return np.asarray(albedo, np.float32)
