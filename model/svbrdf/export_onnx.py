"""Export a checkpoint: `python -m svbrdf.export_onnx --checkpoint FILE.pt --out DIR/edge.json`.

Writes edge-encode.onnx and edge-decode.onnx beside the card edge.json, in fp32, opset 20, from the
running average of the weights.
"""

import argparse
import hashlib
import json
import sys
from dataclasses import asdict
from pathlib import Path
from typing import Any

import onnx
import torch
from torch import Tensor, nn

from svbrdf import checkpoint
from svbrdf.network import Network, State
from svbrdf.network_config import NetworkConfig
from svbrdf.photometric import Poses

OPSET = 20
ENCODE_INPUTS = ["picture", "light", "view", "white", "known", "state_map", "state_vector"]


class _Encode(nn.Module):
    def __init__(self, network: Network) -> None:
        super().__init__()
        self.network = network

    def forward(
        self,
        picture: Tensor,
        light: Tensor,
        view: Tensor,
        white: Tensor,
        known: Tensor,
        state_map: Tensor,
        state_vector: Tensor,
    ) -> tuple[Tensor, Tensor]:
        poses = Poses(light, view, white.permute(0, 3, 1, 2), known)
        new = self.network.encode(picture.float().permute(0, 3, 1, 2) / 255, poses)
        return torch.maximum(new.map, state_map), torch.maximum(new.vector, state_vector)


class _Decode(nn.Module):
    def __init__(self, network: Network) -> None:
        super().__init__()
        self.network = network

    def forward(self, map: Tensor, vector: Tensor) -> tuple[Tensor, Tensor, Tensor, Tensor]:
        maps = self.network.decode(State(map, vector))
        return maps.normal, maps.diffuse, maps.roughness, maps.specular


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--checkpoint", type=Path, required=True)
    parser.add_argument("--out", type=Path, required=True, help="the card, DIR/NAME.json")
    parser.add_argument("--resolution", type=int, default=256)
    args = parser.parse_args()
    config, _, network, history = checkpoint.load(args.checkpoint)
    export(config, network, history, args.resolution, args.out)


def export(
    config: NetworkConfig, network: Network, history: list[Any], resolution: int, card_path: Path
) -> None:
    """Write both graphs and their card."""
    network.eval()
    picture = torch.zeros(1, resolution, resolution, 3, dtype=torch.uint8)
    above, white = torch.tensor([[0.0, 0.0, 2.0]]), torch.ones(1, resolution, resolution, 3)
    poses = (above, above.clone(), white, torch.zeros(1))  # one tensor twice would be one input
    with torch.no_grad():
        state = network.encode(picture.float().permute(0, 3, 1, 2) / 255)
    parts = {
        "encode": (_Encode(network), (picture, *poses, *state), ENCODE_INPUTS),
        "decode": (_Decode(network), tuple(state), ["map", "vector"]),
    }
    outputs = {
        "encode": ["map", "vector"],
        "decode": ["normal", "diffuse", "roughness", "specular"],
    }
    hashes = {}
    card_path.parent.mkdir(parents=True, exist_ok=True)
    for part, (module, inputs, names) in parts.items():
        path = card_path.with_name(f"{card_path.stem}-{part}.onnx")
        torch.onnx.export(
            module.eval(), inputs, str(path), input_names=names, output_names=outputs[part],
            opset_version=OPSET, dynamo=True, external_data=False, verbose=False,
        )  # fmt: skip
        _strip(path)
        hashes[part] = hashlib.sha256(path.read_bytes()).hexdigest()
    card = {
        "name": card_path.stem,
        "method": "Deschaintre et al., Flexible SVBRDF Capture with a Multi-Image Deep Network, EGSR 2019",
        "resolution": resolution,
        "parameters": sum(p.numel() for p in network.parameters()),
        "network": asdict(config),
        "sha256": hashes,
        "training": history,
    }
    card_path.write_text(json.dumps(card, indent=1) + "\n")


def _strip(path: Path) -> None:
    """Take out what the exporter notes of this machine: paths, names of modules, lines of source."""
    model = onnx.load(path)
    for holder in (model, model.graph, *model.graph.node, *model.graph.value_info):
        holder.ClearField("metadata_props")
        holder.ClearField("doc_string")
    onnx.save(model, path)


if __name__ == "__main__":
    try:
        main()
    except checkpoint.CheckpointError as error:
        sys.exit(str(error))
