"""How good maps are: re-rendering SSIM, as is and exposure-fitted, and errors of each map. Numpy only."""

import json
import math
from dataclasses import dataclass
from functools import cache
from importlib import resources

import cv2
import numpy as np
import numpy.typing as npt

from svbrdf.maps import Maps
from svbrdf.renderer import render

Array = npt.NDArray[np.float32]
SSIM_C1, SSIM_C2 = 1e-4, 9e-4
WINDOW, SIGMA = 11, 1.5


@dataclass(frozen=True)
class Scores:
    """One map set against the truth; SSIM in [-1, 1], the normal's mean angle in degrees, RMSE of the rest."""

    ssim: float
    ssim_fitted: float
    normal_deg: float
    diffuse_rmse: float
    roughness_rmse: float
    specular_rmse: float


def score(predicted: Maps, true: Maps, true_renderings: list[Array] | None = None) -> Scores:
    """Compare numpy maps (H, W, ...) under the twelve fixed view/light pairs.

    true_renderings: `renderings(true)`, where many predictions are compared with one truth.
    """
    ours, theirs = renderings(predicted), true_renderings or renderings(true)
    ratios = [
        np.median(np.log(t + 0.02) - np.log(o + 0.02)) for o, t in zip(ours, theirs, strict=True)
    ]
    factor = math.exp(float(np.median(ratios)))
    return Scores(
        ssim=_mean_ssim(ours, theirs, 1.0),
        ssim_fitted=_mean_ssim(ours, theirs, factor),
        normal_deg=normal_error_deg(predicted.normal, true.normal),
        diffuse_rmse=_rmse(predicted.diffuse, true.diffuse),
        roughness_rmse=_rmse(predicted.roughness, true.roughness),
        specular_rmse=_rmse(predicted.specular, true.specular),
    )


def renderings(maps: Maps) -> list[Array]:
    """Linear radiance under each fixed pair, irradiance pi and no fall-off: 12 x (H, W, 3)."""
    return [render(maps, light, view, np.float32(math.pi)) for light, view in _pairs()]


def ssim(a: Array, b: Array) -> float:
    """Structural similarity of two (H, W, 3) images in [0, 1], mean over channels and pixels."""
    mean_a, mean_b = _blur(a), _blur(b)
    var_a, var_b = _blur(a * a) - mean_a**2, _blur(b * b) - mean_b**2
    covariance = _blur(a * b) - mean_a * mean_b
    numerator = (2 * mean_a * mean_b + SSIM_C1) * (2 * covariance + SSIM_C2)
    denominator = (mean_a**2 + mean_b**2 + SSIM_C1) * (var_a + var_b + SSIM_C2)
    border = WINDOW // 2
    return float((numerator / denominator)[border:-border, border:-border].mean())


def normal_error_deg(predicted: Array, true: Array) -> float:
    cosine = np.clip((predicted * true).sum(axis=-1), -1, 1)
    return float(np.degrees(np.arccos(cosine)).mean())


def no_model(pictures: list[Array]) -> Maps:
    """The guess without a model from linear pictures (H, W, 3): their mean on a flat dielectric."""
    mean = np.mean(pictures, axis=0, dtype=np.float32)
    shape = mean.shape[:2]
    return Maps(
        normal=np.broadcast_to(np.array([0, 0, 1], np.float32), (*shape, 3)),
        diffuse=mean,
        roughness=np.full((*shape, 1), 0.5, np.float32),
        specular=np.full((*shape, 3), 0.04, np.float32),
    )


@cache
def _pairs() -> tuple[tuple[Array, Array], ...]:
    text = (resources.files("svbrdf") / "evaluation.json").read_text()
    return tuple(
        (np.array(pair["light"], np.float32), np.array(pair["view"], np.float32))
        for pair in json.loads(text)["pairs"]
    )


def _mean_ssim(ours: list[Array], theirs: list[Array], factor: float) -> float:
    values = [ssim(_display(o * factor), _display(t)) for o, t in zip(ours, theirs, strict=True)]
    return float(np.mean(values))


def _display(radiance: Array) -> Array:
    return (np.clip(radiance, 0, 1) ** (1 / 2.2)).astype(np.float32)


def _blur(image: Array) -> Array:
    return np.asarray(cv2.GaussianBlur(image, (WINDOW, WINDOW), SIGMA), np.float32)


def _rmse(a: Array, b: Array) -> float:
    return float(np.sqrt(np.mean((a - b) ** 2)))
