"""Score the shipped model: `python -m svbrdf.evaluate [--materials DIR]`.

Pictures as the paper trains on them, of materials never trained on; a table of the scores for 1, 2, 5
and 10 pictures beside the guess without a model. Without a folder, procedural materials of the split's
own seeds are used.
"""

import argparse
import json
import zlib
from collections.abc import Iterator
from dataclasses import asdict, fields
from pathlib import Path

import numpy as np
import torch

from svbrdf import materials, procedural, scenes, split
from svbrdf.maps import Maps
from svbrdf.onnx_model import OnnxModel
from svbrdf.scores import Scores, no_model, renderings, score

COUNTS = (1, 2, 5, 10)
DRAWS = 3
CROP, RESOLUTION = 512, 256
SPLITS = {
    "test": (split.TEST, procedural.TEST_SEEDS),
    "validation": (split.VALIDATION, procedural.VALIDATION_SEEDS),
}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--materials", type=Path, help="folder of material sets")
    parser.add_argument("--split", choices=list(SPLITS), default="test")
    parser.add_argument("--procedural", type=int, default=16, help="how many, without a folder")
    parser.add_argument("--model", type=Path, help="card of the model; default: the shipped one")
    parser.add_argument("--per-material", action="store_true")
    parser.add_argument("--json", action="store_true")
    args = parser.parse_args()
    model = OnnxModel(args.model)
    rows = {}
    for name, maps in _materials(args.split, args.materials, args.procedural):
        rows[name] = evaluate(model, name, maps)
        if args.per_material and not args.json:
            print(f"{name}\n{table(rows[name])}\n", flush=True)
    means = average(list(rows.values()))
    if args.json:
        print(json.dumps({key: asdict(value) for key, value in means.items()}))
    else:
        print(f"mean of {len(rows)} {args.split} materials\n{table(means)}")


def evaluate(model: OnnxModel, name: str, maps: Maps) -> dict[str, Scores]:
    """Scores by row label, averaged over DRAWS fixed sets of random scenes."""
    truth = maps.map(lambda a: torch.from_numpy(a)[None])
    shown = renderings(maps)
    draws = []
    for draw in range(DRAWS):
        rng = torch.Generator().manual_seed(zlib.crc32(f"{name} {draw}".encode()))
        pictures = scenes.pictures(truth, max(COUNTS), rng, "paper")[0]
        seen = (pictures.permute(0, 2, 3, 1).numpy() * 255).round().astype(np.uint8)
        rows, state = {}, model.empty()
        for count, picture in enumerate(seen, start=1):
            state = model.encode(state, picture)
            if count in COUNTS:
                rows[f"model, {count}"] = score(model.decode(state), maps, shown)
        linear = [(p.astype(np.float32) / 255) ** 2.2 for p in seen]
        for count in COUNTS:
            rows[f"no model, {count}"] = score(no_model(linear[:count]), maps, shown)
        draws.append(rows)
    return average(draws)


def average(rows: list[dict[str, Scores]]) -> dict[str, Scores]:
    """The mean of each score under each label."""
    return {
        label: Scores(
            **{
                f.name: float(np.mean([getattr(r[label], f.name) for r in rows]))
                for f in fields(Scores)
            }
        )
        for label in rows[0]
    }


def table(rows: dict[str, Scores]) -> str:
    head = f"{'':>14} {'SSIM':>7} {'fitted':>7} {'normal':>7} {'diffuse':>8} {'rough.':>7} {'spec.':>7}"
    lines = [
        f"{label:>14} {s.ssim:7.3f} {s.ssim_fitted:7.3f} {s.normal_deg:6.2f}° {s.diffuse_rmse:8.3f} "
        f"{s.roughness_rmse:7.3f} {s.specular_rmse:7.3f}"
        for label, s in rows.items()
    ]
    return "\n".join([head, *lines])


def _materials(name: str, library: Path | None, count: int) -> Iterator[tuple[str, Maps]]:
    names, seeds = SPLITS[name]
    folders = split.folders(library, names)
    for folder in folders:
        yield folder.name, materials.reduced(materials.load(folder), RESOLUTION, CROP)
    if not folders:
        for seed in seeds[:count]:
            yield f"seed {seed}", procedural.material(seed, RESOLUTION)


if __name__ == "__main__":
    main()
