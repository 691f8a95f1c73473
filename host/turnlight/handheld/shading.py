"""What the frame's white paper says of the light: where it is, how bright and of what colour it is, and
whether something shades it.

The paper is taken as Lambertian. A lamp over a plane gives power x height / distance^3; what of its lobe,
and of light from around, that leaves unexplained is a smooth factor.
"""

from dataclasses import dataclass
from enum import StrEnum

import numpy as np
from scipy.optimize import least_squares

from turnlight.handheld.unwarp import PaperLight
from turnlight.picture.pinhole import Matrix
from turnlight.picture.warp import Image

FEWEST_POINTS = 300
FLASH_RMS, LAMP_RMS, WORST_RMS = 0.07, 0.04, 0.12
"""In ln: how far the paper may be from what a flash, or another lamp, gives it."""
FLASH_ALLOWANCE = 0.03
SHADOW_LN = -0.14
SMOOTHING = 4.0
_TUKEY = 4.685
_POINTS = 1500
_STARTS_DEG = ((80, 0), *((e, a) for e in (35, 60) for a in range(0, 360, 60)))
_LOWEST_DEG = 15.0
_FARTHEST_SIDES = 12.0


class Source(StrEnum):
    """flash: beside the lens. lamp: elsewhere, found from the shading. unknown: neither explains it."""

    FLASH = "flash"
    LAMP = "lamp"
    UNKNOWN = "unknown"


@dataclass(frozen=True)
class Shading:
    """light_mm: (3,) of the light in the frame's coordinates, None where unknown. colour: (3,) of white
    paper, green being 1. power, log_factor: of `reading`; shadow: share of the paper that is
    darker than it should be; residual: spread of the rest, in ln.
    """

    source: Source
    light_mm: Matrix | None
    colour: Matrix
    power: float
    log_factor: Matrix
    shadow: float
    residual: float
    scale_mm: float

    def reading(self, points_mm: Matrix) -> Image:
        """(...) green reading of the paper at (..., 2), flat on the frame's plane."""
        smooth = _basis(points_mm / self.scale_mm) @ self.log_factor
        lamp = 1.0 if self.light_mm is None else _lamp(self.light_mm, points_mm)
        return np.asarray(self.power * lamp * np.exp(smooth), np.float32)


def find_lamp(paper: PaperLight, scale_mm: float) -> Matrix | None:
    """(3,) of the lamp that explains the paper's shading best, wherever it is; None if too little is seen.

    scale_mm: half the frame's side.
    """
    if len(paper.points_mm) < FEWEST_POINTS:
        return None
    points, readings = _thinned(paper)
    return _find_lamp(np.log(readings[:, 1]), points, scale_mm)


def read_shading(paper: PaperLight, flash_mm: Matrix, lamp_mm: Matrix, scale_mm: float) -> Shading:
    """Explain the paper by the phone's flash at flash_mm, else by the lamp that `find_lamp` has found, else
    by a smooth surface alone."""
    points, readings = _thinned(paper)
    colour = np.median(readings / readings[:, 1:2], axis=0)
    value = np.log(readings[:, 1])
    by_flash, by_lamp = (_miss(value, light, points) for light in (flash_mm, lamp_mm))
    if by_flash < max(FLASH_RMS, min(by_lamp + FLASH_ALLOWANCE, WORST_RMS)):
        source, light = Source.FLASH, flash_mm
    elif by_lamp < LAMP_RMS and _usable(lamp_mm, scale_mm):
        source, light = Source.LAMP, lamp_mm
    else:
        source, light = Source.UNKNOWN, None
    known = 0.0 if light is None else np.log(_lamp(light, points))
    rest = value - known
    level, factor = _smooth(rest, points / scale_mm)
    off = rest - level - _basis(points / scale_mm) @ factor
    return Shading(
        source, light, colour, float(np.exp(level)), factor,
        float(np.mean(off < SHADOW_LN)), _spread(off), scale_mm,
    )  # fmt: skip


def _thinned(paper: PaperLight) -> tuple[Matrix, Matrix]:
    step = max(1, len(paper.points_mm) // _POINTS)
    return paper.points_mm[::step], np.maximum(paper.readings[::step], 1e-5)


def _lamp(light_mm: Matrix, points_mm: Matrix) -> Matrix:
    """(...) what a lamp of power 1 gives a plane, for a lamp straight above at its distance: 1."""
    offset = points_mm - light_mm[:2]
    square = np.sum(offset**2, axis=-1) + light_mm[2] ** 2
    unit = float(light_mm @ light_mm)
    return np.asarray(light_mm[2] * unit / square**1.5)


def _miss(value: Matrix, light_mm: Matrix, points: Matrix) -> float:
    """Robust spread of ln reading about what a lamp there gives."""
    return _spread(value - np.log(_lamp(light_mm, points)))


def _spread(off: Matrix) -> float:
    return 1.4826 * float(np.median(abs(off - np.median(off))))


def _find_lamp(value: Matrix, points: Matrix, scale_mm: float) -> Matrix | None:
    """(3,) of the lamp that explains the shading best."""
    few = slice(None, None, 4)

    def off(x: Matrix) -> Matrix:
        place = np.array([x[0], x[1], np.exp(x[2])]) * scale_mm
        return (value[few] - x[3] - np.log(_lamp(place, points[few]))) / 0.02

    best, least = None, np.inf
    for elevation, azimuth in np.radians(_STARTS_DEG):
        flat = 3 * np.cos(elevation)
        start = [
            flat * np.cos(azimuth),
            flat * np.sin(azimuth),
            np.log(3 * np.sin(elevation)),
            value.mean(),
        ]
        found = least_squares(off, start, loss="soft_l1", max_nfev=30)
        if found.cost < least:
            best, least = found.x, found.cost
    return None if best is None else np.array([best[0], best[1], np.exp(best[2])]) * scale_mm


def _usable(lamp: Matrix, scale_mm: float) -> bool:
    far = float(np.linalg.norm(lamp))
    elevation = np.degrees(np.arcsin(lamp[2] / far))
    return bool(elevation > _LOWEST_DEG and far < _FARTHEST_SIDES * scale_mm)


def _basis(points: Matrix) -> Matrix:
    """(..., 5) linear and quadratic terms, zero at the middle."""
    x, y = points[..., 0], points[..., 1]
    return np.stack([x, y, x * x, x * y, y * y], axis=-1)


def _smooth(rest: Matrix, points: Matrix) -> tuple[float, Matrix]:
    """Level and (5,) coefficients of the surface nearest to most of the points, drawn to a level one.

    Tukey's weights, from above: a shadow makes dark, and nothing makes bright.
    """
    design = np.column_stack([np.ones(len(rest)), _basis(points)])
    ridge = np.diag([0, *[SMOOTHING] * 5])
    off = rest - np.percentile(rest, 65)
    solution: Matrix = np.zeros(6)
    for _ in range(12):
        spread = max(_spread(off), 0.01)
        weight = np.clip(1 - (off / (_TUKEY * spread)) ** 2, 0, None) ** 2
        normal = design.T @ (design * weight[:, None]) + ridge
        solution = np.linalg.solve(normal, design.T @ (weight * rest))
        off = rest - design @ solution
    return float(solution[0]), solution[1:]
