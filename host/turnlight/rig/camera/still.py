"""A still from a camera that streams all the time, and whether it is the one that was asked for.

A streaming camera applies what it is told some frames late, and its queues hold frames of before. So
nothing is believed but what each frame says of itself.
"""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

LINE_US, EXPOSURE_SHARE = 40, 0.005
"""A sensor exposes for whole lines, so it misses what was asked by up to one of them."""
ISO_SHARE = 0.02
LONGEST_SHARE = 0.9
"""Of the time from one frame to the next."""
WHITE_BALANCE_K = 50


@dataclass(frozen=True)
class Settings:
    """What a camera is set to by hand, or says it was. None: this camera cannot be set."""

    exposure_us: int
    iso: int
    lens_position: int | None
    white_balance_k: int | None


@dataclass(frozen=True)
class Request:
    """One still, please. not_before_s, until_s: on this computer's monotonic clock."""

    settings: Settings
    not_before_s: float
    until_s: float


@dataclass(frozen=True)
class Still:
    """A frame as it came. started_s: when its first row's exposure began, on the monotonic clock.

    data: the packed pixels, `stride_bytes` a row.
    """

    settings: Settings
    started_s: float
    width_px: int
    height_px: int
    stride_bytes: int
    data: npt.NDArray[np.uint8]


@dataclass(frozen=True)
class CameraInfo:
    """What a connected camera says of itself.

    focal_px: (horizontal, vertical) from its own calibration, for its full resolution; None if it has
    none. frames_per_s: how fast it streams.
    """

    name: str
    usb_speed: str
    focal_px: tuple[float, float] | None
    frames_per_s: float

    @property
    def longest_us(self) -> float:
        """The longest exposure that leaves time to read the sensor."""
        return LONGEST_SHARE * 1e6 / self.frames_per_s


def objection(asked: Request, still: Still) -> str | None:
    """Why this is not the still that was asked for, to end a sentence with; None if it is."""
    if len(still.data) < still.stride_bytes * still.height_px:
        return "are torn"
    if still.started_s < asked.not_before_s:
        return "were begun before the light had settled"
    return _difference(asked.settings, still.settings)


def _difference(want: Settings, got: Settings) -> str | None:
    if abs(got.exposure_us - want.exposure_us) > max(LINE_US, EXPOSURE_SHARE * want.exposure_us):
        return f"are exposed for {got.exposure_us} us instead of {want.exposure_us}"
    if abs(got.iso - want.iso) > ISO_SHARE * want.iso:
        return f"are taken at ISO {got.iso} instead of {want.iso}"
    if want.lens_position not in (None, got.lens_position):
        return f"are focused at {got.lens_position} instead of {want.lens_position}"
    if want.white_balance_k is not None and (
        got.white_balance_k is None
        or abs(got.white_balance_k - want.white_balance_k) > WHITE_BALANCE_K
    ):
        return f"have a white balance of {got.white_balance_k} K instead of {want.white_balance_k}"
    return None
