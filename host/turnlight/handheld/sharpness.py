"""How sharp a photo is: at the frame's edges, and inside the sample."""

from collections.abc import Sequence
from dataclasses import dataclass

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
_BANDS_PX = (0.8, 1.6, 3.2, 6.4)
_ALIKE = 0.3
"""Correlation of the coarser band from which on detail can be compared."""
_NOISELESS = 0.75
"""Of fine contrast, what is not noise: blurred photos have 0.3 to 0.6 of the others', sharp ones over 0.7."""


@dataclass(frozen=True)
class Blur:
    """Standard deviation in the direction of most: as a share of the opening's side, and in pixels."""

    share: float
    px: float


def edge_blur(green: Image, seen: Sighting) -> Blur:
    """How wide the steps at the markers' outlines are; a median over the markers for each direction."""
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
    sigma = widths / _SAMPLES * 2 / _WIDTH_TO_SIGMA
    per_side = _REACH * seen.frame.marker_mm / seen.frame.side_mm
    return Blur(_largest(sigma * per_side), _largest(sigma * reach[..., 0]))


@dataclass(frozen=True)
class Bands:
    """Two bands of a rectified picture's log brightness, (n, n) each."""

    fine: Image
    coarse: Image


def bands(image: Image) -> Bands:
    """Of a rectified picture (n, n, 3)."""
    value = np.log(np.maximum(image.mean(axis=-1), 0) + _DARKNESS * float(image.mean()) + 1e-6)
    a, b, c, d = (cv2.GaussianBlur(value, (0, 0), sigma) for sigma in _BANDS_PX)
    return Bands(np.asarray(a - b, np.float32), np.asarray(c - d, np.float32))


def detail(own: Bands, others: Sequence[Bands]) -> float | None:
    """How much of the fine detail that other pictures of the sample have, this one shows: 1 is as much.

    A regression of band on band, in which noise does not count; or, if that is more, the band's contrast
    with noise taken off, as light from another side turns the detail of relief around. Both relative to those
    of a coarser band, so that contrast does not count. None where the pictures have no detail in common.
    """
    shares = []
    for other in others:
        common = float(np.mean(own.coarse * other.coarse))
        if common > _ALIKE * max(float(own.coarse.std() * other.coarse.std()), 1e-9):
            gain = np.mean(own.fine * other.fine) / max(float(np.mean(other.fine**2)), 1e-12)
            shares.append(float(gain * np.mean(other.coarse**2) / common))
    if not shares:
        return None
    contrast = _fineness(own) / max(float(np.median([_fineness(b) for b in others])), 1e-6)
    return max(float(np.median(shares)), _NOISELESS * contrast)


def _fineness(of: Bands) -> float:
    return float(of.fine.std() / max(float(of.coarse.std()), 1e-9))


def _largest(by_edge: Matrix) -> float:
    """Of the two directions, from (n, 4) values at each marker's edges."""
    return float((np.median(by_edge[:, :2] + by_edge[:, 2:], axis=0) / 2).max())


def _width(profile: Matrix) -> float:
    """Samples between 10 % and 90 % of the step from ink, inside, to paper, outside."""
    ends = _SAMPLES // 8
    ink, paper = profile[:ends].mean(), profile[-ends:].mean()
    step = (profile - ink) / max(float(paper - ink), 1e-6)
    rising = np.maximum.accumulate(step)
    low, high = (float(np.interp(level, rising, np.arange(_SAMPLES))) for level in (0.1, 0.9))
    return high - low
