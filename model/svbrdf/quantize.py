"""Quantise exported weights: `python -m svbrdf.quantize --model edge.json --out edge-int8.json`.

Convolutions alone, as QDQ with unsigned 8-bit activations and signed 8-bit weights per channel, calibrated
on pictures of training materials, of whose activations one in 100,000 may clip. What a pixel rides on
through the max, the few numbers that say where the light is, and the last convolution stay in fp32: that one
makes the maps, for which 256 steps are too coarse.
"""

import argparse
import hashlib
import json
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import onnx
import torch
from onnxruntime.quantization import (
    CalibrationDataReader,
    CalibrationMethod,
    QuantFormat,
    QuantType,
    quantize_static,
)
from onnxruntime.quantization.shape_inference import quant_pre_process

from svbrdf import procedural, scenes
from svbrdf.onnx_model import OnnxModel

_SCENES = (("paper", False), ("rig", True), ("handheld", False), ("rig", True))
SAMPLES = (
    *((procedural.material, *scene) for scene in 3 * _SCENES),
    *((procedural.mirror, *scene) for scene in 2 * (("paper", True), ("rig", True))),
)
"""What makes each material; what kind of scene it is in; whether its light is told."""
COUNT = 4
WITHIN = 99.999
"""Percent of the activations. All of them leave fewer steps for most; with 99.99 highlights clip."""
EXACT = ("encoder.estimate.", "decoder.last.")
"""Parts of the network that stay in fp32."""


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--model", type=Path, required=True, help="card of the fp32 weights")
    parser.add_argument("--out", type=Path, required=True, help="the new card, DIR/NAME.json")
    args = parser.parse_args()
    quantize(args.model, args.out)


def quantize(card_path: Path, out: Path) -> None:
    """Write NAME-encode.onnx and NAME-decode.onnx beside the new card."""
    model = OnnxModel(card_path)
    feeds: dict[str, list[dict[str, Any]]] = {"encode": [], "decode": []}
    for encode, decode in _feeds(model):
        feeds["encode"] += encode
        feeds["decode"].append(decode)
    card = {**model.card, "name": out.stem, "quantised": "QDQ, U8S8, convolutions", "sha256": {}}
    for part, fed in feeds.items():
        source = card_path.with_name(f"{card_path.stem}-{part}.onnx")
        target = out.with_name(f"{out.stem}-{part}.onnx")
        _quantize(source, target, fed)
        card["sha256"][part] = hashlib.sha256(target.read_bytes()).hexdigest()
    out.write_text(json.dumps(card, indent=1) + "\n")


class _Reader(CalibrationDataReader):  # type: ignore[misc]
    def __init__(self, feeds: list[dict[str, Any]]) -> None:
        self._feeds = iter(feeds)

    def get_next(self) -> dict[str, Any] | None:
        return next(self._feeds, None)


def _quantize(source: Path, target: Path, feeds: list[dict[str, Any]]) -> None:
    with tempfile.TemporaryDirectory() as folder:
        prepared = Path(folder) / "prepared.onnx"
        quant_pre_process(source, prepared, skip_symbolic_shape=True)
        quantize_static(
            prepared, target, _Reader(feeds), quant_format=QuantFormat.QDQ, per_channel=True,
            calibrate_method=CalibrationMethod.Percentile,
            extra_options={"CalibPercentile": WITHIN},
            op_types_to_quantize=["Conv"], activation_type=QuantType.QUInt8,
            weight_type=QuantType.QInt8, nodes_to_exclude=_exact(prepared),
        )  # fmt: skip
    model = onnx.load(target)
    model.ClearField("metadata_props")
    onnx.save(model, target)


def _exact(path: Path) -> list[str]:
    """Names of the convolutions whose weights belong to EXACT."""
    nodes = [node for node in onnx.load(path).graph.node if node.op_type == "Conv"]
    return [node.name for node in nodes if any(part in node.input[1] for part in EXACT)]


def _feeds(model: OnnxModel) -> Iterator[tuple[list[dict[str, Any]], dict[str, Any]]]:
    """Of each sample, what encode takes for each picture and what decode takes in the end."""
    for seed, (make, kind, told) in zip(procedural.TRAINING_SEEDS, SAMPLES, strict=False):
        maps, rng = make(seed, model.resolution), torch.Generator().manual_seed(seed)
        truth = maps.map(lambda a: torch.from_numpy(a)[None])
        shots = scenes.shots(truth, COUNT, rng, kind)
        state, fed = model.empty(), []
        for n in range(COUNT):
            picture = (shots.pictures[0, n].permute(1, 2, 0).numpy() * 255).round()
            known = scenes.lighting(shots, n) if told else None
            inputs = model.encode_inputs(state, picture.astype(np.uint8), known)
            fed.append(inputs)
            state = model.encode(state, picture.astype(np.uint8), known)
        yield fed, {"map": state.map, "vector": state.vector}


if __name__ == "__main__":
    main()
