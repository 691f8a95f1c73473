"""Calibrated refinement: the maps that explain all pictures of a session under their known lights.

Maximum a posteriori per pixel. A sample of pixels comes first (`learning`): which kind of material
explains them, what pixels of one colour share, and how the lights are off. Then every pixel is fitted,
band by band, drawn to what pixels like it have shown and to the network's maps.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from svbrdf.maps import Maps
from turnlight.estimate import pooled_prior, self_calibration
from turnlight.estimate.brdf_kernel import ROUGHNESS, from_maps, to_maps
from turnlight.estimate.learning import Learned, learn
from turnlight.estimate.noise import noise_of
from turnlight.estimate.observations import Array, Observations, fit_pixels, observe, scaled
from turnlight.estimate.quality import Quality, leave_one_out
from turnlight.estimate.uncertainty import Uncertainty, proportion_of, uncertainty
from turnlight.picture.picture import Picture

BAND_PIXELS = 1 << 17
_THOROUGH = 20
_FINE = 512
"""Pixels beyond this resolution are fitted from one start only."""
_ELSEWHERE = 0.1
"""In any parameter: another start nearer than this leads to the same place."""


@dataclass(frozen=True)
class Refinement:
    """Maps, how far they may be off, and how well each picture is explained."""

    maps: Maps
    uncertainty: Uncertainty
    quality: Quality
    learned: Learned


def refine(
    pictures: Sequence[Picture],
    network: Maps | None,
    resolution: int,
    progress: Callable[[float], None] = lambda _: None,
) -> Refinement:
    """Refine to resolution x resolution maps; at least one picture, all with known lighting.

    network: maps to start at and be drawn to, of any size. progress: told the share that is done.
    """
    sized = [scaled(picture, resolution) for picture in pictures]
    guess = None if network is None else resized(from_maps(network), resolution)
    noises = noise_of(sized)
    learned = learn(sized, noises, guess)
    quality = leave_one_out(learned)
    proportion = proportion_of(quality.relighting_error)
    rows = max(1, BAND_PIXELS // resolution)
    bands = []
    for top in range(0, resolution, rows):
        chosen = slice(top * resolution, min(top + rows, resolution) * resolution)
        seen = observe(sized, noises, chosen).without(*learned.bad)
        near = None if guess is None else guess[chosen]
        bands.append(_fit(seen, learned, near, proportion, resolution))
        progress(min(1.0, (top + rows) / resolution))
    theta = np.concatenate([band for band, _ in bands])
    parts = [part for _, part in bands]
    names = ("slopes", "diffuse", "roughness", "specular")
    whole = Uncertainty(*(np.concatenate([getattr(p, name) for p in parts]) for name in names))
    return Refinement(to_maps(theta), whole, quality, learned)


def _fit(
    seen: Observations, learned: Learned, guess: Array | None, proportion: float, width: int
) -> tuple[Array, Uncertainty]:
    """Parameters (rows, width, 9) of a band, and their uncertainty."""
    exact = self_calibration.corrected(seen, learned.corrections)
    values = pooled_prior.features(exact)
    mean, precision = learned.pool.prior(values, guess)
    shape = (len(values) // width, width)
    theta, energy = fit_pixels(exact, learned.pool.start(values), mean, precision, _THOROUGH)
    if width <= _FINE:
        start = theta.copy()
        start[:, ROUGHNESS:] = mean[:, ROUGHNESS:]
        for again in (start, _neighbours(theta, shape)):
            far = np.flatnonzero((np.abs(again - theta) > _ELSEWHERE).any(axis=1))
            other, other_energy = fit_pixels(
                exact.of_pixels(far), again[far], mean[far], precision[far], _THOROUGH
            )
            better = other_energy < energy[far]
            theta[far[better]], energy[far[better]] = other[better], other_energy[better]
    spread = uncertainty(
        exact, theta, mean, precision, learned.corrections, learned.pool.doubts(values), proportion, shape
    )  # fmt: skip
    return theta.reshape(*shape, -1), spread


def _neighbours(theta: Array, shape: tuple[int, int]) -> Array:
    """The median of each parameter around each pixel, for those that have gone astray."""
    planes = np.moveaxis(theta.reshape(*shape, -1), -1, 0)
    medians = [cv2.medianBlur(np.ascontiguousarray(plane), 5) for plane in planes]
    return np.asarray(np.stack(medians, axis=-1).reshape(theta.shape), np.float32)


def resized(theta: Array, resolution: int) -> Array:
    """Parameters (H, W, 9) at another resolution, (resolution^2, 9)."""
    method = cv2.INTER_AREA if theta.shape[0] > resolution else cv2.INTER_LINEAR
    planes = [
        cv2.resize(p, (resolution,) * 2, interpolation=method) for p in np.moveaxis(theta, -1, 0)
    ]
    return np.stack(planes, axis=-1).reshape(resolution**2, -1).astype(np.float32)
