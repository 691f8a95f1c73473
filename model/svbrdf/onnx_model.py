"""The trained network as it runs in the product: two ONNX graphs, no torch.

`encode` takes a picture and the running state and returns their elementwise max; `decode` turns a state
into maps. The card beside them says what was trained on what.
"""

import hashlib
import json
from dataclasses import dataclass
from importlib import resources
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import onnxruntime

from svbrdf.lighting import Light, Lighting
from svbrdf.maps import Maps

SPIN_US = "200"
"""How long a thread waits actively: from one operation to the next, not from one picture to the next."""


class WeightsError(Exception):
    """The weights are missing or damaged; the message says which file."""


@dataclass(frozen=True)
class State:
    """The running max over pictures: arrays as the encode graph defines them."""

    map: npt.NDArray[np.float32]
    vector: npt.NDArray[np.float32]


class OnnxModel:
    """Deterministic: the same pictures in any order give the same bits."""

    def __init__(self, card_path: Path | None = None, threads: int = 2) -> None:
        """card_path: the .json beside the .onnx files; default: the shipped weights."""
        path = card_path or Path(str(resources.files("svbrdf") / "weights" / "edge.json"))
        self.card = _card(path)
        self._encode = _session(path, self.card, "encode", threads)
        self._decode = _session(path, self.card, "decode", threads)
        self._inputs = {i.name for i in self._encode.get_inputs()}
        self.resolution = int(self.card["resolution"])

    @property
    def takes_poses(self) -> bool:
        """Whether `lighting` makes a difference to this network."""
        return "known" in self._inputs

    def empty(self) -> State:
        """The state before any picture: minus infinity everywhere."""
        shapes = {i.name: i.shape for i in self._encode.get_inputs()}
        return State(
            *(np.full(shapes[name], -np.inf, np.float32) for name in ("state_map", "state_vector"))
        )

    def encode(
        self, state: State, picture: npt.NDArray[np.uint8], lighting: Lighting | None = None
    ) -> State:
        """state, or its max with a gamma-encoded (resolution, resolution, 3) RGB picture.

        lighting: where camera and lights were; its white is of the picture's resolution and scale.
        Of one sample's pictures, it should be given for all or for none.
        """
        inputs = self.encode_inputs(state, picture, lighting)
        return State(*self._encode.run(["map", "vector"], inputs))

    def encode_inputs(
        self, state: State, picture: npt.NDArray[np.uint8], lighting: Lighting | None
    ) -> dict[str, npt.NDArray[Any]]:
        """What `encode` feeds its graph."""
        inputs: dict[str, npt.NDArray[Any]] = self._poses(lighting)
        inputs |= {"picture": picture[None], "state_map": state.map, "state_vector": state.vector}
        return {name: value for name, value in inputs.items() if name in self._inputs}

    def decode(self, state: State) -> Maps:
        """Maps (resolution, resolution, ...) of a state that has seen at least one picture."""
        inputs = {"map": state.map, "vector": state.vector}
        names = ["normal", "diffuse", "roughness", "specular"]
        return Maps(*(array[0] for array in self._decode.run(names, inputs)))

    def _poses(self, lighting: Lighting | None) -> dict[str, npt.NDArray[Any]]:
        """Several lights are one to the network: their whites' sum, at their mean by brightness."""
        if lighting is None:
            above = np.array([0, 0, 2], np.float32)
            lighting = Lighting(above, (Light(above, np.ones((1, 1, 3), np.float32)),))
            known = np.zeros(1, np.float32)
        else:
            known = np.ones(1, np.float32)
        shape = (self.resolution, self.resolution, 3)
        whites = np.stack([np.broadcast_to(light.white, shape) for light in lighting.lights])
        positions = np.stack([light.position for light in lighting.lights])
        light = np.einsum(
            "n,nc->c", whites.mean(axis=(1, 2, 3)) / whites.sum(axis=0).mean(), positions
        )
        return {
            "light": light[None].astype(np.float32),
            "view": lighting.view[None].astype(np.float32),
            "white": whites.sum(axis=0)[None].astype(np.float32),
            "known": known,
        }


def _card(path: Path) -> dict[str, Any]:
    try:
        card: dict[str, Any] = json.loads(path.read_text())
    except (OSError, ValueError) as error:
        raise WeightsError(f"The model card {path} cannot be read; reinstall turnlight.") from error
    return card


def _session(
    card_path: Path, card: dict[str, Any], part: str, threads: int
) -> onnxruntime.InferenceSession:
    path = card_path.with_name(f"{card_path.stem}-{part}.onnx")
    try:
        content = path.read_bytes()
    except OSError as error:
        raise WeightsError(f"The weights {path} are missing; reinstall turnlight.") from error
    if hashlib.sha256(content).hexdigest() != card["sha256"][part]:
        raise WeightsError(f"The weights {path} differ from their card; reinstall turnlight.")
    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = threads
    options.inter_op_num_threads = 1
    options.enable_mem_pattern = False
    options.add_session_config_entry("session.intra_op.spin_duration_us", SPIN_US)
    return onnxruntime.InferenceSession(content, options, providers=["CPUExecutionProvider"])
