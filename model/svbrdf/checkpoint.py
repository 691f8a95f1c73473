"""Weights on disk: small enough for a repository, enough to go on training from."""

from dataclasses import asdict
from pathlib import Path
from typing import Any

import torch

from svbrdf.network import Network
from svbrdf.network_config import EDGE, FIVE, PAPER, NetworkConfig

CONFIGS = {"edge": EDGE, "five": FIVE, "paper": PAPER}


def save(path: Path, config: NetworkConfig, raw: Network, ema: Network, history: list[Any]) -> None:
    """Write raw and EMA weights as float16 with the training history; replaced atomically."""
    content = {
        "config": asdict(config),
        "raw": {name: value.half() for name, value in raw.state_dict().items()},
        "ema": {name: value.half() for name, value in ema.state_dict().items()},
        "history": history,
    }
    path.parent.mkdir(parents=True, exist_ok=True)
    partial = path.with_suffix(".partial")
    torch.save(content, partial)
    partial.replace(path)


def load(path: Path) -> tuple[NetworkConfig, Network, Network, list[Any]]:
    """The configuration, the raw and the EMA network, and the training history."""
    content = torch.load(path, map_location="cpu", weights_only=True)
    pairs = {name: tuple(content["config"][name]) for name in ("final", "squeeze")}
    config = NetworkConfig(**{**content["config"], **pairs})
    networks = []
    for name in ("raw", "ema"):
        network = Network(config)
        network.load_state_dict({k: v.float() for k, v in content[name].items()})
        networks.append(network)
    return config, networks[0], networks[1], content["history"]
