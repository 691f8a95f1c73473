"""Which pictures are blurred: how much of the fine detail that the others promise each of them holds."""

import numpy as np
import numpy.typing as npt

from turnlight.estimate.observations import Array, Observations

Mask = npt.NDArray[np.bool_]
TILE = 12
"""Pixels along a side of the squares that are looked at."""
_ALONG = 4
"""Squares along a side of the sample."""
_WINDOW = 3
"""Detail is what differs from the mean of so many pixels each way."""
_LEAST_DETAIL = 0.01
"""Root mean square of the expected detail below which a picture cannot be judged."""
_FEWEST = 0.02
"""Share of the pixels that must tell."""
_SHARP, _ALIKE = 0.7, 0.25
"""A picture with less than these shares of the usual one's detail, wherever that is, and of detail where it
is expected, is blurred."""


def tiles(resolution: int) -> npt.NDArray[np.int64]:
    """(n TILE^2,) numbers of the pixels of n squares spread over the sample, one square after the other."""
    starts = np.linspace(0, resolution - TILE, _ALONG).astype(np.int64)
    inside = np.arange(TILE)
    rows = starts[:, None, None, None] + inside[:, None]
    return np.asarray(rows * resolution + starts[:, None, None] + inside).ravel()


def blurred(seen: Observations, expected: Array, usable: Mask) -> set[int]:
    """Shots that hold far less fine detail than the others. seen: of the pixels of `tiles`. expected
    (K, P, 3): each shot's logs as the other shots predict them; a fit to all may follow the blurred one.
    usable (K, P): pixels that tell.

    Either sign alone misleads: a mirror's highlights that are not quite in place are detail that is not
    where it is expected, and a picture in which few pixels shine has less than the fit makes of it.
    """
    held, alike = detail_held(seen, expected, usable)
    if not np.isfinite(held).any():
        return set()
    weak = held < _SHARP * np.nanmedian(held)
    unlike = alike < _ALIKE * np.nanmedian(alike)
    return {int(k) for k in np.flatnonzero(weak & unlike)}


def detail_held(seen: Observations, expected: Array, usable: Mask) -> tuple[Array, Array]:
    """Of each picture's fine detail, (K,) each: its root mean square over that of what is expected, and how
    much of it is what is expected (the slope of one on the other); NaN where that has none."""
    whole_windows = _around(usable.astype(np.float32)).min(axis=-1)
    there, meant = (_detail(logs.mean(axis=-1)) * whole_windows for logs in (seen.logs, expected))
    found, common, whole = (
        (a * b).sum(axis=(1, 2, 3)) for a, b in ((there, there), (there, meant), (meant, meant))
    )
    counted = whole_windows.sum(axis=(1, 2, 3))
    enough = (whole > _LEAST_DETAIL**2 * counted) & (counted > _FEWEST * whole_windows[0].size)
    some = np.maximum(whole, 1e-12)
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
