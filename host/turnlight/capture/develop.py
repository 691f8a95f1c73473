"""From a saved shot to the Picture that estimators see, the same for every use of it."""

from dataclasses import replace

import numpy as np

from turnlight.capture.session import SavedShot, Session
from turnlight.frame import Exposure, Frame
from turnlight.picture.lighting import lighting
from turnlight.picture.picture import Picture
from turnlight.picture.rectify import Ambient, Rectified, ambient, rectify

RESOLUTION = 256
"""Of the network."""


class Developer:
    """Develops a session's shots, one thread at a time. A dark frame is prepared once for all of them."""

    def __init__(self, session: Session, resolution: int = RESOLUTION) -> None:
        self._session = session
        self._config = session.manifest.config
        self._thickness_mm = session.manifest.thickness_mm
        self._resolution = resolution
        self._ambients: dict[str, Ambient | None] = {}
        """By the dark frame's file."""

    def develop(self, saved: SavedShot) -> Rectified:
        """Rectify a shot, merge its exposures if it has two, and say how it was lit.

        The result depends on the saved frames alone. Raises ImageError when the platter is not seen,
        SessionError when a dark frame cannot be read.
        """
        leds = saved.record.shot.leds
        seen = self._rectified(saved.frame, leds)
        picture = seen.picture
        if saved.short is not None:
            picture = merged(picture, self._rectified(saved.short, leds).picture)
        lit = lighting(
            self._config,
            leds,
            seen.measured_angle_deg % 360,
            saved.frame.exposure,
            self._thickness_mm,
            self._resolution,
        )
        return replace(seen, picture=replace(picture, lighting=lit))

    def without_leds(self, exposure: Exposure) -> Frame | Ambient | None:
        """The dark frame of this exposure, if there is one, prepared if it can be."""
        record = self._session.dark_record(exposure)
        if record is None:
            return None
        if record.image not in self._ambients:
            dark = self._session.dark_frame(record)
            self._ambients[record.image] = ambient(
                dark, self._config, self._thickness_mm, self._resolution
            )
        return self._ambients[record.image] or self._session.dark_frame(record)

    def _rectified(self, frame: Frame, leds: tuple[int, ...]) -> Rectified:
        dark = self.without_leds(frame.exposure)
        return rectify(frame, dark, self._config, self._thickness_mm, self._resolution, leds)


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
