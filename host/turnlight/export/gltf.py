"""glTF 2.0 in one binary file: a panel as large as the sample, with the material on it.

Not a metal and not lossy: with KHR_materials_specular the base is a dielectric whose F0 is ours, metals
included. glTF weighs its base colour by 1 - max(F) where we weigh the diffuse albedo by 1 - F0 of its own
channel, so that at normal incidence base = diffuse (1 - F0) / (1 - max F0).
"""

import json
import struct
from typing import Any

import numpy as np
import numpy.typing as npt

from svbrdf.maps import Maps
from svbrdf.materials import DIELECTRIC_F0
from turnlight.errors import ExportError
from turnlight.export.images import linear_to_srgb, png
from turnlight.export.provenance import GENERATOR
from turnlight.export.subject import Subject

Array = npt.NDArray[np.float32]
_ARRAY_BUFFER, _INDEX_BUFFER = 34962, 34963
_FLOAT, _SHORT = 5126, 5123
_LINEAR, _MIPMAPS, _CLAMP, _REPEAT = 9729, 9987, 33071, 10497


def glb(subject: Subject, *, tiles: bool) -> bytes:
    """The file. The panel stands in x and y, faces +z and is in metres. Raises ExportError."""
    if subject.size_mm is None:
        raise ExportError(
            "A glTF is in metres and the folder does not say how large the sample is; "
            "add --side-mm."
        )
    width, height = (side / 1000 for side in subject.size_mm)
    binary = _Binary()
    geometry = _panel(binary, width, height)
    textures, brightest = _textures(subject.maps)
    images = [binary.image(name, content) for name, content in textures.items()]
    wrap = _REPEAT if tiles else _CLAMP
    document = {
        "asset": {
            "version": "2.0",
            "generator": GENERATOR,
            "extras": {"turnlight": subject.provenance.as_dict()},
        },
        "extensionsUsed": ["KHR_materials_specular"],
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0, "name": subject.provenance.sample}],
        "meshes": [{"primitives": [{**geometry, "material": 0}], "name": "panel"}],
        "materials": [_material(subject.provenance.sample, brightest)],
        "samplers": [{"magFilter": _LINEAR, "minFilter": _MIPMAPS, "wrapS": wrap, "wrapT": wrap}],
        "textures": [{"sampler": 0, "source": number} for number in range(len(images))],
        "images": images,
        "accessors": binary.accessors,
        "bufferViews": binary.views,
        "buffers": [{"byteLength": len(binary.content)}],
    }
    return _container(document, bytes(binary.content))


def base_colour(maps: Maps) -> Array:
    """(H, W, 3) linear, see above; what would be over 1 is cut."""
    rest = 1 - maps.specular.max(axis=-1, keepdims=True)
    return np.clip(maps.diffuse * (1 - maps.specular) / np.maximum(rest, 1e-4), 0, 1)


def _textures(maps: Maps) -> tuple[dict[str, bytes], float]:
    """The images by name, and the F0 that white in the last one stands for."""
    brightest = max(float(maps.specular.max()), DIELECTRIC_F0)
    packed = np.concatenate(
        [np.ones_like(maps.roughness), maps.roughness, np.zeros_like(maps.roughness)], axis=-1
    )
    return {
        "base colour": png(linear_to_srgb(base_colour(maps)), 8),
        "roughness": png(packed, 8),
        "normal": png((maps.normal + 1) / 2, 16),
        "specular colour": png(linear_to_srgb(maps.specular / brightest), 8),
    }, brightest


def _material(name: str, brightest: float) -> dict[str, Any]:
    return {
        "name": name,
        "pbrMetallicRoughness": {
            "baseColorTexture": {"index": 0},
            "metallicRoughnessTexture": {"index": 1},
            "metallicFactor": 0,
        },
        "normalTexture": {"index": 2},
        "extensions": {
            "KHR_materials_specular": {
                "specularColorTexture": {"index": 3},
                "specularColorFactor": [brightest / DIELECTRIC_F0] * 3,
            }
        },
    }


def _panel(binary: "_Binary", width: float, height: float) -> dict[str, Any]:
    corners = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]], np.float32)
    positions = np.zeros((4, 3), np.float32)
    positions[:, :2] = corners * np.array([width, height], np.float32) / 2
    coordinates = np.stack([(corners[:, 0] + 1) / 2, (1 - corners[:, 1]) / 2], axis=-1)
    attributes = {
        "POSITION": binary.vertices(positions, limits=True),
        "NORMAL": binary.vertices(np.tile(np.array([0, 0, 1], np.float32), (4, 1))),
        "TANGENT": binary.vertices(np.tile(np.array([1, 0, 0, 1], np.float32), (4, 1))),
        "TEXCOORD_0": binary.vertices(coordinates.astype(np.float32)),
    }
    return {"attributes": attributes, "indices": binary.indices([0, 1, 2, 0, 2, 3])}


class _Binary:
    """The binary chunk as it grows, with the tables that say what is where in it."""

    def __init__(self) -> None:
        self.content = bytearray()
        self.views: list[dict[str, Any]] = []
        self.accessors: list[dict[str, Any]] = []

    def vertices(self, values: Array, *, limits: bool = False) -> int:
        kind = {2: "VEC2", 3: "VEC3", 4: "VEC4"}[values.shape[1]]
        data = np.ascontiguousarray(values, "<f4")
        entry: dict[str, Any] = {"componentType": _FLOAT, "count": len(data), "type": kind}
        if limits:
            entry |= {"min": data.min(axis=0).tolist(), "max": data.max(axis=0).tolist()}
        return self._accessor(data.tobytes(), _ARRAY_BUFFER, entry)

    def indices(self, values: list[int]) -> int:
        entry = {"componentType": _SHORT, "count": len(values), "type": "SCALAR"}
        return self._accessor(np.array(values, "<u2").tobytes(), _INDEX_BUFFER, entry)

    def image(self, name: str, content: bytes) -> dict[str, Any]:
        return {"name": name, "mimeType": "image/png", "bufferView": self._view(content)}

    def _accessor(self, data: bytes, target: int, entry: dict[str, Any]) -> int:
        self.accessors.append({"bufferView": self._view(data, target), **entry})
        return len(self.accessors) - 1

    def _view(self, data: bytes, target: int | None = None) -> int:
        view = {"buffer": 0, "byteOffset": len(self.content), "byteLength": len(data)}
        self.views.append(view if target is None else {**view, "target": target})
        self.content += data + b"\0" * (-len(data) % 4)
        return len(self.views) - 1


def _container(document: dict[str, Any], binary: bytes) -> bytes:
    text = json.dumps(document, ensure_ascii=False, separators=(",", ":")).encode()
    text += b" " * (-len(text) % 4)
    chunks = struct.pack("<II", len(text), 0x4E4F534A) + text
    chunks += struct.pack("<II", len(binary), 0x004E4942) + binary
    return struct.pack("<III", 0x46546C67, 2, 12 + len(chunks)) + chunks
