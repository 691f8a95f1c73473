"""Material folders: maps on disk, in the paper's form or as base colour, metalness and roughness.

Ours are 16-bit PNG, linear, normals stored as (n + 1) / 2. Artists' sets (ambientCG, Poly Haven) have
`basecolor` in sRGB with optional `metalness`; they become diffuse = b (1 - m), F0 = lerp(0.04, b, m).
"""

from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import numpy.typing as npt

from svbrdf.maps import Maps

Array = npt.NDArray[np.float32]
DIELECTRIC_F0 = 0.04


class MaterialError(Exception):
    """A folder does not hold a material; the message says what is missing."""


def load(folder: Path) -> Maps:
    """Read a material folder into float32 maps; MaterialError says what is wrong with it."""
    if not folder.is_dir():
        raise MaterialError(f"The material folder {folder} does not exist.")
    normal = _read(folder, "normal") * 2 - 1
    roughness = _read(folder, "roughness").mean(axis=-1, keepdims=True)
    if _find(folder, "basecolor"):
        base = srgb_to_linear(_read(folder, "basecolor"))
        metal = _read(folder, "metalness")[..., :1] if _find(folder, "metalness") else 0.0
        diffuse = base * (1 - metal)
        specular = DIELECTRIC_F0 * (1 - metal) + base * metal
    else:
        diffuse, specular = _read(folder, "diffuse"), _read(folder, "specular")
    if len({a.shape[:2] for a in (normal, roughness, diffuse, specular)}) != 1:
        raise MaterialError(f"The maps in {folder} differ in size; make them all the same.")
    normal[..., 2] = np.maximum(normal[..., 2], 0.05)
    normal /= np.linalg.norm(normal, axis=-1, keepdims=True)
    return Maps(
        *(np.ascontiguousarray(a, np.float32) for a in (normal, diffuse, roughness, specular))
    )


def save(maps: Maps, folder: Path) -> None:
    """Write {normal,diffuse,roughness,specular}.png, 16-bit and linear."""
    folder.mkdir(parents=True, exist_ok=True)
    for name, png in encode(maps).items():
        (folder / f"{name}.png").write_bytes(png)


def encode(maps: Maps) -> dict[str, bytes]:
    """The four maps by name as `save` writes them: PNG, 16-bit and linear."""
    images = {
        "normal": (maps.normal + 1) / 2,
        "diffuse": maps.diffuse,
        "roughness": maps.roughness,
        "specular": maps.specular,
    }
    return {name: _png(np.asarray(image)) for name, image in images.items()}


def averaged(maps: Maps, resolution: int, crop: int | None = None) -> Maps:
    """Another material: crop the top left `crop` square (default: the largest), then average areas."""
    side = min(*maps.resolution, crop or max(maps.resolution))
    return _areas(maps.map(lambda image: image[:side, :side]), resolution, resolution)[0]


def reduced(maps: Maps, width: int, height: int) -> Maps:
    """The same material from further away, at width x height pixels; never more than it has.

    Relief that gets lost in a pixel goes on as roughness, and as less light from the diffuse part: with r
    the length of the mean of its unit normals, alpha^2 grows by 2 (1 - r), twice the variance of the
    slopes along one axis (Toksvig 2005 for Beckmann lobes, alpha^2 = 2 sigma^2), and diffuse is times r.
    """
    result, length = _areas(maps, width, height)
    alpha2 = result.roughness**4 + 2 * np.maximum(1 - length, 0)
    rougher = np.minimum(alpha2, 1) ** np.float32(0.25)
    return Maps(result.normal, result.diffuse * length, rougher, result.specular)


def _areas(maps: Maps, width: int, height: int) -> tuple[Maps, Array]:
    """Averages, the normals' of unit length again, and the length (H, W, 1) that these had."""

    def area(image: Array) -> Array:
        small = cv2.resize(image, (width, height), interpolation=cv2.INTER_AREA)
        return small.reshape(height, width, -1).astype(np.float32)

    result = maps.map(area)
    length = np.linalg.norm(result.normal, axis=-1, keepdims=True)
    return replace(result, normal=result.normal / np.maximum(length, 1e-6)), length


def srgb_to_linear(value: Array) -> Array:
    """IEC 61966-2-1 decoding of [0, 1]."""
    low = value / 12.92
    high = ((value + 0.055) / 1.055) ** 2.4
    return np.where(value <= 0.04045, low, high).astype(np.float32)


def _png(image: Array) -> bytes:
    bits = np.round(np.clip(image, 0, 1) * 65535).astype(np.uint16)
    return bytes(cv2.imencode(".png", bits[..., ::-1])[1])


def _find(folder: Path, name: str) -> Path | None:
    return next((p for s in (".png", ".jpg") if (p := folder / f"{name}{s}").exists()), None)


def _read(folder: Path, name: str) -> Array:
    path = _find(folder, name)
    if path is None:
        raise MaterialError(f"{folder} has no {name}.png or {name}.jpg, so it is not a material.")
    image = cv2.imread(str(path), cv2.IMREAD_ANYDEPTH | cv2.IMREAD_COLOR)
    if image is None:
        raise MaterialError(f"{path} is not an image that can be read.")
    scale = np.float32(65535 if image.dtype == np.uint16 else 255)
    return image[..., ::-1].astype(np.float32) / scale
