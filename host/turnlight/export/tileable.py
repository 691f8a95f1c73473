"""Maps whose edges meet.

A strip of the right (and then of the bottom) is laid over the left (the top), which it then continues,
and the two are joined: what is coarse fades over the whole strip, what is fine changes hands along the
path on which both differ least (Efros and Freeman 2001; two bands of Burt and Adelson 1983). The tile is
smaller than the sample by the strip, and everything in it is as large as it was. A tile may begin
anywhere, so it begins where its maps change least from one pixel to the next.
"""

from dataclasses import dataclass

import cv2
import numpy as np
import numpy.typing as npt

from svbrdf.maps import Maps

Array = npt.NDArray[np.float32]
NARROWEST, WIDEST = 0.1, 0.4
"""The strip's width as a share of the sample: the one in between that hides the join best."""
_SEARCH_PX = 128
_FEATHER_PX = 5
_WHOLE_STRIP = 0.2
"""How much it counts that the pictures agree in the whole strip, beside that they do along the join."""
_EPSILON = 1e-2


@dataclass(frozen=True)
class Seam:
    """How the seam shows, for the worst of the four maps; 1 is not at all.

    edge: mean gradient across the tile's edges, over that inside. path: mean gradient where two parts of
    the sample were joined, over that which they had there themselves.
    """

    edge: float
    path: float


def tileable(maps: Maps) -> tuple[Maps, Seam]:
    """A tile of the maps, and how well its seam is hidden."""
    stack = _to_stack(maps)
    stack, path_x = _joined(stack, closed=False)
    stack, path_y = _joined(np.swapaxes(stack, 0, 1), closed=True)
    tile = _to_maps(np.ascontiguousarray(np.swapaxes(stack, 0, 1)))
    row, column = (_calmest(tile, axis) for axis in (0, 1))
    tile = tile.map(lambda image: np.roll(image, (-row, -column), (0, 1)))
    return tile, Seam(max(edge_ratios(tile).values()), max(path_x, path_y))


def edge_ratios(maps: Maps) -> dict[str, float]:
    """For each map the mean gradient across its edges, wrapped around, over that inside."""
    return {
        name: max(_edge_ratio(image), _edge_ratio(np.swapaxes(image, 0, 1)))
        for name, image in _shown(maps).items()
    }


def _joined(image: Array, *, closed: bool) -> tuple[Array, float]:
    """(H, W - strip, C) whose left and right edges meet, and `Seam.path` of the join.

    closed: top and bottom already meet, and must still do so afterwards.
    """
    rows, columns = image.shape[:2]
    strip = _best_strip(image, closed)
    period = columns - strip
    left, right = image[:, :strip], image[:, period:]
    ours = _cut(_cost(left, right), closed)
    coarse = cv2.GaussianBlur(image, (0, 0), strip / 10, borderType=cv2.BORDER_REFLECT)
    if closed:
        tall = np.concatenate([image] * 3)
        coarse = cv2.GaussianBlur(tall, (0, 0), strip / 10, borderType=cv2.BORDER_REFLECT)
        coarse = coarse[rows : 2 * rows]
    fine = image - coarse
    fade = _smooth(np.linspace(0, 1, strip, dtype=np.float32))[None, :, None]
    across = np.arange(strip)[None, :] - ours[:, None] + 0.5
    switch = _smooth(np.clip(across / (2 * _FEATHER_PX) + 0.5, 0, 1).astype(np.float32))[..., None]
    joined = coarse[:, period:] * (1 - fade) + coarse[:, :strip] * fade
    joined += fine[:, period:] * (1 - switch) + fine[:, :strip] * switch
    ratio = _path_ratio(joined, left, right, np.abs(across) <= _FEATHER_PX + 1)
    return np.concatenate([joined, image[:, strip:period]], axis=1), ratio


def _best_strip(image: Array, closed: bool) -> int:
    """The width at which the join differs least: of what repeats, a whole number of periods is left."""
    rows, columns = image.shape[:2]
    block = max(1, min(rows, columns) // _SEARCH_PX)
    small = image[: rows // block * block, : columns // block * block]
    small = small.reshape(rows // block, block, columns // block, block, -1).mean(axis=(1, 3))
    width = small.shape[1]
    narrowest, widest = round(width * NARROWEST), round(width * WIDEST)
    coarse = _cheapest_strip(small, range(narrowest, widest + 1), closed) * block
    if block == 1:
        return coarse
    return _cheapest_strip(image, range(coarse - block, coarse + block + 1), closed)


def _cheapest_strip(image: Array, strips: range, closed: bool) -> int:
    def cost(strip: int) -> float:
        cost = _cost(image[:, :strip], image[:, image.shape[1] - strip :])
        along = cost[np.arange(len(cost)), _cut(cost, closed)]
        return float(np.mean(along) + _WHOLE_STRIP * np.mean(cost[np.isfinite(cost)]))

    return min(strips, key=cost)


def _cost(left: Array, right: Array) -> Array:
    """(H, strip) how much both pictures differ around each pixel; the join stays in the strip's middle half."""
    scale = np.std(np.concatenate([left, right]), axis=(0, 1)) + _EPSILON
    apart = np.sum(((left - right) / scale) ** 2, axis=-1)
    cost = cv2.GaussianBlur(apart, (0, 0), 1.5)
    margin = max(1, cost.shape[1] // 4)
    cost[:, :margin] = cost[:, -margin:] = np.inf
    return cost


def _cut(cost: Array, closed: bool) -> npt.NDArray[np.intp]:
    """(H,) column from which on the left picture is shown, along the cheapest connected path."""
    if not closed:
        return _cheapest(cost)
    start = int(_cheapest(np.concatenate([cost, cost]))[len(cost)])
    pinned = np.concatenate([cost, cost[:1]])
    pinned[[0, -1]] = np.inf
    pinned[[0, -1], start] = 0
    return _cheapest(pinned)[:-1]


def _cheapest(cost: Array) -> npt.NDArray[np.intp]:
    """(H,) columns of the cheapest path from the first row to the last that moves by at most one a row."""
    rows, columns = cost.shape
    total = cost[0].astype(np.float64)
    came_from = np.zeros((rows, columns), np.intp)
    for row in range(1, rows):
        padded = np.pad(total, 1, constant_values=np.inf)
        choices = np.stack([padded[:-2], padded[1:-1], padded[2:]])
        best = choices.argmin(axis=0)
        came_from[row] = np.arange(columns) + best - 1
        total = cost[row] + np.take_along_axis(choices, best[None], 0)[0]
    path = np.empty(rows, np.intp)
    path[-1] = int(total.argmin())
    for row in range(rows - 1, 0, -1):
        path[row - 1] = came_from[row, path[row]]
    return path


def _smooth(t: Array) -> Array:
    return t * t * (3 - 2 * t)


def _to_stack(maps: Maps) -> Array:
    """(H, W, 9): slopes, log albedos and roughness, in which blending is sound."""
    slopes = maps.normal[..., :2] / maps.normal[..., 2:]
    albedos = [np.log(a + _EPSILON) for a in (maps.diffuse, maps.specular)]
    return np.concatenate([slopes, *albedos, maps.roughness], axis=-1).astype(np.float32)


def _to_maps(stack: Array) -> Maps:
    normal = np.concatenate([stack[..., :2], np.ones_like(stack[..., :1])], axis=-1)
    diffuse, specular = (
        np.clip(np.exp(stack[..., s]) - _EPSILON, 0, 1) for s in (slice(2, 5), slice(5, 8))
    )
    return Maps(
        normal=normal / np.linalg.norm(normal, axis=-1, keepdims=True),
        diffuse=diffuse,
        roughness=np.clip(stack[..., 8:], 0, 1),
        specular=specular,
    )


def _path_ratio(joined: Array, left: Array, right: Array, path: npt.NDArray[np.bool_]) -> float:
    now, *before = (
        [float(_gradient(image)[path].mean()) for image in _shown(_to_maps(part)).values()]
        for part in (joined, left, right)
    )
    return max(_over(n, (a + b) / 2) for n, a, b in zip(now, *before, strict=True))


def _calmest(tile: Maps, axis: int) -> int:
    """The row (axis 0) or column at which a tile best begins."""
    worst: Array | None = None
    for image in _shown(tile).values():
        gradient = _gradient(image if axis else np.swapaxes(image, 0, 1)).mean(axis=0)
        relative = gradient / max(gradient.mean(), 1 / 255)
        worst = relative if worst is None else np.maximum(worst, relative)
    assert worst is not None
    return (int(worst.argmin()) + 1) % len(worst)


def _edge_ratio(image: Array) -> float:
    gradient = _gradient(image)
    return _over(gradient[:, -1].mean(), gradient[:, :-1].mean())


def _gradient(image: Array) -> Array:
    """(H, W): how much each pixel differs from the next on its right, around the edge."""
    return np.abs(np.roll(image, -1, axis=1) - image).mean(axis=-1)


def _over(seam: float, inside: float) -> float:
    """Differences below a step of 8 bits are not seen, and neither is their ratio."""
    step = 1 / 255
    return float(max(seam, step) / max(inside, step))


def _shown(maps: Maps) -> dict[str, Array]:
    """The maps as a screen shows them."""
    return {
        "normal": (maps.normal + 1) / 2,
        "diffuse": maps.diffuse ** np.float32(1 / 2.2),
        "roughness": maps.roughness,
        "specular": maps.specular ** np.float32(1 / 2.2),
    }
