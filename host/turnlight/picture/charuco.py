"""The ChArUco board that the lens is measured with: drawing it and finding its corners."""

from dataclasses import dataclass

import cv2
import numpy as np
import numpy.typing as npt

from turnlight.picture.pinhole import Matrix, project
from turnlight.picture.warp import Image, warp

SQUARES = 7
MARKER_SHARE = 0.75
MARGIN_SHARE = 0.3
"""White paper around the squares, in squares."""
DICTIONARY = cv2.aruco.DICT_5X5_50
SUBPIXEL_STEPS = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 40, 1e-3)
FEWEST_CORNERS = 8
FACING_PX = (24, 128)
"""Size of a square, at least and at most, in the view in which corners are refined."""
REACH_SHARE = 0.13
"""How far around a corner is looked, in squares: less than to the next marker's black."""


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
    numbers = np.asarray(ids, np.int64).ravel()
    coarse = np.asarray(corners, dtype=float).reshape(-1, 2) + 0.5
    return Corners(numbers, _refined(green, numbers, coarse))


def _refined(green: Image, ids: npt.NDArray[np.int64], coarse_px: Matrix) -> Matrix:
    """(n, 2) corners found anew in a view straight onto the board, where the squares are square."""
    spacing = _spacing(coarse_px)
    per_square = int(np.clip(round(spacing), *FACING_PX))
    facing = (np.asarray(_board().getChessboardCorners())[ids, :2]) * per_square
    found_plane, _ = cv2.findHomography(coarse_px, facing)
    if found_plane is None:
        return coarse_px
    straighten = np.asarray(found_plane, dtype=float)
    side = SQUARES * per_square
    straight = warp(green, straighten, side, side)
    reach = max(2, round(REACH_SHARE * per_square))
    start = (project(straighten, coarse_px) - 0.5).astype(np.float32).reshape(-1, 1, 2)
    found = cv2.cornerSubPix(straight, start, (reach, reach), (-1, -1), SUBPIXEL_STEPS)
    back = np.asarray(np.linalg.inv(straighten), dtype=float)
    return project(back, np.asarray(found, dtype=float).reshape(-1, 2) + 0.5)


def _spacing(points: Matrix) -> float:
    """Median distance of corners from their nearest neighbour."""
    apart = np.linalg.norm(points[:, None] - points[None], axis=-1)
    apart[np.diag_indices(len(points))] = np.inf
    return float(np.median(apart.min(axis=1)))


def _board() -> cv2.aruco.CharucoBoard:
    dictionary = cv2.aruco.getPredefinedDictionary(DICTIONARY)
    return cv2.aruco.CharucoBoard((SQUARES, SQUARES), 1.0, MARKER_SHARE, dictionary)
