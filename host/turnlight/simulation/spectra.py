"""Spectra behind the simulation of colour: white LEDs, a camera, and the chart's patches.

A LED is a blue pump and two phosphors, with parameters fitted to the CIE's illuminants LED-B3 (4100 K)
and LED-B4 (5100 K), which stand for typical lamps; what lies between is a mixture. Camera and patches
are measured ones; the file names its sources.
"""

from functools import cache
from importlib import resources

import numpy as np
import numpy.typing as npt

from turnlight.picture.chart import patch_reflectances

Spectrum = npt.NDArray[np.float64]
_WARM = (0.865, 448.1, 9.2, 0.633, 52.0, 87.6, 542.9, 0.372, 609.7)
_COOL = (0.930, 451.3, 11.3, 0.585, 37.4, 79.3, 548.6, 0.082, 595.0)
RED_PHOSPHOR_NM = 40.0


def led(warmth: float) -> Spectrum:
    """Radiance at the table's wavelengths; warmth 0 is about 5100 K, 1 about 4100 K."""
    return (1 - warmth) * _led(*_COOL) + warmth * _led(*_WARM)


def white_reading(light: Spectrum) -> Spectrum:
    """(3,) the camera's reading of perfect white, relative to green."""
    _, camera, _ = _table()
    reading = light @ camera
    result: Spectrum = reading / reading[1]
    return result


def patch_readings(light: Spectrum) -> Spectrum:
    """(24, 3) the camera's readings of the chart's patches, relative to perfect white."""
    _, camera, patches = _table()
    result: Spectrum = patches.T @ (light[:, None] * camera) / (light @ camera)
    return result


def to_srgb(light: Spectrum) -> Spectrum:
    """(3, 3) from the camera's white-balanced readings to linear sRGB, white to white: least squares
    over the patches, weighed by how well an eye sees them.
    """
    read, wanted = patch_readings(light), patch_reflectances()
    weight = wanted[:, 1:2] ** (-2 / 3)
    sides = (read[:, :2] - read[:, 2:]) * weight
    first_two = np.linalg.lstsq(sides, (wanted - read[:, 2:]) * weight, rcond=None)[0].T
    return np.column_stack([first_two, 1 - first_two.sum(axis=1)])


def _led(
    pump: float, pump_nm: float, pump_width: float,
    green: float, left: float, right: float, green_nm: float,
    red: float, red_nm: float,
) -> Spectrum:  # fmt: skip
    nm, _, _ = _table()
    slope = np.where(nm < green_nm, left, right)
    return np.asarray(
        pump * np.exp(-0.5 * ((nm - pump_nm) / pump_width) ** 2)
        + green * np.exp(-0.5 * ((nm - green_nm) / slope) ** 2)
        + red * np.exp(-0.5 * ((nm - red_nm) / RED_PHOSPHOR_NM) ** 2)
    )


@cache
def _table() -> tuple[Spectrum, Spectrum, Spectrum]:
    """Wavelengths (n,) in nm, the camera's sensitivities (n, 3), the patches' reflectances (n, 24)."""
    text = (resources.files("turnlight") / "simulation/spectra.csv").read_text()
    rows = np.genfromtxt(text.splitlines()[3:], delimiter=",")
    return rows[:, 0], rows[:, 1:4], rows[:, 4:]
