"""Score models: `python -m svbrdf.evaluate [--materials DIR] [--model CARD ...]`.

Pictures as the paper trains on them, of materials never trained on; a table of the scores for some counts
of pictures, with and without the poses told, beside the guess without a model. Without a folder,
procedural materials of the split's own seeds are used.
"""

import argparse
import json
import zlib
from collections.abc import Iterator, Sequence
from dataclasses import asdict, fields
from functools import partial
from pathlib import Path
from typing import Any, Protocol

import numpy as np
import numpy.typing as npt
import torch

from svbrdf import materials, procedural, rig_evaluation, scenes, split
from svbrdf.lighting import Lighting
from svbrdf.maps import Maps
from svbrdf.onnx_model import OnnxModel
from svbrdf.scores import Array, Scores, no_model, renderings, score

CROP, RESOLUTION = 512, 256
COUNTS = (1, 2, 5, 10)
RIG_MATERIALS = 12
"""With --rig: the folders, and procedural materials for the rest."""
SPLITS = {
    "test": (split.TEST, procedural.TEST_SEEDS, procedural.material),
    "validation": (split.VALIDATION, procedural.VALIDATION_SEEDS, procedural.material),
    "mirrors": ((), procedural.VALIDATION_SEEDS, procedural.mirror),
    "steep": ((), procedural.VALIDATION_SEEDS, procedural.steep),
}
"""Folders, seeds and what makes materials of these. The last two are for validation, of whose folders none is
a mirror or steep."""
Rows = dict[str, dict[int, Scores]]
"""By what made the maps, and from how many pictures."""


class Model(Protocol):
    """What is scored; its state is whatever it makes of the pictures so far."""

    card: dict[str, Any]

    @property
    def takes_poses(self) -> bool: ...
    def empty(self) -> Any: ...
    def encode(
        self, state: Any, picture: npt.NDArray[np.uint8], lighting: Lighting | None, /
    ) -> Any: ...
    def decode(self, state: Any) -> Maps: ...


def main() -> None:
    args = _arguments()
    if args.rig:
        _report(args, _on_rig(args), "simulated rig")
        return
    models = [OnnxModel(card) for card in args.model or [None]]
    rows: dict[str, Rows] = {}
    for name, maps in subjects(args.split, args.materials, args.procedural):
        rows[name] = evaluate(
            models, name, maps, args.counts or COUNTS, args.kind, args.draws, args.orders
        )
        if args.per_material and not args.json:
            print(f"{name}\n{table(rows[name])}\n", flush=True)
    _report(args, rows, args.kind)


def _report(args: argparse.Namespace, rows: dict[str, Rows], kind: str) -> None:
    means = average(list(rows.values()))
    if args.json:
        print(json.dumps({k: {n: asdict(s) for n, s in r.items()} for k, r in means.items()}))
    else:
        print(f"mean of {len(rows)} {args.split} materials, {kind} pictures\n{table(means)}")


def _on_rig(args: argparse.Namespace) -> dict[str, Rows]:
    """Through the whole simulated rig, each draw with calibration errors of its own."""
    counts = args.counts or rig_evaluation.COUNTS
    rows: dict[str, Rows] = {}
    names, seeds_of_split, make = SPLITS[args.split]
    folders = split.folders(args.materials, names)
    made = seeds_of_split[: RIG_MATERIALS - len(folders)]
    sets = [(f.name, partial(_cropped, f)) for f in folders]
    sets += [(f"seed {s}", partial(make, s, CROP)) for s in made]
    log = rig_evaluation.Log(args.log)
    for number, (name, load) in enumerate(sets):
        drawn = [
            rig_evaluation.evaluate(
                load,
                rig_evaluation.Draw(name, seed, args.resolution),
                counts,
                args.methods,
                log,
            )
            for seed in range(args.draws * number, args.draws * (number + 1))
        ]
        rows[name] = average(drawn)
        if args.per_material and not args.json:
            print(f"{name}\n{table(rows[name])}\n", flush=True)
    return rows


def _cropped(folder: Path) -> Maps:
    return materials.averaged(materials.load(folder), CROP, CROP)


def subjects(name: str, library: Path | None, count: int = 0) -> Iterator[tuple[str, Maps]]:
    """Name and maps of each set of a split; without a library, of so many procedural materials."""
    names, seeds, make = SPLITS[name]
    folders = split.folders(library, names)
    for folder in folders:
        yield folder.name, materials.averaged(materials.load(folder), RESOLUTION, CROP)
    if not folders:
        for seed in seeds[:count]:
            yield f"seed {seed}", make(seed, RESOLUTION)


def evaluate(
    models: Sequence[Model],
    name: str,
    maps: Maps,
    counts: Sequence[int] = COUNTS,
    kind: str = "paper",
    draws: int = 3,
    orders: int = 1,
) -> Rows:
    """Scores of one material, averaged over fixed sets of random scenes and orders of their pictures.

    kind: of scene, as for `scenes.shots`. With several orders, what a count of pictures is worth
    hardly depends on which came first.
    """
    truth = maps.map(lambda a: torch.from_numpy(a)[None])
    shown = renderings(maps)
    found = []
    for draw in range(draws):
        rng = torch.Generator().manual_seed(zlib.crc32(f"{name} {draw}".encode()))
        shots = scenes.shots(truth, max(counts), rng, kind)
        pictures = (shots.pictures[0].permute(0, 2, 3, 1).numpy() * 255).round().astype(np.uint8)
        known = [scenes.lighting(shots, i) for i in range(len(pictures))]
        shuffle = np.random.default_rng(draw)
        for turn in range(orders):
            order = shuffle.permutation(len(pictures)) if turn else np.arange(len(pictures))
            shuffled, lighting = pictures[order], [known[i] for i in order]
            rows: Rows = {"no model": {}}
            linear = [(p.astype(np.float32) / 255) ** 2.2 for p in shuffled[: max(counts)]]
            for count in counts:
                rows["no model"][count] = score(no_model(linear[:count]), maps, shown)
            for model in models:
                label = model.card["name"]
                rows[label] = _score(model, shuffled, None, counts, maps, shown)
                if model.takes_poses:
                    told = _score(model, shuffled, lighting, counts, maps, shown)
                    rows[f"{label} with poses"] = told
            found.append(rows)
    return average(found)


def average(rows: Sequence[Rows]) -> Rows:
    """The mean of each score under each label and count."""
    return {
        label: {
            count: Scores(
                **{
                    f.name: float(np.mean([getattr(r[label][count], f.name) for r in rows]))
                    for f in fields(Scores)
                }
            )
            for count in counts
        }
        for label, counts in rows[0].items()
    }


def table(rows: Rows) -> str:
    head = "SSIM  fitted  normal diffuse  rough.   spec."
    lines = [f"{'pictures':>25}  {head}"]
    for label, counts in rows.items():
        lines += [
            f"{label:>20} {count:4d}  {s.ssim:.3f}  {s.ssim_fitted:.3f} {s.normal_deg:6.2f}° "
            f"{s.diffuse_rmse:7.3f} {s.roughness_rmse:7.3f} {s.specular_rmse:7.3f}"
            for count, s in counts.items()
        ]
    return "\n".join(lines)


def _score(
    model: Model,
    pictures: npt.NDArray[np.uint8],
    lighting: Sequence[Lighting] | None,
    counts: Sequence[int],
    maps: Maps,
    shown: list[Array],
) -> dict[int, Scores]:
    scores, state = {}, model.empty()
    for count, picture in enumerate(pictures, start=1):
        state = model.encode(state, picture, lighting[count - 1] if lighting else None)
        if count in counts:
            scores[count] = score(model.decode(state), maps, shown)
    return scores


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--materials", type=Path, help="folder of material sets")
    parser.add_argument("--split", choices=list(SPLITS), default="test")
    parser.add_argument("--procedural", type=int, default=16, help="how many, without a folder")
    parser.add_argument(
        "--model", type=Path, action="append", help="card of a model; default: the shipped one"
    )
    parser.add_argument("--counts", type=_counts, help="of pictures, as 1,2,5 or 1-16")
    parser.add_argument("--kind", choices=["paper", "flash", "rig"], default="paper")
    parser.add_argument("--draws", type=int, default=3, help="sets of pictures per material")
    parser.add_argument("--orders", type=int, default=1, help="orders of each set")
    parser.add_argument("--rig", action="store_true", help="through the whole simulated rig")
    parser.add_argument(
        "--methods",
        type=lambda text: tuple(text.split(",")),
        default=rig_evaluation.METHODS,
        help="with --rig: which, separated by commas",
    )
    parser.add_argument("--resolution", type=int, default=RESOLUTION, help="with --rig: of maps")
    parser.add_argument(
        "--log",
        type=Path,
        help="with --rig: scores so far, as JSON lines; what is there is not redone",
    )
    parser.add_argument("--per-material", action="store_true")
    parser.add_argument("--json", action="store_true")
    return parser.parse_args()


def _counts(text: str) -> tuple[int, ...]:
    first, dash, last = text.partition("-")
    return tuple(range(int(first), int(last) + 1)) if dash else tuple(map(int, text.split(",")))


if __name__ == "__main__":
    main()
