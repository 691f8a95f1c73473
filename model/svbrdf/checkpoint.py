"""Weights on disk: small enough for a repository, enough to go on training from."""

from dataclasses import asdict
from pathlib import Path
from pickle import UnpicklingError
from typing import Any

import torch

from svbrdf.network import Network
from svbrdf.network_config import EDGE, FIVE, PAPER, NetworkConfig


class CheckpointError(Exception):
    """A file does not hold weights to go on from; the message says what to do."""


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
    """The configuration, the raw and the EMA network, and the training history; or CheckpointError."""
    try:
        return _read(path)
    except FileNotFoundError:
        raise CheckpointError(f"There is no checkpoint {path}; check its name.") from None
    except (KeyError, TypeError, RuntimeError, UnpicklingError, EOFError) as error:
        raise CheckpointError(
            f"{path} is damaged or holds a network of another version; go on from another "
            "checkpoint, or train anew without --start."
        ) from error


def _read(path: Path) -> tuple[NetworkConfig, Network, Network, list[Any]]:
    content = torch.load(path, map_location="cpu", weights_only=True)
    pairs = {name: tuple(content["config"][name]) for name in ("final", "squeeze")}
    config = NetworkConfig(**{**content["config"], **pairs})
    networks = []
    for name in ("raw", "ema"):
        network = Network(config)
        network.load_state_dict({k: v.float() for k, v in content[name].items()})
        networks.append(network)
    return config, networks[0], networks[1], content["history"]
