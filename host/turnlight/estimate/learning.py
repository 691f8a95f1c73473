"""What a sample of a session's pixels teaches: the kinds of material, the lights' errors, bad shots."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from turnlight.estimate import pooled_prior, self_calibration, sharpness
from turnlight.estimate.brdf_kernel import SPECULAR
from turnlight.estimate.map_kernel import SEEN
from turnlight.estimate.observations import (
    Array,
    Observations,
    fit_pixels,
    observe,
    posterior_covariance,
    predicted,
)
from turnlight.estimate.pooled_prior import HYPOTHESES, Pool
from turnlight.estimate.self_calibration import Corrections
from turnlight.picture.picture import Picture

SAMPLE = 3072
_ROUNDS = 4
_QUICK = 12
_FEWEST_TO_JUDGE, _BAD, _BAD_RATIO = 4, 0.3, 3.0
_BAD_ROUNDS = 3
"""The worst shots hide what is wrong with others."""
_JUDGED = 0.75
"""Quantile of the pixels' deviations: what a shadow falls on may be less than half."""
_NO_SPECULAR = -9.0
"""Of its albedo's log."""
_MOSTLY_MATTE, _LIT, _FEWEST_MATTE = 0.3, 5.0, 0.05
"""The log of the whole over its matte part; the whole over the floor; the share of pixels that must be so."""


@dataclass(frozen=True)
class Learned:
    """pool: what pixels share. corrections: of the lights. bad: shots that contradict the others.

    The sample itself: seen (lights corrected), its fit theta, and the prior it was fitted under.
    residuals (K,): upper quartile of |ln(model / picture)| by shot; NaN for one that cannot be judged.
    """

    pool: Pool
    corrections: Corrections
    bad: tuple[int, ...]
    seen: Observations
    theta: Array
    mean: Array
    precision: Array
    residuals: Array


def learn(pictures: Sequence[Picture], noises: Sequence[Array], guess: Array | None) -> Learned:
    """From a sample of the pixels of `scaled` pictures, each with its noise (H, W).

    guess (P, 9): the network's parameters.
    """
    pixels = pictures[0].valid.size
    chosen = np.sort(np.random.default_rng(0).permutation(pixels)[:SAMPLE])
    seen = observe(pictures, noises, chosen)
    few = None if guess is None else guess[chosen]
    learned = _learn(seen, few, ())
    for _ in range(_BAD_ROUNDS):
        known = set(learned.bad)
        bad = _contradicting(learned.residuals) - known
        bad = bad or _blurred(pictures, noises, learned, guess) - known
        if not bad:
            break
        learned = _learn(seen, few, tuple(sorted(bad | known)))
    return learned


def _blurred(
    pictures: Sequence[Picture], noises: Sequence[Array], learned: Learned, guess: Array | None
) -> set[int]:
    """Shots less sharp than others, where there are enough to tell and the pictures are large enough."""
    resolution = len(pictures[0].valid)
    if len(pictures) < _FEWEST_TO_JUDGE or resolution < sharpness.TILE:
        return set()
    chosen = sharpness.tiles(resolution)
    seen = self_calibration.corrected(observe(pictures, noises, chosen), learned.corrections)
    values = pooled_prior.features(seen)
    mean, precision = learned.pool.prior(values, None if guess is None else guess[chosen])
    good = seen.without(*learned.bad)
    theta, _ = fit_pixels(good, learned.pool.start(values), mean, precision, _QUICK)
    by_others = [
        predicted(seen, fit_pixels(good.without(shot), theta, mean, precision, _QUICK)[0])[shot]
        for shot in range(seen.shots)
    ]
    usable = _told_by_matte(seen, theta, predicted(seen, theta))
    return sharpness.blurred(seen, np.stack(by_others), usable)


def _learn(everything: Observations, guess: Array | None, bad: tuple[int, ...]) -> Learned:
    nominal = everything.without(*bad)
    values = pooled_prior.features(nominal)
    corrections = self_calibration.unknown_errors(len(nominal.lights))
    theta, mean, precision = _compete(nominal, values, guess)
    kind = mean, precision
    for _ in range(_ROUNDS):
        exact = self_calibration.corrected(nominal, corrections)
        covariance = posterior_covariance(exact, theta, mean, precision)
        pool = pooled_prior.learn(values, theta, mean, precision, covariance, kind)
        mean, precision = pool.prior(values, guess)
        theta, _ = fit_pixels(exact, theta, mean, precision, _QUICK)
        corrections = self_calibration.improve(nominal, corrections, theta, mean, precision)
    exact = self_calibration.corrected(nominal, corrections)
    theta, _ = fit_pixels(exact, theta, mean, precision, _QUICK)
    whole = exact._replace(state=everything.state)
    return Learned(
        replace(pool, theta=theta), corrections, bad, exact, theta, mean, precision,
        _residuals(whole, theta),
    )  # fmt: skip


def _compete(seen: Observations, values: Array, guess: Array | None) -> tuple[Array, Array, Array]:
    """Each pixel's parameters under the hypothesis that its group prefers, and that one's prior."""
    tried = [h.start(seen, guess) for h in HYPOTHESES]
    fits = [fit_pixels(seen, start, mean, precision, _QUICK) for start, mean, precision in tried]
    best = pooled_prior.compete(np.stack([energy for _, energy in fits]), values)
    each = np.arange(seen.pixels)
    theta = np.stack([theta for theta, _ in fits])[best, each]
    mean = np.stack([mean for _, mean, _ in tried])[best, each]
    precision = np.stack([precision for _, _, precision in tried])[best, each]
    return theta, mean, precision


def _residuals(seen: Observations, theta: Array) -> Array:
    """Upper quartile by shot of how far pixels are from the fit; NaN where too few are mostly matte."""
    whole = predicted(seen, theta)
    apart = np.abs(whole - seen.logs).mean(axis=-1)
    usable = _told_by_matte(seen, theta, whole)
    few = _FEWEST_MATTE * seen.pixels
    deviations = [
        np.quantile(a[u], _JUDGED) if u.sum() > few else np.nan
        for a, u in zip(apart, usable, strict=True)
    ]
    return np.array(deviations, np.float32)


def _told_by_matte(seen: Observations, theta: Array, whole: Array) -> sharpness.Mask:
    """(K, P): where the model, which predicts `whole`, is mostly matte, and not dark. A highlight that is a
    little off would look like a bad shot, and so would noise."""
    matte = theta.copy()
    matte[:, SPECULAR] = _NO_SPECULAR
    part = predicted(seen, matte)
    lit = whole.mean(axis=-1) > np.log(_LIT * seen.floor)[:, None]
    mostly = (whole - part).mean(axis=-1) < _MOSTLY_MATTE
    return np.asarray((seen.state == SEEN) & lit & mostly)


def _contradicting(residuals: Array) -> set[int]:
    """Shots that the maps explain far worse than they explain the usual one."""
    if np.isfinite(residuals).sum() < _FEWEST_TO_JUDGE:
        return set()
    limit = max(_BAD, _BAD_RATIO * float(np.nanmedian(residuals)))
    return {int(shot) for shot in np.flatnonzero(residuals > limit)}
