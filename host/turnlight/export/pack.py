"""Maps as `maps.js` unpacks them: quantised, each value less its left neighbour, deflated."""

import base64
import json
import zlib
from typing import Any

import numpy as np
from isal import isal_zlib

from svbrdf.maps import Maps

BITS = (14, 14, 12, 12, 12, 12, 12, 12, 12)
"""Of x and y of the normal, then diffuse, roughness and specular; albedos are coded as square roots."""
SCREEN_BITS = (12, 12, 8, 8, 8, 10, 8, 8, 8)
"""Enough for a relit view that is within 2/255 of the exact one."""


def packed(maps: Maps) -> dict[str, Any]:
    """For JSON: width, height, bits, and the planes' low and high bytes, deflated, in base64.

    Takes a second for maps of 256 x 256; for a file that is mailed.
    """
    deflated = zlib.compress(_planes(maps, BITS), 9)
    return _head(maps, BITS) | {"data": base64.b64encode(deflated).decode()}


def packed_for_a_screen(maps: Maps) -> bytes:
    """A line of JSON, then the deflated bytes: in a thirtieth of that time, three fifths of the size."""
    head = json.dumps(_head(maps, SCREEN_BITS)).encode()
    return head + b"\n" + isal_zlib.compress(_planes(maps, SCREEN_BITS), 1)


def _head(maps: Maps, bits: tuple[int, ...]) -> dict[str, Any]:
    height, width = maps.resolution
    return {"width": width, "height": height, "bits": bits}


def _planes(maps: Maps, bits: tuple[int, ...]) -> bytes:
    shares = [(maps.normal[..., :2] + 1) / 2, np.sqrt(maps.diffuse), maps.roughness]
    planes = np.concatenate([*shares, np.sqrt(maps.specular)], axis=-1)
    full = 2 ** np.array(bits, np.float32) - 1
    values = np.rint(np.clip(planes, 0, 1) * full).astype(np.uint16)
    steps = np.moveaxis(np.diff(values, axis=1, prepend=np.uint16(0)), -1, 0)
    return b"".join(
        (step & 255).astype(np.uint8).tobytes() + (step >> 8).astype(np.uint8).tobytes()
        for step in steps
    )
