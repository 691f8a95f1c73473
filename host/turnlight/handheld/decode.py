"""The process that decodes one photo: `python -m turnlight.handheld.decode FILE [GAMMA]`, for `read_photo`.

What comes in may be hostile and the decoders are large, so they run here, with the memory that an honest
photo needs and no more. Out goes a line of JSON, {"refused": why} or size and metadata; then the pixels as
float32 linear RGB and the clipped ones as bool, row by row.
"""

import json
import os
import resource
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import numpy.typing as npt
import pi_heif
import rawpy
from PIL import Image

from turnlight.handheld import icc
from turnlight.handheld.exif import Metadata
from turnlight.handheld.kind import Kind, NotAPhotoError, kind_of

MOST_PIXELS = 64_000_000
SMALLEST_PX = 16
MEMORY_BYTES = 960_000_000
CLIPPED = 254 / 255
"""Share of full scale from which a value counts as clipped: JPEG rings."""
_STRIP_ROWS = 256
_DNG_VERSION = 50706
_DAMAGED = "is damaged; copy it again or take another."
_P3_PRIMARIES, _HDR_TRANSFERS = 12, (16, 18)
"""In ITU-T H.273: SMPTE EG 432-1; PQ and HLG."""


@dataclass(frozen=True)
class Decoded:
    """bits: (h, w, 3) RGB as the file has them."""

    bits: npt.NDArray[np.unsignedinteger]
    colour: icc.Colour
    metadata: Metadata

    @property
    def upright(self) -> npt.NDArray[np.unsignedinteger]:
        """As EXIF's orientation asks, without a copy."""
        orientation = self.metadata.orientation
        bits = self.bits.transpose(1, 0, 2) if orientation >= 5 else self.bits
        rows = slice(None, None, -1 if orientation in (3, 4, 7, 8) else 1)
        columns = slice(None, None, -1 if orientation in (2, 3, 6, 7) else 1)
        return bits[rows, columns]


def main() -> None:
    """Decode the file that is named on the command line."""
    resource.setrlimit(resource.RLIMIT_DATA, (MEMORY_BYTES, MEMORY_BYTES))
    untagged = icc.of_gamma(float(sys.argv[2])) if sys.argv[2:] else icc.SRGB
    try:
        photo = decoded(Path(sys.argv[1]), untagged)
    except NotAPhotoError as refusal:
        _tell({"refused": str(refusal)})
    except MemoryError:
        _tell({"refused": "needs more memory than a photo may; save it as JPEG."})
    except Exception:  # whatever a decoder makes of a hostile file
        _tell({"refused": _DAMAGED})
    else:
        _send(photo)


def decoded(path: Path, untagged: icc.Colour = icc.SRGB) -> Decoded:
    """Raises NotAPhotoError, or whatever a decoder raises.

    untagged: what JPEG, PNG and TIFF are coded in that do not say it.
    """
    kind = kind_of(path)
    if kind is Kind.HEIC:
        return _heic(path)
    if kind is Kind.TIFF and _DNG_VERSION in _tags(path):
        return _dng(path)
    return _coded(path, untagged)


def _coded(path: Path, untagged: icc.Colour) -> Decoded:
    """JPEG, PNG and TIFF: Pillow reads what is said of the pixels; OpenCV keeps all 16 bits of them."""
    Image.MAX_IMAGE_PIXELS = None
    with Image.open(path) as image:
        _check_size(*image.size)
        if image.mode not in ("RGB", "RGBA", "RGBX", "L", "LA", "P", "1", "I;16", "I;16B", "I"):
            raise NotAPhotoError(f"is {image.mode}, not RGB; save it as RGB with 8 or 16 bits.")
        metadata = Metadata.of(image.getexif())
        profile = image.info.get("icc_profile")
        size = image.size
    flags = cv2.IMREAD_COLOR | cv2.IMREAD_ANYDEPTH | cv2.IMREAD_IGNORE_ORIENTATION
    bits = cv2.imread(str(path), flags)
    if bits is None or bits.shape[1::-1] != size:
        raise NotAPhotoError(_DAMAGED)
    if bits.dtype not in (np.uint8, np.uint16):
        raise NotAPhotoError(f"holds {bits.dtype} values; save it with 8 or 16 bits.")
    default = icc.ADOBE_RGB if metadata.adobe_rgb else untagged
    return Decoded(np.asarray(bits[..., ::-1]), _colour(profile, default), metadata)


def _heic(path: Path) -> Decoded:
    """libheif turns it upright itself, whatever EXIF says."""
    file = pi_heif.open_heif(path, convert_hdr_to_8bit=False)
    said, info = file.size, file.info
    _check_size(*said)
    exif = Image.Exif()
    exif.load(info["exif"] or b"")
    coding = info.get("nclx_profile") or {}
    if coding.get("transfer_characteristics") in _HDR_TRANSFERS:
        raise NotAPhotoError("is coded as HDR; switch HDR off, or save it as JPEG.")
    default = icc.DISPLAY_P3 if coding.get("color_primaries") == _P3_PRIMARIES else icc.SRGB
    colour = _colour(info.get("icc_profile"), default)
    bits = np.array(file)  # the buffer goes with the file
    if (bits.shape[1], bits.shape[0]) != said:
        raise NotAPhotoError("lies about its size; save it anew as JPEG.")
    bits = bits[..., :3] if bits.ndim == 3 else np.repeat(bits[..., None], 3, axis=-1)
    return Decoded(bits, colour, Metadata.of(exif, upright=True))


def _dng(path: Path) -> Decoded:
    """LibRaw develops it, linear, with the camera's white balance, upright."""
    with rawpy.imread(str(path)) as raw:
        _check_size(raw.sizes.width, raw.sizes.height)
        bits = raw.postprocess(gamma=(1, 1), no_auto_bright=True, use_camera_wb=True, output_bps=16)
    return Decoded(bits, icc.LINEAR_SRGB, Metadata.of(_tags(path), upright=True))


def _tags(path: Path) -> Image.Exif:
    tags = Image.Exif()
    with path.open("rb") as file:
        tags.load_from_fp(file)
        tags.get_ifd(0x8769)  # while the file is open
    return tags


def _check_size(width: int, height: int) -> None:
    if width * height > MOST_PIXELS:
        raise NotAPhotoError(
            f"has {width}x{height} pixels, more than the limit of {MOST_PIXELS // 1_000_000} million; "
            "set the camera to fewer."
        )
    if min(width, height) < SMALLEST_PX:
        raise NotAPhotoError(f"has only {width}x{height} pixels; take a larger photo.")


def _colour(profile: bytes | None, default: icc.Colour) -> icc.Colour:
    if not profile:
        return default
    try:
        return icc.read_profile(profile)
    except icc.ProfileError as error:
        raise NotAPhotoError(
            "has a colour profile that is not of a camera or a screen; save it as sRGB."
        ) from error


def _send(photo: Decoded) -> None:
    bits = photo.upright
    metadata = photo.metadata
    _tell(
        {
            "height": bits.shape[0],
            "width": bits.shape[1],
            "focal_px": metadata.focal_px(photo.bits.shape[1], photo.bits.shape[0]),
            "device": metadata.device,
            "taken": metadata.taken,
        }
    )
    strips = [bits[row : row + _STRIP_ROWS] for row in range(0, len(bits), _STRIP_ROWS)]
    with os.fdopen(os.dup(sys.stdout.fileno()), "wb") as out:
        for strip in strips:
            out.write(photo.colour.linear(strip).data)
        for strip in strips:
            out.write(np.ascontiguousarray(_clipped(strip)).data)


def _clipped(bits: npt.NDArray[np.unsignedinteger]) -> npt.NDArray[np.bool_]:
    full = CLIPPED * np.iinfo(bits.dtype).max
    return np.logical_or.reduce([bits[..., channel] >= full for channel in range(3)])


def _tell(what: dict[str, Any]) -> None:
    sys.stdout.write(json.dumps(what) + "\n")
    sys.stdout.flush()


if __name__ == "__main__":
    main()
