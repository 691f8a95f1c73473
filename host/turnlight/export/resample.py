"""Maps at another resolution, such that they look the same from afar."""

import cv2
import numpy as np
import numpy.typing as npt

from svbrdf import materials
from svbrdf.maps import Maps

Array = npt.NDArray[np.float32]


def resampled(maps: Maps, width: int, height: int, *, wrap: bool = False) -> Maps:
    """The maps at width x height pixels; wrap: their edges meet.

    Smaller: `materials.reduced`. Larger: bicubic, normals as slopes.
    """
    before_height, before_width = maps.resolution
    if (height, width) == (before_height, before_width):
        return maps
    if width <= before_width and height <= before_height:
        return materials.reduced(maps, width, height)
    return _enlarged(maps, width, height, wrap)


def _enlarged(maps: Maps, width: int, height: int, wrap: bool) -> Maps:
    before_height, before_width = maps.resolution
    columns = (np.arange(width, dtype=np.float32) + 0.5) * before_width / width - 0.5
    rows = (np.arange(height, dtype=np.float32) + 0.5) * before_height / height - 0.5
    at_x, at_y = (np.ascontiguousarray(a, np.float32) for a in np.meshgrid(columns, rows))
    border = cv2.BORDER_WRAP if wrap else cv2.BORDER_REFLECT

    def cubic(image: Array) -> Array:
        large = cv2.remap(image, at_x, at_y, cv2.INTER_CUBIC, borderMode=border)
        return large.reshape(height, width, -1).astype(np.float32)

    slopes = cubic(maps.normal[..., :2] / maps.normal[..., 2:])
    normal = np.concatenate([slopes, np.ones_like(slopes[..., :1])], axis=-1)
    return Maps(
        normal=normal / np.linalg.norm(normal, axis=-1, keepdims=True),
        diffuse=np.clip(cubic(maps.diffuse), 0, 1),
        roughness=np.clip(cubic(maps.roughness), 0, 1),
        specular=np.clip(cubic(maps.specular), 0, 1),
    )
