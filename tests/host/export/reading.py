"""Exports read back into maps, with other programs' readers where there are any."""

import json
import struct
import xml.etree.ElementTree as Xml
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import numpy.typing as npt
import OpenEXR

from svbrdf.maps import Maps
from svbrdf.materials import srgb_to_linear

Array = npt.NDArray[np.float32]


def glb(data: bytes) -> tuple[dict[str, Any], Maps]:
    """The document of a glTF, and its maps as the specification has them."""
    (length,) = struct.unpack_from("<I", data, 12)
    document = json.loads(data[20 : 20 + length])
    binary = data[28 + length :]
    material = document["materials"][0]
    specular = material["extensions"]["KHR_materials_specular"]

    def texture(reference: dict[str, int]) -> Array:
        image = document["images"][document["textures"][reference["index"]]["source"]]
        view = document["bufferViews"][image["bufferView"]]
        start = view["byteOffset"]
        return decode(binary[start : start + view["byteLength"]])

    base = srgb_to_linear(texture(material["pbrMetallicRoughness"]["baseColorTexture"]))
    tint = srgb_to_linear(texture(specular["specularColorTexture"]))
    f0 = 0.04 * np.array(specular["specularColorFactor"], np.float32) * tint
    roughness = texture(material["pbrMetallicRoughness"]["metallicRoughnessTexture"])[..., 1:2]
    return document, Maps(
        unit(texture(material["normalTexture"]) * 2 - 1), diffuse(base, f0), roughness, f0
    )


def materialx(folder: Path) -> Maps:
    """The maps of an exported MaterialX folder, by what its standard surface means."""
    document = Xml.parse(folder / "material.mtlx")
    files = {
        node.get("name"): folder / str(node.find("input[@name='file']").get("value"))  # type: ignore[union-attr]
        for node in document.iter("tiledimage")
    }
    index = exr(files["specular_IOR"])
    f0 = ((index - 1) / (index + 1)) ** 2 * exr(files["specular_color"])
    return Maps(
        unit(decode(files["tangent_normal"].read_bytes()) * 2 - 1),
        diffuse(exr(files["base_color"]), f0),
        decode(files["specular_roughness"].read_bytes())[..., :1],
        f0,
    )


def decode(png: bytes) -> Array:
    """(H, W, 3) of a PNG, in [0, 1]."""
    image = cv2.imdecode(np.frombuffer(png, np.uint8), cv2.IMREAD_ANYDEPTH | cv2.IMREAD_COLOR)
    assert image is not None
    return image[..., ::-1].astype(np.float32) / np.iinfo(image.dtype).max


def exr(path: Path) -> Array:
    """(H, W, 1, 3 or 4)"""
    with OpenEXR.File(str(path)) as file:
        channels = file.channels()
        pixels = next(channels[name] for name in ("RGB", "RGBA", "Y") if name in channels).pixels
        return np.asarray(pixels.reshape(*pixels.shape[:2], -1), np.float32)


def exr_header(path: Path) -> dict[str, Any]:
    with OpenEXR.File(str(path)) as file:
        return dict(file.header())


def diffuse(base: Array, f0: Array) -> Array:
    rest = 1 - f0.max(axis=-1, keepdims=True)
    return base * rest / np.maximum(1 - f0, 1e-4)


def unit(vector: Array) -> Array:
    return vector / np.linalg.norm(vector, axis=-1, keepdims=True)
