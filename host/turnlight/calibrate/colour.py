"""Colour: the chart found, its patches read, and the matrix to linear sRGB, judged by patches left out."""

from dataclasses import dataclass

import cv2
import numpy as np

from turnlight.calibration import Colour, Triple, triple
from turnlight.errors import CalibrationError
from turnlight.picture.chart import PATCH_NAMES, patch_reflectances
from turnlight.picture.pinhole import Matrix
from turnlight.picture.warp import Image

CORE = 0.5
"""Share of a patch's width that is read."""
SRGB_TO_XYZ = np.array(
    [[0.4124564, 0.3575761, 0.1804375], [0.2126729, 0.7151522, 0.0721750], [0.0193339, 0.1191920, 0.9503041]]
)  # fmt: skip


@dataclass(frozen=True)
class Judged:
    """colour: the matrix with its score; delta_e00: (24,) of every patch, predicted without itself."""

    colour: Colour
    delta_e00: Matrix

    @property
    def worst(self) -> str:
        return PATCH_NAMES[int(self.delta_e00.argmax())].replace("_", " ")


def read_chart(reflectance: Image) -> Matrix:
    """(24, 3) mean of each patch, from an (n, n, 3) image in which white is 1.

    Raises CalibrationError when no chart is found.
    """
    coded = np.rint(np.clip(reflectance[..., ::-1], 0, 1) ** (1 / 2.2) * 255).astype(np.uint8)
    detector = cv2.mcc.CCheckerDetector.create()
    detector.setColorChartType(cv2.mcc.MCC24)
    if not detector.process(np.ascontiguousarray(coded), 1):
        raise CalibrationError(
            "The 24-patch chart was not found; lay it flat, wholly inside the sample's square, where "
            "nothing shines in it."
        )
    corners = np.asarray(detector.getBestColorChecker().getColorCharts(), dtype=float)
    patches = corners.reshape(len(PATCH_NAMES), 4, 2)
    return np.stack([_read(reflectance, patch) for patch in patches])


def fit_colour(readings: Matrix, reflectances: Matrix | None = None) -> Judged:
    """Fit the matrix to (24, 3) readings relative to white. reflectances: the chart's, linear sRGB."""
    wanted = patch_reflectances() if reflectances is None else reflectances
    matrix = _matrix(readings, wanted)
    others = [np.arange(len(readings)) != i for i in range(len(readings))]
    without = np.stack([_matrix(readings[other], wanted[other]) for other in others])
    predicted = np.einsum("pij,pj->pi", without, readings)
    delta = delta_e00(lab(predicted), lab(wanted))
    jackknife = np.sqrt((len(without) - 1) * np.mean((without - without.mean(axis=0)) ** 2, axis=0))
    colour = Colour(
        matrix=_rows(matrix),
        matrix_sigma=_rows(jackknife),
        delta_e00_mean=float(delta.mean()),
        delta_e00_max=float(delta.max()),
    )
    return Judged(colour, delta)


def lab(linear_srgb: Matrix) -> Matrix:
    """(..., 3) CIE L*a*b* under D65."""
    white = SRGB_TO_XYZ.sum(axis=1)
    relative = np.maximum(linear_srgb @ SRGB_TO_XYZ.T / white, 0)
    bent = np.where(
        relative > (6 / 29) ** 3, np.cbrt(relative), relative * (29 / 6) ** 2 / 3 + 4 / 29
    )
    x, y, z = np.moveaxis(bent, -1, 0)
    return np.stack([116 * y - 16, 500 * (x - y), 200 * (y - z)], axis=-1)


def delta_e00(first: Matrix, second: Matrix) -> Matrix:
    """(...,) CIEDE2000 between (..., 3) L*a*b* colours (Sharma et al., Color Res. Appl. 30, 2005)."""
    l1, a1, b1 = np.moveaxis(np.asarray(first, dtype=float), -1, 0)
    l2, a2, b2 = np.moveaxis(np.asarray(second, dtype=float), -1, 0)
    chroma = (np.hypot(a1, b1) + np.hypot(a2, b2)) / 2
    stretch = 1.5 - 0.5 * np.sqrt(chroma**7 / (chroma**7 + 25.0**7))
    c1, c2 = np.hypot(a1 * stretch, b1), np.hypot(a2 * stretch, b2)
    h1 = np.degrees(np.arctan2(b1, a1 * stretch)) % 360
    h2 = np.degrees(np.arctan2(b2, a2 * stretch)) % 360
    grey = c1 * c2 == 0
    turn = np.where(grey, 0, (h2 - h1 + 180) % 360 - 180)
    hue_step = 2 * np.sqrt(c1 * c2) * np.sin(np.radians(turn / 2))
    middle_l, middle_c = (l1 + l2) / 2, (c1 + c2) / 2
    hue = np.where(grey, h1 + h2, _mean_hue(h1, h2))
    t = (
        1
        - 0.17 * np.cos(np.radians(hue - 30))
        + 0.24 * np.cos(np.radians(2 * hue))
        + 0.32 * np.cos(np.radians(3 * hue + 6))
        - 0.20 * np.cos(np.radians(4 * hue - 63))
    )
    s_l = 1 + 0.015 * (middle_l - 50) ** 2 / np.sqrt(20 + (middle_l - 50) ** 2)
    s_c, s_h = 1 + 0.045 * middle_c, 1 + 0.015 * middle_c * t
    blue = 60 * np.exp(-(((hue - 275) / 25) ** 2))
    cross = -2 * np.sqrt(middle_c**7 / (middle_c**7 + 25.0**7)) * np.sin(np.radians(blue))
    d_l, d_c, d_h = (l2 - l1) / s_l, (c2 - c1) / s_c, hue_step / s_h
    result: Matrix = np.sqrt(np.maximum(d_l**2 + d_c**2 + d_h**2 + cross * d_c * d_h, 0))
    return result


def _matrix(readings: Matrix, wanted: Matrix) -> Matrix:
    """(3, 3) by cv2.ccm, least in CIEDE2000, its rows scaled so that white stays white."""
    shape = (len(readings), 1, 3)
    model = cv2.ccm.ColorCorrectionModel(
        np.ascontiguousarray(readings, dtype=float).reshape(shape),
        np.clip(wanted, 0, 1).reshape(shape),
        cv2.ccm.COLOR_SPACE_SRGBL,
    )
    model.setRGB(True)
    model.setColorSpace(cv2.ccm.COLOR_SPACE_SRGB)
    model.setLinearization(cv2.ccm.LINEARIZATION_IDENTITY)
    model.setDistance(cv2.ccm.DISTANCE_CIE2000)
    model.setSaturatedThreshold(0, 1.5)
    model.compute()
    matrix = np.asarray(model.getColorCorrectionMatrix(), dtype=float).T
    result: Matrix = matrix / matrix.sum(axis=1, keepdims=True)
    return result


def _read(image: Image, patch: Matrix) -> Matrix:
    """(3,) median over the core of a patch, given its corners."""
    centre = patch.mean(axis=0)
    core = centre + (patch - centre) * CORE
    mask = np.zeros(image.shape[:2], np.uint8)
    cv2.fillConvexPoly(mask, np.rint(core).astype(np.int32), 1)
    return np.asarray(np.median(image[mask > 0], axis=0), dtype=float)


def _mean_hue(h1: Matrix, h2: Matrix) -> Matrix:
    apart = np.abs(h1 - h2) > 180
    mean: Matrix = np.where(apart & (h1 + h2 < 360), (h1 + h2 + 360) / 2, (h1 + h2) / 2)
    return np.where(apart & (h1 + h2 >= 360), (h1 + h2 - 360) / 2, mean)


def _rows(matrix: Matrix) -> tuple[Triple, Triple, Triple]:
    return triple(matrix[0]), triple(matrix[1]), triple(matrix[2])
