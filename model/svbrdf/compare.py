"""What else could have been trained: `python -m svbrdf.compare --materials DIR --out DIR --minutes 120`.

Ours, ours without the perturbations of training pictures, with five fixed inputs, with one picture whose
maps are averaged, and the published network: each from nothing on the same processor time, then scored on
the same pictures of the test materials, without poses. Deschaintre et al., EGSR 2019, sections 5.1 and
5.3, compare the same. A run that was cut off goes on when started again.
"""

import argparse
import json
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import torch

from svbrdf import checkpoint, evaluate
from svbrdf.lighting import Lighting
from svbrdf.maps import Maps
from svbrdf.network import Network

OPTIONS = {
    "edge": "",
    "unperturbed": "--kinds clean",
    "five": "--config five --counts 5 --pictures 20",
    "single": "--counts 1 --pictures 8",
    "paper": "--config paper --resolution 256 --counts 3 --pictures 3 --decodes 3 --eager",
}
"""Of `svbrdf.train`. The published network has eight levels, for which 128 pixels are too few."""


@dataclass(frozen=True)
class Pictures:
    """Those seen so far: what stands for a network's state here."""

    seen: tuple[npt.NDArray[np.uint8], ...] = ()


class Trained:
    """A network as trained, in the place of an exported one; it is not told the poses."""

    takes_poses = False

    def __init__(self, name: str, network: Network, averaged: bool = False) -> None:
        """averaged: the maps of each picture by itself, and their mean."""
        self.card: dict[str, Any] = {"name": name}
        self._network = network.eval()
        self._averaged = averaged

    def empty(self) -> Pictures:
        return Pictures()

    def encode(
        self, state: Pictures, picture: npt.NDArray[np.uint8], _lighting: Lighting | None
    ) -> Pictures:
        return Pictures((*state.seen, picture))

    @torch.no_grad()
    def decode(self, state: Pictures) -> Maps:
        """A network of five takes each picture several times where there are fewer."""
        count, inputs = len(state.seen), self._network.config.inputs
        taken = [state.seen[i % count] for i in range(-(-count // inputs) * inputs)]
        pictures = torch.from_numpy(np.stack(taken)).permute(0, 3, 1, 2).float() / 255
        maps = self._network(pictures[:, None] if self._averaged else pictures[None])
        mean = maps.map(lambda a: a.mean(dim=0).numpy())
        length = np.linalg.norm(mean.normal, axis=-1, keepdims=True)
        return Maps(mean.normal / length, mean.diffuse, mean.roughness, mean.specular)


def main() -> None:
    args = _arguments()
    trained = []
    for name in args.only:
        path = args.out / f"{name}.pt"
        train(path, [*OPTIONS[name].split(), "--materials", str(args.materials)], args.minutes)
        trained.append(Trained(name, checkpoint.load(path)[2], averaged=name == "single"))
    rows = [
        evaluate.evaluate(trained, name, maps)
        for name, maps in evaluate.subjects("test", args.materials)
    ]
    print(f"mean of {len(rows)} test materials, {args.minutes:g} minutes of processor time each")
    print(evaluate.table(evaluate.average(rows)))


def train(out: Path, options: list[str], minutes: float) -> None:
    """Write out, the checkpoint, after as many steps as those minutes hold; resumed if it is there.

    How long a step takes is measured first, and kept beside out.
    """
    plan = out.with_suffix(".plan.json")
    if not plan.exists():
        trial = out.with_suffix(".trial.pt")
        _run(trial, options, ["--steps", "16", "--save-every", "8"])
        record = json.loads(trial.with_suffix(".jsonl").read_text().splitlines()[-1])
        plan.write_text(json.dumps({"processor_s_per_step": record["processor_s_per_step"]}))
    steps = int(60 * minutes / json.loads(plan.read_text())["processor_s_per_step"])
    if out.exists() and checkpoint.load(out)[3][-1]["steps"] == steps:
        return
    _run(out, options, ["--steps", str(steps), "--decay", str(steps // 2), "--save-every", "50"])


def _run(out: Path, options: list[str], length: list[str]) -> None:
    command = [sys.executable, "-m", "svbrdf.train", "--out", str(out), *options, *length]
    print(" ".join(command[1:]), flush=True)
    subprocess.run(command, check=True)


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--materials", type=Path, required=True, help="folder of material sets")
    parser.add_argument("--out", type=Path, required=True, help="folder of checkpoints")
    parser.add_argument("--minutes", type=float, default=120, help="of processor time, for each")
    parser.add_argument("--only", nargs="+", choices=OPTIONS, default=list(OPTIONS))
    return parser.parse_args()


if __name__ == "__main__":
    main()
