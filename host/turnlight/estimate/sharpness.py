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
_SHARP, _ALIKE = 0.7, 0.4
"""A picture with less than these shares of the usual one's detail, wherever that is, and of detail where it
is expected, is blurred."""


def tiles(resolution: int) -> npt.NDArray[np.int64]:
    """(n TILE^2,) numbers of the pixels of n squares spread over the sample, one square after the other."""
    starts = np.linspace(0, resolution - TILE, _ALONG).astype(np.int64)
    inside = np.arange(TILE)
    rows = starts[:, None, None, None] + inside[:, None]
    return np.asarray(rows * resolution + starts[:, None, None] + inside).ravel()


def blurred(seen: Observations, theta: Array) -> set[int]:
    """Shots that hold far less fine detail than the others. seen, theta: of the pixels of `tiles`.

    Either sign alone misleads: a mirror's highlights that are not quite in place are detail that is not
    where it is expected, and a picture in which few pixels shine has less than the fit makes of it.
    """
    held, alike = detail_held(seen, theta)
    if not np.isfinite(held).any():
        return set()
    weak = held < _SHARP * np.nanmedian(held)
    unlike = alike < _ALIKE * np.nanmedian(alike)
    return {int(k) for k in np.flatnonzero(weak & unlike)}


def detail_held(seen: Observations, theta: Array) -> tuple[Array, Array]:
    """Of each picture's fine detail, (K,) each: its root mean square over that of what theta predicts, and
    how much of it is what theta predicts (the slope of one on the other); NaN where that has none."""
    usable = _around((seen.state == SEEN).astype(np.float32)).min(axis=-1)
    there, meant = (
        _detail(logs.mean(axis=-1)) * usable for logs in (seen.logs, predicted(seen, theta))
    )
    found, common, expected = (
        (a * b).sum(axis=(1, 2, 3)) for a, b in ((there, there), (there, meant), (meant, meant))
    )
    enough = expected > _LEAST_DETAIL**2 * usable.sum(axis=(1, 2, 3))
    some = np.maximum(expected, 1e-12)
    return (
        np.sqrt(np.where(enough, found / some, np.nan)),
        np.where(enough, common / some, np.nan),
    )


def _detail(values: Array) -> Array:
    """(K, n, inner, inner): how much each pixel inside the tiles (K, P) differs from its surroundings."""
    around = _around(values)
    return np.asarray(around[..., _WINDOW**2 // 2] - around.mean(axis=-1), np.float32)


def _around(values: Array) -> Array:
    """(K, n, inner, inner, WINDOW^2): the surroundings of each pixel inside the tiles (K, P)."""
    planes = values.reshape(len(values), -1, TILE, TILE)
    windows = np.lib.stride_tricks.sliding_window_view(planes, (_WINDOW, _WINDOW), axis=(2, 3))
    return windows.reshape(*windows.shape[:-2], -1)
