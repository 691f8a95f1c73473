"""From a file's values to linear light in sRGB's primaries, as its colour profile says.

Profiles of a matrix and three curves (ICC.1:2022, 8.3.2), which is what cameras and phones write: sRGB,
Display P3, Adobe RGB, ProPhoto and their like.
"""

import struct
from dataclasses import dataclass

import cv2
import numpy as np
import numpy.typing as npt

STEPS = 65536
"""Of a curve: every value of 16 bits, and every 257th one of 8 bits."""
_NEGLIGIBLE = 2e-3

Curve = npt.NDArray[np.float32]
"""(STEPS,) linear light by coded value, both from 0 to 1."""
Matrix = npt.NDArray[np.float64]


class ProfileError(Exception):
    """The profile is damaged, or of another kind."""


@dataclass(frozen=True)
class Colour:
    """curves: of the channels. to_d50: (3, 3), from the file's linear RGB to XYZ as profiles have it."""

    curves: tuple[Curve, Curve, Curve]
    to_d50: Matrix

    def linear(self, bits: npt.NDArray[np.unsignedinteger]) -> npt.NDArray[np.float32]:
        """(h, w, 3) of a file's values, 8 or 16 bits, in linear light and sRGB's primaries."""
        step = (STEPS - 1) // np.iinfo(bits.dtype).max
        tables = np.stack([curve[::step] for curve in self.curves], axis=-1)[None]
        light = np.asarray(cv2.LUT(np.ascontiguousarray(bits), tables), np.float32)
        to_srgb = np.linalg.solve(SRGB.to_d50, self.to_d50)
        if np.allclose(to_srgb, np.eye(3), atol=_NEGLIGIBLE):
            return light
        return np.asarray(cv2.transform(light, to_srgb), np.float32)


def read_profile(profile: bytes) -> Colour:
    """Raises ProfileError."""
    try:
        if profile[16:20] != b"RGB " or profile[20:24] != b"XYZ ":
            raise ProfileError
        (count,) = struct.unpack_from(">I", profile, 128)
        tags = {}
        for number in range(min(count, 100)):
            name, at, size = struct.unpack_from(">4sII", profile, 132 + 12 * number)
            tags[name] = profile[at : at + size]
        primaries = [_xyz(tags[name]) for name in (b"rXYZ", b"gXYZ", b"bXYZ")]
        red, green, blue = (_curve(tags[name]) for name in (b"rTRC", b"gTRC", b"bTRC"))
    except (struct.error, KeyError) as error:
        raise ProfileError from error
    to_d50 = np.array(primaries).T
    if abs(np.linalg.det(to_d50)) < 1e-3:
        raise ProfileError
    return Colour((red, green, blue), to_d50)


def of_gamma(gamma: float) -> Colour:
    """sRGB's primaries with a plain power as curve."""
    return _known(_power(_STEPS, gamma), SRGB.to_d50.tolist())


def _xyz(tag: bytes) -> list[float]:
    if tag[:4] != b"XYZ ":
        raise ProfileError
    return [value / 65536 for value in struct.unpack_from(">3i", tag, 8)]


def _curve(tag: bytes) -> Curve:
    """curveType or parametricCurveType (ICC.1:2022, 10.6 and 10.18)."""
    coded = np.linspace(0, 1, STEPS)
    if tag[:4] == b"curv":
        (count,) = struct.unpack_from(">I", tag, 8)
        if count == 0:
            return coded.astype(np.float32)
        values = struct.unpack_from(f">{min(count, STEPS)}H", tag, 12)
        if count == 1:
            return _power(coded, values[0] / 256)
        table = np.array(values) / 65535
        return np.interp(coded, np.linspace(0, 1, len(table)), table).astype(np.float32)
    if tag[:4] == b"para":
        (kind,) = struct.unpack_from(">H", tag, 8)
        if kind not in _PARAMETERS:
            raise ProfileError
        given = [v / 65536 for v in struct.unpack_from(f">{_PARAMETERS[kind]}i", tag, 12)]
        return _parametric(coded, kind, given)
    raise ProfileError


_PARAMETERS = {0: 1, 1: 3, 2: 4, 3: 5, 4: 7}


def _parametric(coded: npt.NDArray[np.float64], kind: int, given: list[float]) -> Curve:
    gamma, a, b, c, d, e, f = given + [0.0] * (7 - len(given))
    if kind == 0:
        return _power(coded, gamma)
    if kind in (1, 2):  # below -b/a the constant c, which 1 does not have
        offset = c if kind == 2 else 0.0
        c, d, e, f = 0.0, -b / a if a else 0.0, offset, offset
    curved = np.maximum(a * coded + b, 0) ** gamma + e
    return np.where(coded >= d, curved, c * coded + f).clip(0, 1).astype(np.float32)


def _power(coded: npt.NDArray[np.float64], gamma: float) -> Curve:
    return np.asarray(coded**gamma, np.float32)


def _known(gamma: Curve, columns: list[list[float]]) -> Colour:
    return Colour((gamma, gamma, gamma), np.array(columns))


_STEPS = np.linspace(0, 1, STEPS)
_SRGB_CURVE = _parametric(_STEPS, 3, [2.4, 1 / 1.055, 0.055 / 1.055, 1 / 12.92, 0.04045])

SRGB = _known(
    _SRGB_CURVE,
    [
        [0.4360747, 0.3850649, 0.1430804],
        [0.2225045, 0.7168786, 0.0606169],
        [0.0139322, 0.0971045, 0.7141733],
    ],
)
LINEAR_SRGB = _known(_STEPS.astype(np.float32), SRGB.to_d50.tolist())
DISPLAY_P3 = _known(
    _SRGB_CURVE,
    [
        [0.5151187, 0.2919778, 0.1571035],
        [0.2411892, 0.6922441, 0.0665668],
        [-0.0010505, 0.0418791, 0.7840713],
    ],
)
ADOBE_RGB = _known(
    _power(_STEPS, 563 / 256),
    [
        [0.6097559, 0.2052401, 0.1492240],
        [0.3111242, 0.6256560, 0.0632197],
        [0.0194811, 0.0608902, 0.7448387],
    ],
)
