"""Where a photo shows the printed frame's markers."""

from collections import Counter
from dataclasses import dataclass

import cv2
import numpy as np
import numpy.typing as npt

from turnlight.handheld.plain import PlainFrame, find_opening
from turnlight.picture.marked_frame import MarkedFrame, dictionary, frame_of
from turnlight.picture.markers import refined
from turnlight.picture.pinhole import Matrix
from turnlight.picture.warp import Image

COARSE_PX = (1600, 3200)
"""Longer sides of the reduced pictures that markers are looked for in, one after the other."""
REFINEMENTS = 2
FEWEST_MARKERS = 4
OUTLIER_SHARE = 0.006
"""Of the picture's longer side: how far from one plane's homography corners lie that are wrong, and not
only bent by the lens."""
_BLUR_PX = 0.8
_PIXELS_PER_MODULE, _IGNORED_MARGIN = 8, 0.2
"""For reading a marker's bits: finer than OpenCV's default, which loses slanted ones."""


@dataclass(frozen=True)
class Sighting:
    """The frame in one photo. places: (n,) of the markers seen, ascending; corners_px: (n, 4, 2) on the
    photo, continuous, in the order of MarkedFrame.marker_corners_mm."""

    frame: MarkedFrame | PlainFrame
    places: npt.NDArray[np.int64]
    corners_px: Matrix

    @property
    def known_mm(self) -> Matrix:
        """(n, 4, 2) where those corners are on the frame."""
        return self.frame.marker_corners_mm()[self.places]


def find_frame(green: Image) -> Sighting | None:
    """Find the frame in a photo's linear green channel (h, w); None if too little of it is seen.

    Coarsely in reduced pictures, then each corner at full resolution. Where frames of two sizes are
    seen, the one of which more is.
    """
    best: Sighting | None = None
    for longest in COARSE_PX:
        found = _coarse(green, longest)
        if found is not None and (best is None or len(found.places) > len(best.places)):
            best = found
        if best is not None and len(best.places) == len(best.frame.ids):
            break
        if longest >= max(green.shape):
            break
    if best is None:
        return None
    corners = best.corners_px
    for _ in range(REFINEMENTS):
        corners = refined(green, corners)
    return _agreeing(Sighting(best.frame, best.places, corners), OUTLIER_SHARE * max(green.shape))


def find_plain(pixels: Image, side_mm: int) -> Sighting | None:
    """The opening of a plain white frame in a photo (h, w, 3); None if its corners cannot be found."""
    corners = find_opening(pixels)
    if corners is None:
        return None
    return Sighting(PlainFrame(side_mm), np.zeros(1, np.int64), corners[None])


def _coarse(green: Image, longest: int) -> Sighting | None:
    shrink = min(1.0, longest / max(green.shape))
    size = max(1, round(green.shape[1] * shrink)), max(1, round(green.shape[0] * shrink))
    small = cv2.resize(green, size, interpolation=cv2.INTER_AREA)
    bright = max(float(np.percentile(small, 99)), 1e-6)
    coded = np.sqrt(np.clip(small / bright, 0, 1)) * 255
    coded = cv2.GaussianBlur(coded, (0, 0), _BLUR_PX).astype(np.uint8)
    parameters = cv2.aruco.DetectorParameters()
    parameters.perspectiveRemovePixelPerCell = _PIXELS_PER_MODULE
    parameters.perspectiveRemoveIgnoredMarginPerCell = _IGNORED_MARGIN
    found, numbers, _ = cv2.aruco.ArucoDetector(dictionary(), parameters).detectMarkers(coded)
    if not found:
        return None
    seen = [(*frame_of(int(n)), c[0]) for n, c in zip(np.ravel(numbers), found, strict=True)]
    [(frame, _)] = Counter(frame for frame, _, _ in seen).most_common(1)
    by_place = {place: corners for f, place, corners in seen if f == frame}
    places = np.array(sorted(by_place), np.int64)
    scale = np.array([green.shape[1] / size[0], green.shape[0] / size[1]])
    corners = (np.array([by_place[p] for p in places], dtype=float) + 0.5) * scale
    return _agreeing(Sighting(frame, places, corners), OUTLIER_SHARE * max(green.shape))


def _agreeing(seen: Sighting, tolerance_px: float) -> Sighting | None:
    """Without the markers that do not lie in the plane of the others."""
    if len(seen.places) < FEWEST_MARKERS or not np.isfinite(seen.corners_px).all():
        return None
    y_down = seen.known_mm.reshape(-1, 2) * [1, -1]  # USAC rejects homographies that mirror
    _, inliers = cv2.findHomography(
        y_down, seen.corners_px.reshape(-1, 2), cv2.USAC_MAGSAC, tolerance_px
    )
    if inliers is None:
        return None
    good = (inliers.reshape(-1, 4) > 0).all(axis=1)
    if good.sum() < FEWEST_MARKERS:
        return None
    return Sighting(seen.frame, seen.places[good], seen.corners_px[good])
