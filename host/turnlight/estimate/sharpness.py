"""Which pictures are blurred: how much of the fine detail that the fit expects each of them holds."""

import numpy as np
import numpy.typing as npt

from turnlight.estimate.map_kernel import SEEN
from turnlight.estimate.observations import Array, Observations, predicted

TILE = 12
"""Pixels along a side of the squares that are looked at."""
_ALONG = 4
"""Squares along a side of the sample."""
_WINDOW = 3
"""Detail is what differs from the mean of so many pixels each way."""
_LEAST_DETAIL = 0.01
"""Root mean square of the expected detail below which a picture cannot be judged."""
_SHARP = 0.5
"""A picture with less than this share of the usual one's detail is blurred."""


def tiles(resolution: int) -> npt.NDArray[np.int64]:
    """(n TILE^2,) numbers of the pixels of n squares spread over the sample, one square after the other."""
    starts = np.linspace(0, resolution - TILE, _ALONG).astype(np.int64)
    inside = np.arange(TILE)
    rows = starts[:, None, None, None] + inside[:, None]
    return np.asarray(rows * resolution + starts[:, None, None] + inside).ravel()


def blurred(seen: Observations, theta: Array) -> set[int]:
    """Shots that hold far less fine detail than the others. seen, theta: of the pixels of `tiles`."""
    held = detail_held(seen, theta)
    if not np.isfinite(held).any():
        return set()
    return {int(k) for k in np.flatnonzero(held < _SHARP * np.nanmedian(held))}


def detail_held(seen: Observations, theta: Array) -> Array:
    """(K,) root mean square of each picture's fine detail over that which theta predicts; NaN where that
    has none. Not their correlation, which is low too where a mirror's highlights are not quite in place.
    """
    usable = _around((seen.state == SEEN).astype(np.float32)).min(axis=-1)
    there, meant = (
        _detail(logs.mean(axis=-1)) * usable for logs in (seen.logs, predicted(seen, theta))
    )
    seen_energy, energy = ((detail**2).sum(axis=(1, 2, 3)) for detail in (there, meant))
    enough = energy > _LEAST_DETAIL**2 * usable.sum(axis=(1, 2, 3))
    return np.sqrt(np.where(enough, seen_energy / np.maximum(energy, 1e-12), np.nan))


def _detail(values: Array) -> Array:
    """(K, n, inner, inner): how much each pixel inside the tiles (K, P) differs from its surroundings."""
    around = _around(values)
    return np.asarray(around[..., _WINDOW**2 // 2] - around.mean(axis=-1), np.float32)


def _around(values: Array) -> Array:
    """(K, n, inner, inner, WINDOW^2): the surroundings of each pixel inside the tiles (K, P)."""
    planes = values.reshape(len(values), -1, TILE, TILE)
    windows = np.lib.stride_tricks.sliding_window_view(planes, (_WINDOW, _WINDOW), axis=(2, 3))
    return windows.reshape(*windows.shape[:-2], -1)
