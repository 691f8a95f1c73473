"""What a photo's EXIF says of the camera."""

import math
from dataclasses import dataclass
from datetime import datetime
from fractions import Fraction
from typing import Any

from PIL import ExifTags, Image

_FULL_FRAME_DIAGONAL_MM = 43.267
_UNIT_MM = {2: 25.4, 3: 10.0, 4: 1.0}
_INTEROP_ADOBE_RGB = "R03"


@dataclass(frozen=True)
class Metadata:
    """device: maker and model. taken: in ISO 8601, by the device's clock. The rest as EXIF has it."""

    device: str | None
    taken: str | None
    orientation: int
    adobe_rgb: bool
    focal_35mm: float | None
    focal_mm: float | None
    px_per_mm: float | None
    full_width_px: float | None

    @staticmethod
    def of(exif: Image.Exif, upright: bool = False) -> "Metadata":
        """upright: whoever decodes the pixels turns them as well."""
        camera = exif.get_ifd(ExifTags.IFD.Exif)
        interop = exif.get_ifd(ExifTags.IFD.Interop)
        maker, model = _text(exif.get(ExifTags.Base.Make)), _text(exif.get(ExifTags.Base.Model))
        if maker and model.lower().startswith(maker.lower()):
            maker = ""
        unit_mm = _UNIT_MM.get(camera.get(ExifTags.Base.FocalPlaneResolutionUnit, 2), 25.4)
        per_unit = _number(camera.get(ExifTags.Base.FocalPlaneXResolution))
        orientation = exif.get(ExifTags.Base.Orientation, 1)
        return Metadata(
            device=f"{maker} {model}".strip() or None,
            taken=_taken(camera) or _taken(exif),
            orientation=orientation if not upright and orientation in range(1, 9) else 1,
            adobe_rgb=_text(interop.get(ExifTags.Interop.InteropIndex)) == _INTEROP_ADOBE_RGB,
            focal_35mm=_number(camera.get(ExifTags.Base.FocalLengthIn35mmFilm)),
            focal_mm=_number(camera.get(ExifTags.Base.FocalLength)),
            px_per_mm=per_unit / unit_mm if per_unit else None,
            full_width_px=_number(camera.get(ExifTags.Base.ExifImageWidth)),
        )

    def focal_px(self, width: int, height: int) -> float | None:
        """In pixels of a picture of this size (not turned upright).

        From the 35 mm equivalent, which is defined by the diagonal (CIPA DCG-001), or else from the pitch
        of the pixels on the sensor, corrected for a picture that was reduced afterwards.
        """
        if self.focal_35mm:
            return self.focal_35mm / _FULL_FRAME_DIAGONAL_MM * math.hypot(width, height)
        if self.focal_mm and self.px_per_mm:
            reduced = width / self.full_width_px if self.full_width_px else 1.0
            return self.focal_mm * self.px_per_mm * reduced
        return None


def _taken(ifd: Any) -> str | None:
    text = _text(ifd.get(ExifTags.Base.DateTimeOriginal) or ifd.get(ExifTags.Base.DateTime))
    offset = _text(ifd.get(ExifTags.Base.OffsetTimeOriginal))
    for pattern, stamp in (("%Y:%m:%d %H:%M:%S%z", text + offset), ("%Y:%m:%d %H:%M:%S", text)):
        try:
            return datetime.strptime(stamp, pattern).isoformat()
        except ValueError:
            continue
    return None


def _text(value: Any) -> str:
    """Printable, short, and one line."""
    if isinstance(value, bytes):
        value = value.decode("ascii", "replace")
    if not isinstance(value, str):
        return ""
    return "".join(c for c in value.split("\0")[0] if c.isprintable()).strip()[:100]


def _number(value: Any) -> float | None:
    try:
        number = float(Fraction(value)) if isinstance(value, str) else float(value)
    except (TypeError, ValueError, ZeroDivisionError):
        return None
    return number if math.isfinite(number) and number > 0 else None
