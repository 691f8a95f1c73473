"""Targets to print true to scale: the ChArUco board, the platter, and the ball's place."""

import io
from dataclasses import dataclass

import cv2
import numpy as np
import numpy.typing as npt
from PIL import Image as PillowImage

from turnlight.calibrate.targets import Targets
from turnlight.config import RigConfig
from turnlight.picture.charuco import MARGIN_SHARE, SQUARES, board_side_mm, draw_board
from turnlight.picture.markers import draw_platter
from turnlight.picture.warp import Image

DPI = 600
A4_MM, A3_MM = (210.0, 297.0), (297.0, 420.0)
RULER_MM = 100.0
LINE_MM = 0.3


@dataclass(frozen=True)
class Sheet:
    """One page. paper: (h, w) 1 white, 0 ink, at DPI."""

    paper: npt.NDArray[np.bool_]

    def pdf(self) -> bytes:
        """To be printed at 100 %."""
        file = io.BytesIO()
        PillowImage.fromarray(self.paper).save(file, "PDF", resolution=DPI)
        return file.getvalue()


def sheets(config: RigConfig, targets: Targets) -> dict[str, Sheet]:
    """Every sheet by its name."""
    per_mm = DPI / 25.4
    platter = draw_platter(config.platter, config.platter.marker_corners_mm(), per_mm)
    square_px = round(targets.square_mm * per_mm)
    side_px = (
        (SQUARES * square_px + 2 * round(MARGIN_SHARE * square_px)) * targets.square_mm * per_mm
    )
    board = _resized(draw_board(square_px), round(side_px / square_px))
    page = A4_MM if board_side_mm(targets.square_mm) < A4_MM[0] else A3_MM
    return {
        "board": _sheet(board, page, f"ChArUco board, squares of {targets.square_mm:g} mm"),
        "platter": _sheet(
            _with_disc(platter, config.platter.radius_mm), A3_MM, f"Platter of the rig {config.name}"
        ),
        "ball": _sheet(_ball_place(config, targets), A4_MM, "Lay it where a sample lies: the ball's place"),
    }  # fmt: skip


def _sheet(drawing: Image, page_mm: tuple[float, float], title: str) -> Sheet:
    """The drawing in the page's middle, a title, and a ruler to check the printer by."""
    width, height = (round(mm * DPI / 25.4) for mm in page_mm)
    paper = np.full((height, width), 255, np.uint8)
    top, left = (height - drawing.shape[0]) // 2, (width - drawing.shape[1]) // 2
    paper[top : top + drawing.shape[0], left : left + drawing.shape[1]] = _ink(drawing)
    ruler, thick = round(RULER_MM * DPI / 25.4), round(LINE_MM * DPI / 25.4)
    start, line = (width - ruler) // 2, height - round(15 * DPI / 25.4)
    tick = round(2 * DPI / 25.4)
    paper[line : line + thick, start : start + ruler] = 0
    for end in (start, start + ruler - thick):
        paper[line - tick : line + tick, end : end + thick] = 0
    note = f"{title}; print at 100 %: this line is {RULER_MM:g} mm long"
    where = (start, line - round(4 * DPI / 25.4))
    cv2.putText(paper, note, where, cv2.FONT_HERSHEY_SIMPLEX, DPI / 500, (0,), 3, cv2.LINE_AA)
    return Sheet(paper > 127)


def _with_disc(platter: Image, radius_mm: float) -> Image:
    """The disc's outline, to cut along, around the markers."""
    per_mm, size = DPI / 25.4, len(platter)
    radius = round((radius_mm - LINE_MM) * per_mm)
    cv2.circle(platter, (size // 2, size // 2), radius, (0,), round(LINE_MM * per_mm))
    return platter


def _ball_place(config: RigConfig, targets: Targets) -> Image:
    """A sheet of the sample's size with a cross, and a ring in which the ball lies well."""
    per_mm = DPI / 25.4
    size = round(config.sample.side_mm * per_mm)
    paper = np.full((size, size), 255, np.uint8)
    thick = round(LINE_MM * per_mm)
    cv2.rectangle(paper, (0, 0), (size - 1, size - 1), (0,), thick)
    x, y = targets.ball_place_mm
    centre = round(size / 2 + x * per_mm), round(size / 2 - y * per_mm)
    cv2.circle(paper, centre, round(targets.ball_diameter_mm / 2 * per_mm), (0,), thick)
    cv2.drawMarker(paper, centre, (0,), cv2.MARKER_CROSS, round(6 * per_mm), thick)
    cv2.putText(
        paper, "up", (round(4 * per_mm), round(8 * per_mm)), cv2.FONT_HERSHEY_SIMPLEX, 3, (0,), 6
    )
    return np.asarray(paper / 255, np.float32)


def _ink(drawing: Image) -> npt.NDArray[np.uint8]:
    return np.asarray(np.rint(drawing * 255), np.uint8)


def _resized(image: Image, side_px: int) -> Image:
    result = cv2.resize(image, (side_px, side_px), interpolation=cv2.INTER_AREA)
    return np.asarray(result, np.float32)
