"""A device's lens, and where it was for each photo, from the frame's corners in all its photos.

Bundle adjustment: focal length, two radial terms and one pose a photo explain the corners, drawn to what
EXIF says and to what phones are like; so one photo is enough to begin with, and every other helps.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from scipy.optimize import least_squares

from turnlight.handheld.finding import Sighting
from turnlight.picture.pinhole import Lens, Matrix, Pose, distort, project, undistort

CORNER_PX_PER_LONGEST = 0.15 / 4032
"""How exact corners are, as a share of the picture's longer side."""
TYPICAL_FOCAL = 0.75
"""Of the longer side: a phone's main camera, 26 mm equivalent."""
FOCAL_SPREAD_GUESSED, FOCAL_SPREAD_TOLD = 0.2, 0.02
K1_SPREAD, K2_SPREAD = 0.1, 0.05


@dataclass(frozen=True)
class View:
    """One photo for the adjustment. focal_px: as EXIF has it."""

    seen: Sighting
    width_px: int
    height_px: int
    focal_px: float | None


def fit_lens(views: Sequence[View]) -> Lens:
    """The lens of one device from its photos, all of one size up to a quarter turn; order does not matter.

    Distances of corners from where they should be count linearly once they are large, so that a corner
    that is wrong does little.
    """
    longest = max(views[0].width_px, views[0].height_px)
    told = [v.focal_px for v in views if v.focal_px is not None]
    guess = float(np.median(told)) if told else TYPICAL_FOCAL * longest
    spread = FOCAL_SPREAD_TOLD if told else FOCAL_SPREAD_GUESSED
    start = [0.0, 0.0, 0.0]
    for view in views:
        rotation, translation = pose_of(view.seen, _lens(view, guess, 0.0, 0.0))
        start += [*np.asarray(cv2.Rodrigues(rotation)[0]).ravel(), *translation]
    sigma = CORNER_PX_PER_LONGEST * longest
    prior = np.array([spread, K1_SPREAD, K2_SPREAD])

    def residuals(x: Matrix) -> Matrix:
        return np.concatenate([x[:3] / prior, *(r / sigma for r, _ in _terms(views, guess, x))])

    def jacobian(x: Matrix) -> Matrix:
        rows = [np.hstack([np.diag(1 / prior), np.zeros((3, len(x) - 3))])]
        for number, (_, derivative) in enumerate(_terms(views, guess, x)):
            block = np.zeros((len(derivative), len(x)))
            block[:, :3] = derivative[:, :3]
            block[:, 3 + 6 * number : 9 + 6 * number] = derivative[:, 3:]
            rows.append(block / sigma)
        return np.concatenate(rows)

    found = least_squares(residuals, start, jacobian, loss="soft_l1", x_scale="jac", max_nfev=60).x
    return _lens(views[0], guess * float(np.exp(found[0])), float(found[1]), float(found[2]))


def lens_for(lens: Lens, width_px: int, height_px: int) -> Lens:
    """The same lens for a photo held the other way up."""
    matrix = lens.matrix.copy()
    matrix[:2, 2] = width_px / 2, height_px / 2
    return Lens(matrix, lens.distortion)


def pose_of(seen: Sighting, lens: Lens) -> Pose:
    """The frame's pose, to the camera's axes, mm."""
    flat = seen.known_mm.reshape(-1, 2)
    points = np.column_stack([flat, np.zeros(len(flat))])
    pixels = np.ascontiguousarray(undistort(lens, seen.corners_px).reshape(-1, 2))
    _, turn, shift = cv2.solvePnP(points, pixels, lens.matrix, None, flags=cv2.SOLVEPNP_IPPE)
    turn, shift = cv2.solvePnPRefineLM(points, pixels, lens.matrix, None, turn, shift)
    return np.asarray(cv2.Rodrigues(turn)[0], dtype=float), np.asarray(shift, dtype=float).ravel()


def plane_of(seen: Sighting, lens: Lens) -> Matrix:
    """(3, 3) from mm on the frame to ideal pixels, as the corners have it.

    Freer than a pose: it also takes up that the lens's centre is not the picture's.
    """
    pixels = undistort(lens, seen.corners_px).reshape(-1, 2)
    found, _ = cv2.findHomography(seen.known_mm.reshape(-1, 2), pixels, cv2.LMEDS)
    if found is None:
        found, _ = cv2.findHomography(seen.known_mm.reshape(-1, 2), pixels)
    start = np.asarray(found, dtype=float)
    miss = np.linalg.norm(project(start, seen.known_mm.reshape(-1, 2)) - pixels, axis=1)
    good = miss < max(4 * float(np.median(miss)), 1.0)
    best, _ = cv2.findHomography(seen.known_mm.reshape(-1, 2)[good], pixels[good])
    return start if best is None else np.asarray(best, dtype=float)


def residual_px(seen: Sighting, lens: Lens, plane: Matrix) -> float:
    """Root mean square distance of the corners from where the plane has them."""
    miss = distort(lens, project(plane, seen.known_mm)) - seen.corners_px
    return float(np.sqrt(np.mean(np.sum(miss**2, axis=-1))))


def _lens(view: View, focal: float, k1: float, k2: float) -> Lens:
    matrix = np.array([[focal, 0, view.width_px / 2], [0, focal, view.height_px / 2], [0, 0, 1.0]])
    return Lens(matrix, np.array([k1, k2, 0.0, 0.0, 0.0]))


def _terms(views: Sequence[View], guess: float, x: Matrix) -> list[tuple[Matrix, Matrix]]:
    """Residuals (2n,) in pixels of each view, and their derivatives (2n, 9): ln focal, k1, k2, pose."""
    terms: list[tuple[Matrix, Matrix]] = []
    for number, view in enumerate(views):
        focal = guess * float(np.exp(x[0]))
        lens = _lens(view, focal, float(x[1]), float(x[2]))
        turn, shift = x[3 + 6 * number : 6 + 6 * number], x[6 + 6 * number : 9 + 6 * number]
        flat = view.seen.known_mm.reshape(-1, 2)
        points = np.column_stack([flat, np.zeros(len(flat))])
        seen, jacobian = cv2.projectPoints(points, turn, shift, lens.matrix, lens.distortion)
        derivative = np.asarray(jacobian, dtype=float)
        by_focal = derivative[:, 6:8].sum(axis=1, keepdims=True) * focal
        wanted = np.hstack([by_focal, derivative[:, 10:12], derivative[:, :6]])
        terms.append(
            (
                (np.asarray(seen).reshape(-1, 2) - view.seen.corners_px.reshape(-1, 2)).ravel(),
                wanted,
            )
        )
    return terms
