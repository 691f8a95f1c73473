"""The frame as a page to print."""

import io
import itertools
import re
from enum import StrEnum

from reportlab.lib.units import mm
from reportlab.pdfgen.canvas import Canvas

from turnlight.errors import ConfigError
from turnlight.picture.marked_frame import LARGEST_MM, SMALLEST_MM, MarkedFrame

RULER_MM = 100
RULER_Y_MM = 12.0
_LEADING_MM = 4.6


class Paper(StrEnum):
    A4 = "a4"
    LETTER = "letter"


_SIZES_MM = {Paper.A4: (210.0, 297.0), Paper.LETTER: (215.9, 279.4)}


def frame_of_size(text: str) -> MarkedFrame:
    """From "100x100mm", "100mm" or "10cm". Raises ConfigError."""
    found = re.fullmatch(
        r"\s*(\d+(?:\.\d+)?)(?:\s*[x×]\s*(\d+(?:\.\d+)?))?\s*(mm|cm)?\s*", text.lower()
    )
    if found is None:
        raise ConfigError(f"{text!r} is not a size; write it like 100x100mm.")
    scale = 10 if found[3] == "cm" else 1
    width = float(found[1]) * scale
    height = float(found[2]) * scale if found[2] else width
    if width != height:
        raise ConfigError(
            f"The maps are square, so the opening is; make it {min(width, height):g}mm."
        )
    if width != round(width) or not SMALLEST_MM <= width <= LARGEST_MM:
        raise ConfigError(
            f"{text} cannot be printed; the opening is {SMALLEST_MM} to {LARGEST_MM} mm, in whole "
            "millimetres."
        )
    return MarkedFrame(round(width))


def pdf(frame: MarkedFrame, paper: Paper, white: float) -> bytes:
    """One page, true to scale; the same bytes for the same arguments.

    white: the paper's reflectance, which is printed on it so that it is not forgotten.
    """
    width, height = _SIZES_MM[paper]
    file = io.BytesIO()
    page = Canvas(file, pagesize=(width * mm, height * mm), invariant=1)
    side = frame.side_mm
    page.setTitle(f"Turnlight frame {side} x {side} mm")
    page.setCreator("Turnlight")
    page.translate(width / 2 * mm, _middle_mm(frame, height) * mm)
    for value, rectangles in itertools.groupby(frame.rectangles(), lambda r: r.value):
        ink = page.beginPath()  # of one piece, so that no seam shows
        for r in rectangles:
            ink.rect(r.left * mm, r.bottom * mm, (r.right - r.left) * mm, (r.top - r.bottom) * mm)
        page.setFillGray(_srgb(value))
        page.drawPath(ink, stroke=0, fill=1)
    page.setStrokeGray(0.75)
    page.setLineWidth(0.15 * mm)
    for square in (side, frame.outer_mm):
        page.rect(-square / 2 * mm, -square / 2 * mm, square * mm, square * mm)
    white_patch = frame.patches()[0]
    size = white_patch.right - white_patch.left
    page.rect(white_patch.left * mm, white_patch.bottom * mm, size * mm, size * mm)
    _explain(page, frame, white)
    page.translate(-width / 2 * mm, -_middle_mm(frame, height) * mm)
    _ruler(page, width)
    page.showPage()
    page.save()
    return file.getvalue()


def _middle_mm(frame: MarkedFrame, height: float) -> float:
    """From the page's lower edge to the opening's middle: the frame as high as a printer reaches."""
    return height - 8 - frame.outer_mm / 2


def _explain(page: Canvas, frame: MarkedFrame, white: float) -> None:
    side = frame.side_mm
    page.setFillGray(0.35)
    page.setFont("Helvetica", 9)
    if side >= 60:
        page.drawCentredString(0, 2 * mm, "Cut this square out.")
        page.drawCentredString(0, -3 * mm, "The sample shows through here.")
    lines = [
        f"Turnlight frame {side} x {side} mm, markers {frame.ids[0]} to {frame.ids[-1]}. Reflectance of "
        f"this paper: {white:g}.",
        "Print at 100 % on matt white paper and check the ruler. Cut out the inner square and lay the",
        "frame flat on the sample. Fill the picture with the frame; flash on; another side each photo.",
    ]  # fmt: skip
    page.setFont("Helvetica", 9)
    for number, line in enumerate(lines):
        page.drawCentredString(0, -(frame.outer_mm / 2 + (number + 1) * _LEADING_MM) * mm, line)


def _ruler(page: Canvas, width: float) -> None:
    left = (width - RULER_MM) / 2
    page.setStrokeGray(0)
    page.setFillGray(0)
    page.setLineWidth(0.2 * mm)
    page.line(left * mm, RULER_Y_MM * mm, (left + RULER_MM) * mm, RULER_Y_MM * mm)
    for at in range(RULER_MM + 1):
        tick = 4 if at % 10 == 0 else 3 if at % 5 == 0 else 2
        x = (left + at) * mm
        page.line(x, RULER_Y_MM * mm, x, (RULER_Y_MM + tick) * mm)
    page.setFont("Helvetica", 7)
    for at in range(0, RULER_MM + 1, 10):
        page.drawCentredString((left + at) * mm, (RULER_Y_MM - 3) * mm, str(at))
    page.drawString((left + RULER_MM + 3) * mm, RULER_Y_MM * mm, "mm")


def _srgb(linear: float) -> float:
    return 12.92 * linear if linear <= 0.0031308 else 1.055 * linear ** (1 / 2.4) - 0.055
