"""MaterialX: a standard surface in a .mtlx file, with its images beside it.

F0 becomes an index of refraction, (1 + sqrt F0) / (1 - sqrt F0) of its brightest channel, and a tint; the
base colour is glTF's. Both are exact at normal incidence, for metals too.
"""

from xml.etree import ElementTree as Xml

import numpy as np
import numpy.typing as npt

from svbrdf.maps import Maps
from turnlight.export.gltf import base_colour
from turnlight.export.images import exr, png
from turnlight.export.provenance import GENERATOR
from turnlight.export.subject import Subject

Array = npt.NDArray[np.float32]
GREATEST_F0 = 0.999
_INPUTS = {
    "base_color": ("color3", "base_color.exr"),
    "specular_color": ("color3", "specular_color.exr"),
    "specular_IOR": ("float", "specular_ior.exr"),
    "specular_roughness": ("float", "roughness.png"),
}


def files(subject: Subject, height: Array | None) -> dict[str, bytes]:
    """The folder's content by name. height: (H, W, 1) in mm, if it is to be displaced."""
    size = subject.size_mm
    pitch = size[0] / subject.maps.resolution[1] if size else None
    texts = {"turnlight": subject.provenance.as_json()}
    images = {
        **{name: exr(image, pitch_mm=pitch) for name, image in _lobes(subject.maps).items()},
        "roughness.png": png(subject.maps.roughness, pitch_mm=pitch),
        "normal.png": png((subject.maps.normal + 1) / 2, pitch_mm=pitch),
    }
    if height is not None:
        images["height.exr"] = exr(height, pitch_mm=pitch, half=False)
    document = _document(subject.provenance.sample, size, height is not None)
    return {
        "material.mtlx": document,
        "provenance.json": texts["turnlight"].encode(),
        **{f"textures/{name}": content for name, content in images.items()},
    }


def _lobes(maps: Maps) -> dict[str, Array]:
    brightest = maps.specular.max(axis=-1, keepdims=True)
    tint = np.where(brightest > 0, maps.specular / np.maximum(brightest, 1e-6), 1)
    root = np.sqrt(np.minimum(brightest, GREATEST_F0))
    return {
        "base_color.exr": base_colour(maps),
        "specular_color.exr": tint,
        "specular_ior.exr": (1 + root) / (1 - root),
    }


def _document(sample: str, size_mm: tuple[float, float] | None, displaced: bool) -> bytes:
    root = Xml.Element("materialx", version="1.39", colorspace="lin_rec709")
    root.set("doc", f"{sample}, by {GENERATOR}; see provenance.json")
    graph = Xml.SubElement(root, "nodegraph", name="maps")
    for name, (kind, file) in _INPUTS.items():
        _image(graph, name, kind, file, size_mm)
        _output(graph, name, kind)
    _image(graph, "tangent_normal", "vector3", "normal.png", size_mm)
    normal = Xml.SubElement(graph, "normalmap", name="normal", type="vector3")
    Xml.SubElement(normal, "input", name="in", type="vector3", nodename="tangent_normal")
    _output(graph, "normal", "vector3")
    surface = Xml.SubElement(
        root, "standard_surface", name="surface", type="surfaceshader", version="1.0.1"
    )
    _value(surface, "base", "float", "1")
    _value(surface, "specular", "float", "1")
    for name, (kind, _) in _INPUTS.items():
        _connection(surface, name, kind)
    _connection(surface, "normal", "vector3")
    material = Xml.SubElement(root, "surfacematerial", name="material", type="material")
    Xml.SubElement(
        material, "input", name="surfaceshader", type="surfaceshader", nodename="surface"
    )
    if displaced:
        _image(graph, "height", "float", "height.exr", size_mm)
        _output(graph, "height", "float")
        shader = Xml.SubElement(root, "displacement", name="relief", type="displacementshader")
        _connection(shader, "displacement", "float", "height")
        Xml.SubElement(
            material,
            "input",
            name="displacementshader",
            type="displacementshader",
            nodename="relief",
        )
    Xml.indent(root)
    return Xml.tostring(root, encoding="utf-8", xml_declaration=True)


def _image(
    graph: Xml.Element, name: str, kind: str, file: str, size_mm: tuple[float, float] | None
) -> None:
    """An image, and how large it is in the world: one turn of u and v spans it."""
    node = Xml.SubElement(graph, "tiledimage", name=name, type=kind)
    Xml.SubElement(node, "input", name="file", type="filename", value=f"textures/{file}")
    if size_mm:
        for side in ("realworldimagesize", "realworldtilesize"):
            value = f"{size_mm[0]:g}, {size_mm[1]:g}"
            attributes = {"unittype": "distance", "unit": "millimeter"}
            Xml.SubElement(node, "input", attributes, name=side, type="vector2", value=value)


def _output(graph: Xml.Element, name: str, kind: str) -> None:
    Xml.SubElement(graph, "output", name=f"{name}_out", type=kind, nodename=name)


def _connection(shader: Xml.Element, name: str, kind: str, source: str | None = None) -> None:
    attributes = {"nodegraph": "maps", "output": f"{source or name}_out"}
    Xml.SubElement(shader, "input", attributes, name=name, type=kind)


def _value(shader: Xml.Element, name: str, kind: str, value: str) -> None:
    Xml.SubElement(shader, "input", name=name, type=kind, value=value)
