"""A plain folder of images: PNG of 16 bits, EXR of half floats, and the lossy conversion, labelled so."""

import json

import numpy as np
import numpy.typing as npt

from svbrdf.maps import Maps
from turnlight.export.images import exr, linear_to_srgb, png
from turnlight.export.metalness import to_base_colour
from turnlight.export.subject import Subject

Array = npt.NDArray[np.float32]
LOSSY = "basecolor_metalness_lossy"


def files(subject: Subject, height: Array | None) -> dict[str, bytes]:
    """The folder's content by name. height: (H, W, 1) in mm."""
    maps, size = subject.maps, subject.size_mm
    pitch = size[0] / maps.resolution[1] if size else None
    texts = {"turnlight": subject.provenance.as_json()}
    converted = to_base_colour(maps)
    content = subject.provenance.as_dict()
    content["size_mm"] = list(size) if size else None
    content["folders"] = {
        "png": "16-bit, linear, normals as (n + 1) / 2",
        "exr": "half floats, linear, normals as they are",
        LOSSY: "base colour (sRGB), metalness, roughness and normal; F0 is 0.04 where it is no metal",
    }
    content[LOSSY] = converted.error(maps)
    result: dict[str, bytes] = {}
    for name, image in _shown(maps).items():
        result[f"png/{name}.png"] = png(image, pitch_mm=pitch, texts=texts)
    for name, image in _named(maps).items():
        result[f"exr/{name}.exr"] = exr(image, pitch_mm=pitch, texts=texts)
    lossy = {
        "basecolor": linear_to_srgb(converted.base),
        "metalness": converted.metalness,
        "roughness": maps.roughness,
        "normal": (maps.normal + 1) / 2,
    }
    for name, image in lossy.items():
        result[f"{LOSSY}/{name}.png"] = png(image, pitch_mm=pitch, texts=texts)
    if height is not None:
        low, high = float(height.min()), float(height.max())
        content["height_mm"] = {"black": low, "white": high, "exr": "mm"}
        span = max(high - low, 1e-9)
        result["png/height.png"] = png((height - low) / span, pitch_mm=pitch, texts=texts)
        result["exr/height.exr"] = exr(height, pitch_mm=pitch, texts=texts, half=False)
    result["provenance.json"] = json.dumps(content, indent=2, ensure_ascii=False).encode()
    return result


def _named(maps: Maps) -> dict[str, Array]:
    return {
        "normal": maps.normal,
        "diffuse": maps.diffuse,
        "roughness": maps.roughness,
        "specular": maps.specular,
    }


def _shown(maps: Maps) -> dict[str, Array]:
    return _named(maps) | {"normal": (maps.normal + 1) / 2}
