"""The ChArUco board that the lens is measured with: drawing it and finding its corners."""

from dataclasses import dataclass

import cv2
import numpy as np
import numpy.typing as npt

from turnlight.picture.pinhole import Matrix
from turnlight.picture.warp import Image

SQUARES = 7
MARKER_SHARE = 0.75
MARGIN_SHARE = 0.3
"""White paper around the squares, in squares."""
DICTIONARY = cv2.aruco.DICT_5X5_50
SUBPIXEL_STEPS = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 40, 1e-3)
FEWEST_CORNERS = 8


@dataclass(frozen=True)
class Corners:
    """ids: (n,) numbers of the inner corners; corners_px: (n, 2) on the sensor, continuous."""

    ids: npt.NDArray[np.int64]
    corners_px: Matrix


def board_side_mm(square_mm: float) -> float:
    """Side of the paper."""
    return (SQUARES + 2 * MARGIN_SHARE) * square_mm


def corner_positions_mm(square_mm: float) -> Matrix:
    """(corners, 2) of every inner corner from the board's centre, y up, by number."""
    inner = np.asarray(_board().getChessboardCorners())[:, :2]
    return np.asarray((inner - SQUARES / 2) * [1, -1] * square_mm, dtype=float)


def draw_board(pixels_per_square: int) -> Image:
    """(n, n) of the board's paper: 1 white, 0 ink; row 0 is at +y."""
    margin = round(MARGIN_SHARE * pixels_per_square)
    side = SQUARES * pixels_per_square + 2 * margin
    drawn = _board().generateImage((side, side), None, margin, 1)
    return np.asarray(np.divide(drawn, 255), np.float32)


def find_corners(green: Image) -> Corners:
    """Find the board's inner corners in the linear green channel (h, w); none if it is not there."""
    bright = max(float(np.percentile(green, 99)), 1e-6)
    coded = (np.sqrt(np.clip(green / bright, 0, 1)) * 255).astype(np.uint8)
    parameters = cv2.aruco.DetectorParameters()
    parameters.cornerRefinementMethod = cv2.aruco.CORNER_REFINE_SUBPIX
    detector = cv2.aruco.CharucoDetector(_board(), cv2.aruco.CharucoParameters(), parameters)
    corners, ids, _, _ = detector.detectBoard(coded)
    if ids is None or len(ids) < FEWEST_CORNERS:
        return Corners(np.empty(0, np.int64), np.empty((0, 2)))
    places = np.asarray(corners, np.float32).reshape(-1, 1, 2)
    reach = max(2, round(float(_spacing(places)) / 6))
    refined = cv2.cornerSubPix(green, places, (reach, reach), (-1, -1), SUBPIXEL_STEPS)
    numbers = np.asarray(ids, np.int64).ravel()
    return Corners(numbers, np.asarray(refined, dtype=float).reshape(-1, 2) + 0.5)


def _spacing(places: npt.NDArray[np.float32]) -> float:
    """Least distance of neighbouring corners."""
    points = places.reshape(-1, 2)
    apart = np.linalg.norm(points[:, None] - points[None], axis=-1)
    return float(apart[apart > 0].min())


def _board() -> cv2.aruco.CharucoBoard:
    dictionary = cv2.aruco.getPredefinedDictionary(DICTIONARY)
    return cv2.aruco.CharucoBoard((SQUARES, SQUARES), 1.0, MARKER_SHARE, dictionary)
