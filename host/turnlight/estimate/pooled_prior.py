"""What a sample's pixels tell about each other: a prior for each pixel, learned from the session.

Pixels of like colour and place are one group. In each, hypotheses about the kind of material
(dielectric, metal, between) and about where its roughness lies compete by how well they explain all
pixels of the group, so that those which saw a highlight speak for those which did not. What wins gives
the group's mean and spread of roughness and specular albedo, by precision-weighted means (empirical Bayes), and
the scale of its relief by the median slope.
"""

import math
from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
import numpy.typing as npt

from turnlight.estimate.brdf_kernel import DIFFUSE, LOWER, ROUGHNESS, SLOPE, SPECULAR, UPPER
from turnlight.estimate.observations import Array, Observations, facing, in_chunks

GROUPS = 12
GLOSS = slice(ROUGHNESS, SPECULAR + 1)
NETWORK_SIGMA = np.array([0.25, 0.25, 0.8, 0.8, 0.8, 0.3, 0.7, 0.3, 0.3], np.float32)
"""How far the network's parameters usually are from the truth."""
_LEAST = np.array([0.005, 0.005, 0.4, 0.4, 0.4, 0.02, 0.03, 0.01, 0.01], np.float32)
_MOST = np.array([0.6, 0.6, 1.5, 1.5, 1.5, 0.35, 1.5, 0.5, 0.5], np.float32)
"""Bounds of a group's spread, by parameter."""
_DARKEST, _BRIGHTNESS_WEIGHT, _POSITION_WEIGHT, _SOFTNESS = 1e-3, 0.3, 0.3, 0.15
_INDIFFERENT, _TEMPER = 3.0, 2.0
"""Energies that differ by less say nothing, and beyond it count by the second: errors of one pixel's
values go together."""
_ALIKE = 0.1
"""The network errs alike at all pixels, so among them it must not be counted in full."""
CORRELATED = 30.0
"""Pixels err alike (misalignment, filtering, lights): as many of them count as one."""
_MEDIAN_TO_SIGMA = 1.48
_AT_ONCE = 256
"""Pixels whose distances to the whole sample stay in a core's cache."""
_PSEUDO_PIXELS, _COMPETITION_ROUNDS, _SPREAD_ROUNDS = 10.0, 200, 8


@dataclass(frozen=True)
class Hypothesis:
    """A Gaussian prior of the nine parameters, where the fit starts, and how likely it is beforehand."""

    mean: Array
    sigma: Array
    roughness: float
    share: float

    def start(self, seen: Observations, guess: Array | None) -> tuple[Array, Array, Array]:
        """Where the fit of each pixel starts, the prior's mean and its precision, (P, 9) each."""
        mean = np.repeat(self.mean[None], seen.pixels, axis=0)
        precision = np.repeat(np.float32(1) / self.sigma[None] ** 2, seen.pixels, axis=0).astype(
            np.float32
        )
        start = mean.copy()
        start[:, ROUGHNESS] = self.roughness
        if self.mean[SPECULAR] < math.log(0.1):
            start[:, DIFFUSE] = np.log(np.median(matte_albedo(seen), axis=0))
        if guess is not None:
            mean, precision = drawn(mean, precision, guess, _ALIKE)
        return np.clip(start, LOWER, UPPER).astype(np.float32), mean, precision


def _hypothesis(
    diffuse: tuple[float, float],
    specular: tuple[float, float],
    tint_sigma: float,
    roughness: float,
    relief: float,
    share: float,
) -> Hypothesis:
    """diffuse, specular: the median, and the standard deviation of the log. relief: scale of the slopes."""
    mean = [0, 0, *[math.log(diffuse[0])] * 3, 0.5, math.log(specular[0]), 0, 0]
    sigma = [relief, relief, *[diffuse[1]] * 3, 0.3, specular[1], tint_sigma, tint_sigma]
    return Hypothesis(np.array(mean, np.float32), np.array(sigma, np.float32), roughness, share)


HYPOTHESES = (
    _hypothesis((0.2, 1.5), (0.04, 0.15), 0.03, 0.12, 0.05, 0.2),
    _hypothesis((0.2, 1.5), (0.04, 0.15), 0.03, 0.3, 0.3, 0.3),
    _hypothesis((0.2, 1.5), (0.04, 0.15), 0.03, 0.65, 0.6, 0.3),
    _hypothesis((0.01, 1.0), (0.6, 0.5), 0.4, 0.2, 0.05, 0.05),
    _hypothesis((0.01, 1.0), (0.6, 0.5), 0.4, 0.5, 0.05, 0.05),
    _hypothesis((0.1, 1.0), (0.2, 0.8), 0.3, 0.35, 0.05, 0.1),
)
"""Mirrors are flat, else few lights would make relief of their highlights; what is matte may be steep."""


@dataclass(frozen=True)
class Pool:
    """What a session's sample of pixels has shown.

    centres (groups, F); mean, sigma (groups, 9): the prior of each group, and doubt (groups, 2, 2): how
    far its mean of roughness and specular albedo may be off. values (S, F), theta (S, 9): the sample
    itself, from which fits start.
    """

    centres: Array
    mean: Array
    sigma: Array
    doubt: Array
    values: Array
    theta: Array

    def prior(self, values: Array, guess: Array | None) -> tuple[Array, Array]:
        """Mean and precision (P, 9) for pixels of these features (P, F)."""
        shares = belonging(values, self.centres)
        mean = shares @ self.mean
        variance = shares @ (self.sigma**2 + self.mean**2) - mean**2
        precision = np.asarray(1 / np.maximum(variance, 1e-6), np.float32)
        return (mean, precision) if guess is None else drawn(mean, precision, guess)

    def doubts(self, values: Array) -> Array:
        """(P, 2, 2): how far the means of `prior` may be off, in roughness and specular albedo."""
        return np.einsum("pg,gij->pij", belonging(values, self.centres), self.doubt)

    def start(self, values: Array) -> Array:
        """Where the fits (P, 9) of pixels of these features start: at the sample's most similar pixel."""
        squares, doubled = (self.values**2).sum(axis=1), np.ascontiguousarray(-2 * self.values.T)
        nearest = np.empty(len(values), np.int64)

        def find(part: slice) -> None:
            distance = values[part] @ doubled
            distance += squares
            nearest[part] = distance.argmin(axis=1)

        in_chunks(find, len(values), _AT_ONCE)
        start = self.theta[nearest]
        start[:, SLOPE] = 0.0
        return start


def features(seen: Observations) -> Array:
    """(P, 6): log albedo as a matte surface would have it, how far its brightest lies above, place."""
    logs = np.log(matte_albedo(seen))
    middle = np.median(logs, axis=0)
    brightest = (logs.max(axis=0) - middle).mean(axis=-1, keepdims=True)
    place = _POSITION_WEIGHT * seen.positions
    values = np.concatenate([middle, _BRIGHTNESS_WEIGHT * brightest, place], axis=-1)
    return np.asarray(values, np.float32)


def matte_albedo(seen: Observations) -> Array:
    """(K, P, 3) albedo of a flat matte surface that would give each shot's values."""
    values = np.exp(seen.logs) - seen.floor[:, None, None]
    lit = np.zeros_like(values)
    for light, shot, white in zip(seen.lights, seen.shot_of, seen.white, strict=True):
        lit[shot] += facing(light, seen.positions)[:, None] * white
    return np.clip(values / lit, _DARKEST, None)


def compete(energies: Array, values: Array) -> npt.NDArray[np.int64]:
    """(P,) the most likely hypothesis of each pixel, by energies (hypotheses, P) and features (P, F)."""
    worse = np.maximum(energies - energies.min(axis=0) - _INDIFFERENT, 0)
    likely = np.exp(-np.minimum(worse / _TEMPER, 50.0))
    first = np.array([[h.share] for h in HYPOTHESES])
    everyone = np.ones((len(values), 1))
    usual, _ = _voted(likely, everyone, first)
    _, belief = _voted(likely, belonging(values, groups(values)), usual)
    return np.asarray(belief.argmax(axis=0))


def _voted(
    likely: npt.NDArray[np.float64], shares: npt.NDArray[Any], usual: npt.NDArray[np.float64]
) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]:
    """Of likelihoods (hypotheses, P): their weights in groups that pixels belong to by shares (P, groups),
    starting from and drawn to the usual ones (hypotheses, 1), and the pixels' beliefs (hypotheses, P)."""
    weight = np.repeat(usual, shares.shape[1], axis=1)
    for _ in range(_COMPETITION_ROUNDS):
        belief = likely * (weight @ shares.T)
        belief /= belief.sum(axis=0)
        weight = (belief @ shares + _PSEUDO_PIXELS * usual) / (shares.sum(axis=0) + _PSEUDO_PIXELS)
    return weight, belief


def learn(
    values: Array,
    theta: Array,
    mean: Array,
    precision: Array,
    covariance: npt.NDArray[np.float64],
    kind: tuple[Array, Array],
) -> Pool:
    """Group priors from pixels' posteriors (theta (P, 9), covariance (P, 9, 9)) under their own priors.

    kind: mean and precision (P, 9) of the hypothesis that each pixel's group prefers.
    """
    centres = groups(values)
    variance = np.diagonal(covariance, axis1=1, axis2=2).astype(np.float32)
    information = np.maximum(1 / variance - precision, 1e-6).astype(np.float32)
    free = (theta / variance - mean * precision) / information
    alone = np.where(information > 0.2 * precision, free, theta).astype(np.float32)
    information /= CORRELATED
    gloss = _Gloss.of(theta, mean, precision, covariance)
    everyone = np.ones((len(theta), 1), np.float32)
    anchor = _anchor(everyone, kind)
    broad_mean, broad_sigma = _spread(alone, information, everyone, anchor)
    broad_mean[:, GLOSS], _ = gloss.mean(everyone, broad_sigma, anchor)
    shares = belonging(values, centres)
    anchor = _product(*_anchor(shares, kind), broad_mean, np.float32(1) / broad_sigma**2)
    group_mean, group_sigma = _spread(alone, information, shares, anchor)
    group_mean[:, GLOSS], doubt = gloss.mean(shares, group_sigma, anchor)
    squares = theta[:, SLOPE] ** 2
    group_mean[:, SLOPE], group_sigma[:, SLOPE] = 0.0, _relief(squares, shares)
    return Pool(centres, group_mean, group_sigma, doubt, values, theta)


def _relief(squares: Array, shares: Array) -> Array:
    """(groups, 1) scale of the slopes of groups, from their expected squares (P, 2).

    By the median: most of a sample is flat and some of it is steep, or a highlight gone astray.
    """
    home = shares.argmax(axis=1)
    medians = [
        np.median(squares[home == g]) if (home == g).any() else 1 for g in range(shares.shape[1])
    ]
    scale = _MEDIAN_TO_SIGMA * np.sqrt(np.array(medians, np.float32)[:, None])
    return np.asarray(np.clip(scale, _LEAST[SLOPE], _MOST[SLOPE]), np.float32)


def _anchor(shares: Array, kind: tuple[Array, Array]) -> tuple[Array, Array]:
    """Mean and precision (groups, 9) of what the kinds of material of a group's pixels say of its mean:
    what specular albedos there are. Pixels err alike, so that many of them weigh no more than this."""
    told, precision = kind
    weights = shares / shares.sum(axis=0)
    mean = weights.T @ told
    variance = weights.T @ (1 / precision + told**2) - mean**2
    strength = np.zeros_like(mean)
    strength[:, SPECULAR:] = CORRELATED / variance[:, SPECULAR:]
    return mean, strength


@dataclass(frozen=True)
class _Gloss:
    """What each pixel's pictures alone say of roughness and specular albedo together.

    Away from its peak a highlight tells only their product (albedo times the fourth power of roughness),
    so the means of both must be found at once. information (P, 2, 2); told (P, 2): that times the values.
    """

    information: npt.NDArray[np.float64]
    told: npt.NDArray[np.float64]

    @classmethod
    def of(
        cls, theta: Array, mean: Array, precision: Array, covariance: npt.NDArray[np.float64]
    ) -> "_Gloss":
        stated = np.linalg.inv(covariance[:, GLOSS, GLOSS])
        information = stated - precision[:, GLOSS, None] * np.eye(2)
        told = np.einsum("pij,pj->pi", stated, theta[:, GLOSS]) - (precision * mean)[:, GLOSS]
        return cls(information / CORRELATED, told / CORRELATED)

    def mean(self, shares: Array, sigma: Array, anchor: tuple[Array, Array]) -> tuple[Array, Array]:
        """(groups, 2) means of groups with this spread (groups, 9), drawn to `anchor`, and how far they may
        be off (groups, 2, 2): what draws them errs alike at all pixels."""
        result = np.empty((len(sigma), 2), np.float32)
        doubt = np.empty((len(sigma), 2, 2), np.float32)
        for group, spread in enumerate(sigma[:, GLOSS].astype(np.float64)):
            counted = np.linalg.inv(np.eye(2) + self.information * spread**2)
            weight = np.einsum("p,pij,pjk->ik", shares[:, group], counted, self.information)
            total = np.einsum("p,pij,pj->i", shares[:, group], counted, self.told)
            mean, strength = (part[group, GLOSS] for part in anchor)
            covariance = np.linalg.inv(weight + np.diag(strength))
            result[group] = covariance @ (total + strength * mean)
            doubt[group] = covariance @ (weight + CORRELATED * np.diag(strength)) @ covariance
        return np.clip(result, LOWER[GLOSS], UPPER[GLOSS]).astype(np.float32), doubt


def groups(values: Array) -> Array:
    """(groups, F) centres of the features' k-means, the same at every run."""
    cv2.setRNGSeed(0)
    stop = (cv2.TERM_CRITERIA_EPS | cv2.TERM_CRITERIA_MAX_ITER, 20, 1e-3)
    labels = np.zeros((len(values), 1), np.int32)
    count = min(GROUPS, len(values))
    return np.asarray(cv2.kmeans(values, count, labels, stop, 2, cv2.KMEANS_PP_CENTERS)[2])


def belonging(values: Array, centres: Array) -> Array:
    """(P, groups) shares of each pixel in the groups, which sum to 1."""
    distance = (values**2).sum(axis=1)[:, None] + (centres**2).sum(axis=1) - 2 * values @ centres.T
    nearest = distance.min(axis=1, keepdims=True)
    weights = np.exp(-(distance - nearest) / (2 * _SOFTNESS**2))
    return np.asarray(weights / weights.sum(axis=1, keepdims=True), np.float32)


def drawn(mean: Array, precision: Array, guess: Array, weight: float = 1.0) -> tuple[Array, Array]:
    """A prior times the network's guess with its usual error, of which `weight` counts."""
    return _product(mean, precision, guess, weight / NETWORK_SIGMA**2)


def _product(mean: Array, precision: Array, other: Array, extra: Array) -> tuple[Array, Array]:
    """Mean and precision of the product of two Gaussians of these means and precisions."""
    total = np.asarray(precision + extra, np.float32)
    return np.asarray((mean * precision + other * extra) / total, np.float32), total


def _spread(
    alone: Array, information: Array, shares: Array, anchor: tuple[Array, Array]
) -> tuple[Array, Array]:
    """Mean and spread (groups, 9) of values with this much information each, drawn to `anchor`."""
    sigma = np.repeat(_MOST[None] / 2, shares.shape[1], axis=0)
    for _ in range(_SPREAD_ROUNDS):
        weight = shares[..., None] / (sigma**2 + 1 / information[:, None])
        total = weight.sum(axis=0)
        mean = (weight * alone[:, None]).sum(axis=0) / total
        mean = (mean * total + anchor[1] * anchor[0]) / (total + anchor[1])
        excess = (alone[:, None] - mean) ** 2 - 1 / information[:, None]
        spread = (weight * excess).sum(axis=0) / total
        sigma = np.sqrt(np.clip(spread, _LEAST**2, _MOST**2))
    return np.asarray(mean, np.float32), np.asarray(sigma, np.float32)
