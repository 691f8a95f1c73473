"""The 24-patch colour chart: its layout and what its patches are."""

import numpy as np
import numpy.typing as npt

COLUMNS, ROWS = 6, 4
PITCH_MM = 15.0
PATCH_MM = 13.0
WIDTH_MM, HEIGHT_MM = 94.0, 64.0

_PATCHES = {
    "dark_skin": (0.1759, 0.0784, 0.0502),
    "light_skin": (0.5590, 0.3087, 0.2230),
    "blue_sky": (0.1133, 0.1992, 0.3363),
    "foliage": (0.0941, 0.1485, 0.0499),
    "blue_flower": (0.2358, 0.2258, 0.4441),
    "bluish_green": (0.1342, 0.5170, 0.4031),
    "orange": (0.7012, 0.1991, 0.0229),
    "purplish_blue": (0.0682, 0.1059, 0.3775),
    "moderate_red": (0.5577, 0.0905, 0.1218),
    "purple": (0.1071, 0.0444, 0.1469),
    "yellow_green": (0.3491, 0.5018, 0.0478),
    "orange_yellow": (0.7917, 0.3648, 0.0266),
    "blue": (0.0271, 0.0478, 0.3096),
    "green": (0.0603, 0.3055, 0.0607),
    "red": (0.4452, 0.0285, 0.0422),
    "yellow": (0.8521, 0.5794, 0.0106),
    "magenta": (0.5050, 0.0890, 0.2974),
    "cyan": (-0.0333, 0.2488, 0.3858),
    "white": (0.8872, 0.8885, 0.8755),
    "neutral_8": (0.5866, 0.5831, 0.5826),
    "neutral_6_5": (0.3583, 0.3581, 0.3591),
    "neutral_5": (0.2032, 0.2030, 0.2035),
    "neutral_3_5": (0.0911, 0.0929, 0.0943),
    "black": (0.0327, 0.0336, 0.0352),
}
PATCH_NAMES = tuple(_PATCHES)


def patch_reflectances() -> npt.NDArray[np.float64]:
    """(24, 3) linear sRGB of the patches under D65, row by row from the upper left.

    From the spectra that N. Ohta published (1997) and the CIE 1931 observer.
    """
    return np.array(list(_PATCHES.values()))


def patch_numbers(side_mm: float, resolution: int) -> npt.NDArray[np.int64]:
    """(n, n) which patch a square about the chart's centre shows: -1 for the frame, -2 beside it."""
    grid = ((np.arange(resolution) + 0.5) / resolution - 0.5) * side_mm
    column, in_column = _cells(grid, COLUMNS)
    row, in_row = _cells(grid, ROWS)
    numbers = row[:, None] * COLUMNS + column
    numbers = np.where(in_row[:, None] & in_column, numbers, -1)
    beside = (abs(grid) > HEIGHT_MM / 2)[:, None] | (abs(grid) > WIDTH_MM / 2)
    return np.where(beside, -2, numbers)


def patch_centres_mm() -> npt.NDArray[np.float64]:
    """(24, 2) x, y from the chart's centre, y up."""
    x = (np.arange(COLUMNS) - (COLUMNS - 1) / 2) * PITCH_MM
    y = ((ROWS - 1) / 2 - np.arange(ROWS)) * PITCH_MM
    return np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)


def _cells(
    grid_mm: npt.NDArray[np.float64], count: int
) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.bool_]]:
    position = grid_mm / PITCH_MM + count / 2
    cell = np.floor(position).astype(np.int64)
    inside = (cell >= 0) & (cell < count) & (abs(position - cell - 0.5) < PATCH_MM / PITCH_MM / 2)
    return cell, inside
