"""Pictures as the refinement's kernel reads them: logs, per pixel, with the light that made them."""

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from typing import NamedTuple

import cv2
import numpy as np
import numpy.typing as npt

from svbrdf.lighting import Light, Lighting
from svbrdf.renderer import pixel_positions
from turnlight.estimate.map_kernel import (
    CLIPPED,
    SEEN,
    UNSEEN,
    fit,
    precisions,
    predictions,
)
from turnlight.picture.picture import Picture

Array = npt.NDArray[np.float32]
DARKNESS = 0.002
"""Added before taking logs, relative to what white reads: darker values are stray light."""
SENSOR_DARKNESS = 5e-4
"""The least that is added, of the sensor's full scale: darker values are its own noise, which a picture
that is exposed for a mirror's highlight would else take for the colour of all that is not in it."""
_LEAST_ABOVE = 0.1
"""Of what is added, what at least is left under noise below black, for there to be a log."""
_WORKERS = 2
CHUNK = 2048


class Observations(NamedTuple):
    """K pictures of P pixels under M lights, each of which belongs to one picture.

    logs (K, P, 3): ln(value + floor). state (K, P): UNSEEN, SEEN or CLIPPED. floor (K,).
    sigma (K, P): the noise of the logs. positions (P, 2), views (K, 3), lights (M, 3): in half sides.
    shot_of (M,). white (M, P, 3): what a white patch that faces the light records.
    """

    logs: Array
    state: npt.NDArray[np.uint8]
    floor: Array
    sigma: Array
    positions: Array
    views: Array
    lights: Array
    shot_of: npt.NDArray[np.int64]
    white: Array

    @property
    def pixels(self) -> int:
        return len(self.positions)

    @property
    def shots(self) -> int:
        return len(self.logs)

    def of_pixels(self, chosen: npt.NDArray[np.int64] | slice) -> "Observations":
        return self._replace(
            logs=np.ascontiguousarray(self.logs[:, chosen]),
            state=np.ascontiguousarray(self.state[:, chosen]),
            sigma=np.ascontiguousarray(self.sigma[:, chosen]),
            positions=np.ascontiguousarray(self.positions[chosen]),
            white=np.ascontiguousarray(self.white[:, chosen]),
        )

    def without(self, *shots: int) -> "Observations":
        """The same, with these shots unseen."""
        state = self.state.copy()
        state[list(shots)] = UNSEEN
        return self._replace(state=state)


def scaled(picture: Picture, resolution: int) -> Picture:
    """A picture with known lighting at resolution x resolution: by area where that is a reduction."""
    assert picture.lighting is not None
    clipped = _resized(picture.clipped.astype(np.float32), resolution) > 0
    lights = tuple(
        Light(light.position, _resized(light.white, resolution))
        for light in picture.lighting.lights
    )
    return replace(
        picture,
        image=_resized(picture.image, resolution),
        valid=_resized(picture.valid.astype(np.float32), resolution) > 0.999,
        clipped=clipped,
        lighting=Lighting(picture.lighting.view, lights),
    )


def observe(
    pictures: Sequence[Picture], noises: Sequence[Array], chosen: slice | npt.NDArray[np.int64]
) -> Observations:
    """Chosen pixels, by their number row after row, of `scaled` pictures, each with its noise (H, W)."""
    resolution = len(pictures[0].image)
    logs, states, floors, whites, owners = [], [], [], [], []
    lightings = [p.lighting for p in pictures if p.lighting is not None]
    for number, (picture, lighting) in enumerate(zip(pictures, lightings, strict=True)):
        floor = floor_of(lighting)
        state = np.where(picture.valid, np.where(picture.clipped, CLIPPED, SEEN), UNSEEN)
        states.append(state.ravel()[chosen])
        logs.append(np.log(_above(picture.image.reshape(-1, 3)[chosen], floor)))
        floors.append(floor)
        whites += [light.white.reshape(-1, 3)[chosen] for light in lighting.lights]
        owners += [number] * len(lighting.lights)
    places = pixel_grid(resolution).reshape(-1, 2)
    return Observations(
        logs=np.stack(logs).astype(np.float32),
        state=np.stack(states).astype(np.uint8),
        floor=np.array(floors, np.float32),
        sigma=np.stack([n.ravel()[chosen] for n in noises]),
        positions=places[chosen],
        views=np.stack([lighting.view for lighting in lightings]).astype(np.float32),
        lights=np.array([light.position for g in lightings for light in g.lights], np.float32),
        shot_of=np.array(owners, np.int64),
        white=np.stack(whites).astype(np.float32),
    )


def fit_pixels(
    seen: Observations, theta: Array, mean: Array, precision: Array, iterations: int
) -> tuple[Array, Array]:
    """Parameters (P, 9) of the maximum a posteriori from theta on, and minus its log posterior (P,)."""
    result, energy = theta.copy(), np.zeros(len(theta), np.float32)

    def one(part: slice) -> None:
        here = seen.of_pixels(part)
        fit(result[part], mean[part], precision[part], here, iterations, energy[part])

    in_chunks(one, len(theta), CHUNK)
    return result, energy


def in_chunks(work: Callable[[slice], None], count: int, size: int) -> None:
    """Do the work for slices of 0 to count, on both cores."""
    parts = [slice(start, start + size) for start in range(0, count, size)]
    with ThreadPoolExecutor(_WORKERS) as workers:
        list(workers.map(work, parts))


def posterior_covariance(
    seen: Observations, theta: Array, mean: Array, precision: Array
) -> npt.NDArray[np.float64]:
    """(P, 9, 9) Laplace approximation at theta, lights taken as exact."""
    result = np.zeros((len(theta), theta.shape[1], theta.shape[1]))
    precisions(theta, mean, precision, seen, result)
    return np.asarray(np.linalg.inv(result), np.float64)


def predicted(seen: Observations, theta: Array) -> Array:
    """(K, P, 3) ln(value + floor) that parameters theta (P, 9) give."""
    result = np.zeros_like(seen.logs)
    predictions(theta, seen, result)
    return result


def _above(image: Array, floor: float) -> Array:
    """Values over the floor; noise takes some below black, but none as far as below the floor."""
    return np.asarray(np.maximum(image + floor, _LEAST_ABOVE * floor), np.float32)


def floor_of(lighting: Lighting) -> float:
    """What is added to a picture's values before logs are taken."""
    white = sum(float(light.white.mean()) for light in lighting.lights)
    return max(DARKNESS * white, SENSOR_DARKNESS)


def pixel_grid(resolution: int) -> Array:
    """(resolution, resolution, 2) positions of the pixels on the sample, in half sides."""
    return pixel_positions(np, resolution, resolution, dtype=np.float32)[..., :2]


def facing(light: Array, positions: Array) -> Array:
    """Cosine of a light's angle at positions (..., 2) of a flat sample, no less than 0.05."""
    offset = light[:2] - positions
    cosine = light[2] / np.sqrt(np.sum(offset**2, axis=-1) + light[2] ** 2)
    return np.asarray(np.maximum(cosine, 0.05), np.float32)


def _resized(image: Array, resolution: int) -> Array:
    """Square images by area where that is a reduction; (1, 1, 3) is repeated."""
    if image.shape[0] == resolution:
        return image
    if image.shape[0] == 1:
        return np.broadcast_to(image, (resolution, resolution, image.shape[-1]))
    method = cv2.INTER_AREA if image.shape[0] > resolution else cv2.INTER_LINEAR
    return np.asarray(cv2.resize(image, (resolution, resolution), interpolation=method), np.float32)
