"""Train a network: `python -m svbrdf.train --materials DIR --out FILE.pt --steps N`.

The same on CPU and GPU; resumes from the file it writes. Every step renders new pictures of new mixtures
of materials, encodes them once, and decodes the running max after several counts of them.
"""

import argparse
import copy
import json
import os
import sys
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import torch
from torch import Tensor

from svbrdf import checkpoint, light_estimate, pool, procedural, renderer, scenes, split
from svbrdf.encoding import log_encoding
from svbrdf.loss import loss
from svbrdf.materials import MaterialError
from svbrdf.network import Network, State

KIND_SHARES = {"paper": 0.8, "handheld": 0.3, "flash": 1.1, "rig": 0.3, "clean": 0.2}
KNOWN = {
    "paper": scenes.Knowledge(0.5, light_deg=0.3, power=0.01),
    "handheld": scenes.Knowledge(0.6, light_deg=2, power=0.05),
    "flash": scenes.Knowledge(0.4, light_deg=1.5, power=0.05),
    "rig": scenes.Knowledge(0.8, light_deg=1, power=0.02),
    "clean": scenes.Knowledge(0.4),
}
"""How often the network is told the poses, and how wrong what it is told."""
ALONE_SHARE = 0.25
"""Of what is decoded, how much from one picture for certain, as people without a rig have."""
BELIEVING = 10.0
"""Of the learning rate, for the few numbers that say what to believe: at 1 they barely moved in an hour."""
EMA_DECAY = 0.999
_WITHOUT_BF16 = ("DEFAULT", "NO AVX", "AVX2")
LIGHT_WEIGHT = 0.1


@dataclass(frozen=True)
class Recipe:
    """One run of training."""

    steps: int
    resolution: int
    lr: float
    warmup: int
    decay: int
    """The last steps, over which the learning rate falls to a hundredth."""
    seed: int
    pictures: int
    """Encoded per step; shared among samples of 3, 6 or 12 pictures."""
    decodes: int
    """Decoded and compared per step."""
    procedural: int
    """How many procedural base materials the pool holds."""
    counts: tuple[int, ...] = (3, 3, 3, 6, 12)
    """Of pictures per sample, one of these at each step."""
    kinds: tuple[str, ...] = ("paper", "handheld", "flash", "rig")
    decoder_only: bool = False
    """Leave the encoder as it is: a step costs half, for when only what follows the max has changed."""


class TrainingError(Exception):
    """Training can't go on; the checkpoint is the last good one."""


def main() -> None:
    args = _arguments()
    recipe = Recipe(
        args.steps, args.resolution, args.lr, args.warmup, args.decay, args.seed, args.pictures,
        args.decodes, args.procedural, args.counts, args.kinds, args.decoder_only,
    )  # fmt: skip
    device = torch.device(args.device)
    torch.manual_seed(recipe.seed)
    torch.set_flush_denormal(True)
    if args.out.exists():
        config, network, ema, history = checkpoint.load(args.out)
    elif args.start:
        config, _, ema, history = checkpoint.load(args.start)
        network = copy.deepcopy(ema)
    else:
        config, history = checkpoint.CONFIGS[args.config], []
        network = Network(config)
        ema = copy.deepcopy(network)
    network = network.to(device).to(memory_format=torch.channels_last)  # type: ignore[call-overload]
    ema = ema.to(device)
    folders = split.folders(args.materials, split.TRAINING)
    seeds = procedural.TRAINING_SEEDS[: recipe.procedural]
    materials = pool.build(folders, seeds, device, os.cpu_count() or 1)
    print(f"{len(folders)} material folders, {len(seeds)} procedural, on {device}", flush=True)
    trainer = Trainer(network, ema, materials, recipe, device, not args.eager)
    done = 0
    if history and history[-1]["recipe"] == asdict(recipe):
        interrupted = history.pop()
        done, trainer.seconds = interrupted["steps"], interrupted["train_seconds"]
        trainer.rng.manual_seed(recipe.seed + done)
    while done < recipe.steps:
        chunk = min(args.save_every, recipe.steps - done)
        record = trainer.run(done, chunk)
        done += chunk
        run = {
            "recipe": asdict(recipe),
            "device": args.device,
            "folders": [f.name for f in folders],
        }
        checkpoint.save(
            args.out, config, network, ema, [*history, {**run, **record, "steps": done}]
        )
        with args.out.with_suffix(".jsonl").open("a") as log:
            log.write(json.dumps(record) + "\n")
        print(json.dumps(record), flush=True)


class Trainer:
    """The network, its running average and its optimiser."""

    def __init__(
        self,
        network: Network,
        ema: Network,
        materials: pool.MaterialPool,
        recipe: Recipe,
        device: torch.device,
        compiled: bool,
    ) -> None:
        self.network, self.ema, self.materials = network, ema, materials
        self.recipe, self.device = recipe, device
        self.rng = torch.Generator().manual_seed(recipe.seed)
        trained = network.decoder if recipe.decoder_only else network
        groups: dict[float, list[torch.nn.Parameter]] = {1.0: [], BELIEVING: []}
        for name, parameter in trained.named_parameters():
            groups[BELIEVING if "believe." in name else 1.0].append(parameter)
        self.optimizer = torch.optim.AdamW(
            [{"params": part, "share": share} for share, part in groups.items()],
            recipe.lr, betas=(0.9, 0.99), weight_decay=0.01,
        )  # fmt: skip
        self.loss, self.render, self.fuse = loss, renderer.render, _fuse
        if compiled:
            self.loss = torch.compile(loss, dynamic=False)
            self.render = torch.compile(renderer.render, dynamic=False)
            self.fuse = torch.compile(_fuse, dynamic=False)
            # not the convolutions: compiled in bf16, their gradients came out as NaN on one processor
            encoder, decoder = network.encoder, network.decoder
            encoder.entry = _forward(encoder.entry)  # type: ignore[method-assign]
            decoder.read = _forward(decoder.read)  # type: ignore[method-assign]
        self.seconds = 0.0

    def run(self, first: int, count: int) -> dict[str, float]:
        """Train for count steps from step `first`; the record has the mean loss and the throughput."""
        start, busy, total = time.perf_counter(), time.process_time(), 0.0
        for step in range(first, first + count):
            for group in self.optimizer.param_groups:
                group["lr"] = self.recipe.lr * self._schedule(step) * group["share"]
            total += self._step(step)
        elapsed = time.perf_counter() - start
        self.seconds += elapsed
        return {
            "step": first + count,
            "loss": round(total / count, 5),
            "pictures_per_s": round(count * self.recipe.pictures / elapsed, 2),
            "train_seconds": round(self.seconds, 1),
            "processor_s_per_step": round((time.process_time() - busy) / count, 4),
        }

    def _step(self, step: int) -> float:
        recipe, rng = self.recipe, self.rng
        count = recipe.counts[int(torch.randint(len(recipe.counts), (1,), generator=rng))]
        batch = recipe.pictures // count
        shares = torch.tensor([KIND_SHARES[kind] for kind in recipe.kinds])
        kind = recipe.kinds[int(torch.multinomial(shares, 1, generator=rng))]
        with torch.no_grad():
            true = self.materials.sample(batch, recipe.resolution, rng)
            shots = scenes.shots(true, count, rng, kind, self.render)
            poses = scenes.known(shots, rng, KNOWN[kind])
        inputs = self.network.config.inputs
        repeats = max(recipe.decodes // batch, 1) if inputs == 1 else 1
        keep = torch.randint(1, count + 1, (repeats, batch), generator=rng)
        keep[torch.rand(keep.shape, generator=rng) < ALONE_SHARE] = 1
        keep[-1] = count if repeats > 1 else keep[-1]
        keep = keep.to(self.device)
        with torch.autocast(self.device.type, torch.bfloat16, enabled=_has_bf16(self.device)):
            with torch.set_grad_enabled(not recipe.decoder_only):
                states = self.network.encode(shots.pictures.flatten(0, 1).contiguous(), poses)
            if inputs == 1:
                states = self.fuse(states, self.network.config.features, batch, count, keep)
            predicted = self.network.decode(states)
        target = true.map(lambda a: a.repeat(repeats, 1, 1, 1))
        pairs = scenes.rendering_pairs(repeats * batch, rng, thirds=1)
        pairs = scenes.Poses(pairs.light.to(self.device), pairs.view.to(self.device))
        value = self.loss(predicted.map(lambda a: a.contiguous()), target, pairs)
        if self.network.config.poses and not recipe.decoder_only:
            value = value + LIGHT_WEIGHT * self._light_error(shots)
        self.optimizer.zero_grad(set_to_none=True)
        value.backward()
        norm = torch.nn.utils.clip_grad_norm_(self.network.parameters(), 1.0)
        if not torch.isfinite(norm):
            raise TrainingError(
                f"The gradient of step {step} is not finite; try --eager, or a lower --lr."
            )
        self.optimizer.step()
        self._average(step)
        return float(value.detach())

    def _light_error(self, shots: scenes.Shots) -> Tensor:
        """How wrong the network's own guess of the poses is; nothing else trains that guess."""
        guess = self.network.encoder.estimate(log_encoding(shots.pictures.flatten(0, 1)))
        true = shots.poses.light.flatten(0, 1), shots.poses.view.flatten(0, 1)
        return light_estimate.error(guess, true)

    def _schedule(self, step: int) -> float:
        up = min(1.0, (step + 1) / max(self.recipe.warmup, 1))
        down = min(1.0, (self.recipe.steps - step) / max(self.recipe.decay, 1))
        return up * max(down, 0.01)

    @torch.no_grad()
    def _average(self, step: int) -> None:
        decay = min(EMA_DECAY, (step + 1) / (step + 10))
        ours = [p.detach() for p in self.ema.parameters()]
        theirs = [p.detach() for p in self.network.parameters()]
        torch._foreach_lerp_(ours, theirs, 1 - decay)


def _has_bf16(device: torch.device) -> bool:
    """Without AVX-512 a convolution in bf16 takes seven times as long as in fp32 (measured)."""
    return device.type != "cpu" or torch.backends.cpu.get_cpu_capability() not in _WITHOUT_BF16


def _forward(function: Callable[..., Any]) -> Callable[..., Any]:
    """Compiled, of what has no gradient."""
    return torch.compile(torch.no_grad()(function), dynamic=False)


def _fuse(states: State, learned: int, batch: int, count: int, keep: Tensor) -> State:
    """The max over the first keep[r, b] pictures of each sample, (repeats x batch, ...).

    Only the map's first `learned` channels have a gradient.
    """
    features, raw = states.map[:, :learned], states.map[:, learned:].detach()
    fused = (_max_of_first(part, batch, count, keep) for part in (features, raw, states.vector))
    features, raw, vector = fused
    return State(torch.cat([features, raw], dim=1), vector)


def _max_of_first(part: Tensor, batch: int, count: int, keep: Tensor) -> Tensor:
    pictures = part.unflatten(0, (batch, count))
    shape = (*keep.shape, *[1] * (part.dim() - 1))
    running = pictures[None, :, 0].expand(len(keep), *pictures[:, 0].shape)
    for i in range(1, count):
        seen = torch.maximum(running, pictures[None, :, i])
        running = torch.where((keep > i).reshape(shape), seen, running)
    return running.flatten(0, 1)


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, required=True, help="checkpoint; resumed if it exists")
    parser.add_argument(
        "--start", type=Path, help="checkpoint whose average to start from if --out is new"
    )
    parser.add_argument("--config", choices=list(checkpoint.CONFIGS), default="edge")
    parser.add_argument("--materials", type=Path, help="folder of material sets")
    parser.add_argument("--steps", type=int, required=True)
    parser.add_argument("--resolution", type=int, default=128)
    parser.add_argument("--lr", type=float, default=3e-4)
    parser.add_argument("--warmup", type=int, default=100)
    parser.add_argument("--decay", type=int, default=0)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--pictures", type=int, default=24)
    parser.add_argument("--decodes", type=int, default=8)
    parser.add_argument("--procedural", type=int, default=600)
    parser.add_argument("--save-every", type=int, default=200)
    parser.add_argument("--counts", type=_numbers, default=Recipe.counts, help="as 3,6,12")
    parser.add_argument("--kinds", type=_words, default=Recipe.kinds, help="of scenes; as clean")
    parser.add_argument("--decoder-only", action="store_true", help="leave the encoder as it is")
    parser.add_argument("--device", default="cuda" if torch.cuda.is_available() else "cpu")
    parser.add_argument("--eager", action="store_true", help="without torch.compile")
    return parser.parse_args()


def _numbers(text: str) -> tuple[int, ...]:
    return tuple(int(part) for part in text.split(","))


def _words(text: str) -> tuple[str, ...]:
    return tuple(text.split(","))


if __name__ == "__main__":
    try:
        main()
    except (checkpoint.CheckpointError, MaterialError, TrainingError) as error:
        sys.exit(str(error))
