"""Draw what training and evaluation wrote: `python -m svbrdf.figures --log L | --scores S, --out F.png`.

--log: a training's log; --scores: what `svbrdf.evaluate --json` printed.
"""

import argparse
import json
from pathlib import Path
from typing import Any

import matplotlib as mpl
from matplotlib.figure import Figure

PANELS = {
    "ssim": "SSIM of re-renderings",
    "ssim_fitted": "SSIM, exposure-fitted",
    "normal_deg": "normals, mean angle (degrees)",
    "diffuse_rmse": "diffuse RMSE",
    "roughness_rmse": "roughness RMSE",
    "specular_rmse": "specular RMSE",
}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    source = parser.add_mutually_exclusive_group(required=True)
    source.add_argument("--log", type=Path)
    source.add_argument("--scores", type=Path)
    parser.add_argument("--out", type=Path, required=True)
    args = parser.parse_args()
    mpl.rcParams["svg.hashsalt"] = "turnlight"
    if args.log:
        figure = training([json.loads(line) for line in args.log.read_text().splitlines()])
    else:
        figure = scores(json.loads(args.scores.read_text()))
    figure.savefig(args.out, dpi=100, metadata={"Software": None})


def training(records: list[dict[str, Any]]) -> Figure:
    """The loss over the seconds of training."""
    figure = Figure(figsize=(7, 4), layout="constrained")
    axes = figure.add_subplot()
    axes.plot([r["train_seconds"] / 60 for r in records], [r["loss"] for r in records])
    axes.set(xlabel="minutes of training", ylabel="loss, mean since the last record")
    axes.grid(alpha=0.3)
    return figure


def scores(rows: dict[str, dict[str, dict[str, float]]]) -> Figure:
    """A panel per score, over the count of pictures, a line per label."""
    figure = Figure(figsize=(12, 6.5), layout="constrained")
    panels = figure.subplots(2, 3).flat
    for axes, (key, title) in zip(panels, PANELS.items(), strict=True):
        for label, counts in rows.items():
            axes.plot(
                [int(n) for n in counts], [s[key] for s in counts.values()], ".-", label=label
            )
        axes.set(title=title, xlabel="pictures")
        axes.grid(alpha=0.3)
    figure.legend(*axes.get_legend_handles_labels(), loc="outside lower center", ncols=4)
    return figure


if __name__ == "__main__":
    main()
