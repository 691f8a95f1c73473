"""Are the stated uncertainties honest? `python -m turnlight.study_uncertainty --materials DIR`.

Ten shots of each material through the simulated rig, its calibration off by its tolerances, are refined,
and the errors compared with what was stated. With --fit, on materials of the training and validation
splits, it prints the table that `estimate.uncertainty` turns deviations into intervals with; without, it
checks the intervals on the test split.
"""

import argparse
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from pathlib import Path

import numpy as np

from svbrdf import materials, procedural, split
from svbrdf.maps import Maps
from turnlight.estimate.estimator import Estimator
from turnlight.estimate.observations import Array
from turnlight.estimate.refine import refine
from turnlight.estimate.uncertainty import (
    INTERVALS,
    SHARES,
    Uncertainty,
    between,
    half_width,
    radius,
)
from turnlight.study import SimulatedRig

Sample = dict[str, Array]
"""By map, (n, 2): the deviation stated and the error made."""
SHOTS, CROP, RESOLUTION, PIXELS = 10, 512, 128, 2000
FITTED, CHECKED = 24, 24
"""How many materials: the folders first, procedural ones for the rest. A session's roughness is mostly off as a
whole, so ten materials are about ten errors, of which no share is known to better than a tenth or two."""
FIFTHS = 5
MOST = 99.5
"""The highest percentile that is tried."""
DIELECTRICS = 0.02
"""The least half of a 95 % interval of specular albedo. Nature's dielectrics have 0.02 to 0.06; those of the
sets all have 0.04, from which no fit could learn that."""


def main() -> None:
    args = _arguments()
    samples = []
    for number, (name, load) in enumerate(_materials(args.materials, args.fit)):
        for seed in range(args.draws * number, args.draws * (number + 1)):
            path = args.cache / f"{name}-{seed}.npz" if args.cache else None
            if path and path.exists():
                with np.load(path) as kept:
                    samples.append(dict(kept))
                continue
            samples.append(sample(load(), seed))
            if path:
                path.parent.mkdir(parents=True, exist_ok=True)
                np.savez(path, **samples[-1])
    print(fitted(samples) if args.fit else coverage(samples))


def sample(material: Maps, seed: int) -> Sample:
    """Some pixels of one capture; seed: of the calibration's errors."""
    rig, network = SimulatedRig(material, seed), Estimator()
    pictures = [rig.take(shot) for shot in rig.plan(SHOTS)]
    for picture in pictures:
        guess = network.add(picture)
    done = refine(pictures, guess, RESOLUTION)
    truth = materials.reduced(material, RESOLUTION, RESOLUTION)
    chosen = np.random.default_rng(seed).permutation(RESOLUTION**2)[:PIXELS]
    pairs = {"normal": _slopes(done.maps.normal, truth.normal, done.uncertainty)}
    for name in ("diffuse", "roughness", "specular"):
        error = np.abs(getattr(done.maps, name) - getattr(truth, name))
        pairs[name] = np.stack([getattr(done.uncertainty, name), error], axis=-1)
    return {
        name: pair.reshape(RESOLUTION**2, -1, 2)[chosen].reshape(-1, 2)
        for name, pair in pairs.items()
    }


def coverage(samples: Sequence[Sample]) -> str:
    """What share of errors the stated intervals hold."""
    lines = [f"{'':>10}  50 %   95 %   95 % in each fifth of the stated widths, narrowest first"]
    for name in INTERVALS:
        pair = np.concatenate([sample[name] for sample in samples])
        held = {share: pair[:, 1] <= half_width(pair[:, 0], name, share) for share in SHARES}
        order = np.argsort(pair[:, 0], kind="stable")
        fifths = [held[95][part].mean() for part in np.array_split(order, FIFTHS)]
        lines.append(
            f"{name:>10}  {held[50].mean():.3f}  {held[95].mean():.3f}  "
            + "  ".join(f"{f:.3f}" for f in fifths)
        )
    return "\n".join(lines)


def fitted(samples: Sequence[Sample]) -> str:
    """INTERVALS anew: medians of the fifths of stated deviations, and what holds each share of the errors on a
    material that the fit has not seen."""
    lines = []
    for name in INTERVALS:
        specular = name == "specular"
        pairs = [sample[name] for sample in samples]
        lines.append(f'"{name}": ({_rounded(_fit(pairs, SHARES[0])[0])}, {{')
        for share in SHARES:
            halves = _fit(pairs, share if specular else _level(pairs, share))[1]
            if specular and share == 95:
                halves = [max(half, DIELECTRICS) for half in halves]
            lines.append(f"    {share}: {_rounded(halves)},")
        lines.append("}),")
    return "\n".join(lines)


def _level(pairs: Sequence[Array], share: int) -> float:
    """The percentile whose intervals hold `share` % on materials left out in turn.

    They differ more among each other than what one states says, so that it has to be more. Not of specular
    albedo: two of the sets have six times nature's, of which no fit knows, and nothing less than all would do.
    """
    for level in np.arange(share, MOST, 0.25):
        held = [
            _held(_fit([*pairs[:i], *pairs[i + 1 :]], level), pair) for i, pair in enumerate(pairs)
        ]
        if np.mean(held) >= share / 100:
            return float(level)
    return MOST


def _held(fit: tuple[list[float], list[float]], pair: Array) -> float:
    stated, halves = fit
    return float(np.mean(pair[:, 1] <= between(pair[:, 0], stated, halves)))


def _fit(pairs: Sequence[Array], level: float) -> tuple[list[float], list[float]]:
    """Medians of the fifths of stated deviations, and the percentile of errors in each."""
    pair = np.concatenate(pairs)
    parts = np.array_split(pair[np.argsort(pair[:, 0], kind="stable")], FIFTHS)
    stated = [float(np.median(part[:, 0])) for part in parts]
    return stated, _rising([part[:, 1] for part in parts], level)


def _rising(parts: Sequence[Array], level: float) -> list[float]:
    """The percentile of each part; parts for which it would fall are taken together."""
    blocks: list[list[Array]] = []
    for part in parts:
        blocks.append([part])
        while len(blocks) > 1 and _percentile(blocks[-2], level) > _percentile(blocks[-1], level):
            last = blocks.pop()
            blocks[-1] += last
    return [_percentile(block, level) for block in blocks for _ in block]


def _percentile(parts: Sequence[Array], level: float) -> float:
    return float(np.percentile(np.concatenate(parts), level))


def _slopes(found: Array, true: Array, stated: Uncertainty) -> Array:
    """(H, W, 2): of each ellipse in slope space its mean radius, and that of the one like it through the
    truth."""
    error = found[..., :2] / found[..., 2:] - true[..., :2] / true[..., 2:]
    p, q, both = np.moveaxis(stated.slopes, -1, 0)
    size = radius(stated.slopes)[..., 0]
    squared = q * error[..., 0] ** 2 - 2 * both * error[..., 0] * error[..., 1]
    squared += p * error[..., 1] ** 2
    return np.stack([size, np.sqrt(squared) / size], axis=-1)


def _rounded(values: list[float]) -> str:
    return "(" + ", ".join(f"{value:.3g}" for value in values) + ")"


def _materials(library: Path | None, fit: bool) -> Iterator[tuple[str, Callable[[], Maps]]]:
    names = (*split.VALIDATION, *split.TRAINING) if fit else split.TEST
    seeds = procedural.VALIDATION_SEEDS if fit else procedural.TEST_SEEDS
    count = FITTED if fit else CHECKED
    folders = split.folders(library, names)[:count]
    yield from ((folder.name, partial(_cropped, folder)) for folder in folders)
    for seed in seeds[: count - len(folders)]:
        yield f"seed-{seed}", partial(procedural.material, seed, CROP)


def _cropped(folder: Path) -> Maps:
    return materials.averaged(materials.load(folder), CROP, CROP)


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--materials", type=Path, help="folder of material sets")
    parser.add_argument("--fit", action="store_true")
    parser.add_argument("--draws", type=int, default=3, help="of the calibration's errors")
    parser.add_argument("--cache", type=Path, help="folder for what is measured, to go on from")
    return parser.parse_args()


if __name__ == "__main__":
    main()
