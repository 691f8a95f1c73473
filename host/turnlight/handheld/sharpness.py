"""How sharp a photo is: at the frame's edges, and inside the sample."""

import cv2
import numpy as np

from turnlight.handheld.finding import Sighting
from turnlight.picture.pinhole import Matrix
from turnlight.picture.warp import Image

_POINTS, _SAMPLES = 24, 61
_REACH = 0.11
"""To either side of an edge, in marker sides: less than the border's width."""
_WIDTH_TO_SIGMA = 2.563
"""From 10 % to 90 % of a Gaussian's step."""
_DARKNESS = 0.02


def edge_blur(green: Image, seen: Sighting) -> float:
    """Standard deviation of the blur, as a share of the opening's side, in the direction of most.

    From how wide the steps at the markers' outlines are; a median over the markers for each direction.
    """
    corners = seen.corners_px
    following = np.roll(corners, -1, axis=1)
    along = following - corners
    length = np.linalg.norm(along, axis=-1, keepdims=True)
    outward = np.stack([along[..., 1], -along[..., 0]], axis=-1) / length
    reach = abs(np.sum(np.roll(along, 1, axis=1) * outward, axis=-1, keepdims=True)) * _REACH
    share = np.linspace(0.15, 0.85, _POINTS)
    across = np.linspace(-1, 1, _SAMPLES)
    base = corners[:, :, None] + along[:, :, None] * share[:, None]
    points = base[..., None, :] + (outward * reach)[:, :, None, None] * across[:, None]
    grid = (points - 0.5).reshape(-1, _SAMPLES, 2).astype(np.float32)
    light = cv2.remap(
        green, grid[..., 0], grid[..., 1], cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE
    )
    profiles = np.asarray(light, dtype=float).reshape(points.shape[:-1]).mean(axis=2)
    widths = np.array([[_width(p) for p in marker] for marker in profiles])
    sigma_mm = widths / _SAMPLES * 2 * _REACH * seen.frame.marker_mm / _WIDTH_TO_SIGMA
    by_direction = np.median(sigma_mm[:, :2] + sigma_mm[:, 2:], axis=0) / 2
    return float(by_direction.max() / seen.frame.side_mm)


def detail(image: Image) -> float:
    """Of a rectified picture (n, n, 3): energy of the finest detail over that of the next coarser.

    What materials differ in; of one sample's pictures, one that is much lower than the others is blurred.
    """
    value = np.log(np.maximum(image.mean(axis=-1), 0) + _DARKNESS * float(image.mean()) + 1e-6)
    first, second, third = (cv2.GaussianBlur(value, (0, 0), s) for s in (0.8, 1.6, 3.2))
    fine, coarse = float(np.var(first - second)), float(np.var(second - third))
    return fine / max(coarse, 1e-12)


def _width(profile: Matrix) -> float:
    """Samples between 10 % and 90 % of the step from ink, inside, to paper, outside."""
    ends = _SAMPLES // 8
    ink, paper = profile[:ends].mean(), profile[-ends:].mean()
    step = (profile - ink) / max(float(paper - ink), 1e-6)
    rising = np.maximum.accumulate(step)
    low, high = (float(np.interp(level, rising, np.arange(_SAMPLES))) for level in (0.1, 0.9))
    return high - low
