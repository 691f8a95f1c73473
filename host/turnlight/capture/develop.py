"""From a saved shot to the Picture that estimators see, the same for every use of it."""

from dataclasses import replace

import numpy as np

from turnlight.capture.session import SavedShot
from turnlight.config import RigConfig
from turnlight.picture.lighting import lighting
from turnlight.picture.picture import Picture
from turnlight.picture.rectify import Rectified, rectify

RESOLUTION = 512


def develop(
    saved: SavedShot, config: RigConfig, thickness_mm: float, resolution: int = RESOLUTION
) -> Rectified:
    """Rectify a shot, merge its exposures if it has two, and say how it was lit.

    The result depends on the saved frames alone. Raises ImageError when the platter is not seen.
    """
    leds = saved.record.shot.leds
    seen = rectify(saved.frame, saved.dark, config, thickness_mm, resolution, leds)
    picture = seen.picture
    if saved.short is not None:
        short = rectify(saved.short, saved.short_dark, config, thickness_mm, resolution, leds)
        picture = merged(picture, short.picture)
    lit = lighting(
        config,
        leds,
        seen.measured_angle_deg % 360,
        saved.frame.exposure,
        thickness_mm,
        resolution,
    )
    return replace(seen, picture=replace(picture, lighting=lit))


def merged(longer: Picture, shorter: Picture) -> Picture:
    """Two exposures of the same view in the units of the longer, which may then read over 1.

    Linear: where the sensor clipped in the longer one, the shorter one speaks.
    """
    ratio = np.float32(shorter.gain / longer.gain)
    take_short = (longer.clipped & shorter.valid)[..., None]
    return replace(
        longer,
        image=np.where(take_short, shorter.image * ratio, longer.image),
        clipped=longer.clipped & (shorter.clipped | ~shorter.valid),
    )
