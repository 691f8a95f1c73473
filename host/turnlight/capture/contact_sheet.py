"""The contact sheet: pictures, what the maps were after some of them, and the material relit."""

import math
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt
from PIL import Image, ImageDraw, ImageFont

from svbrdf.maps import Maps
from turnlight.capture.relight import UPPER_LEFT, relit, shown
from turnlight.picture.front_end import network_input
from turnlight.picture.picture import Picture

STEPS = (1, 2, 5, 10)
"""After how many pictures the maps are shown; the last ones always are."""

Image8 = npt.NDArray[np.uint8]
_TILE, _GAP, _GUTTER, _MARGIN, _CAPTION, _LABELS = 240, 12, 48, 64, 40, 96
_FEW, _THUMBNAIL = 10, 96
_GROUND, _TEXT, _DIM = (24, 25, 28), (236, 236, 232), (142, 144, 150)
_OTHER_LIGHTS = ((1.7, 1.7, 2.4), (1.6, -1.6, 2.0), (-2.6, -0.3, 1.2))


@dataclass
class ContactSheet:
    """Collects a capture as it goes on, and draws it.

    pictures: (n, n, 3) RGB each, as the network sees them, and small ones when they are many. history:
    maps by number of pictures.
    """

    title: str
    pictures: list[Image8] = field(default_factory=list)
    history: dict[int, Maps] = field(default_factory=dict)

    def add(self, picture: Picture, maps: Maps) -> None:
        """Note a picture and the maps after it."""
        if len(self.pictures) not in STEPS:
            self.history.pop(len(self.pictures), None)
        self.pictures.append(network_input(picture))
        if len(self.pictures) == _FEW + 1:
            self.pictures = [_thumbnail(seen) for seen in self.pictures]
        elif len(self.pictures) > _FEW:
            self.pictures[-1] = _thumbnail(self.pictures[-1])
        self.history[len(self.pictures)] = maps

    def draw(self) -> Image8:
        """(h, w, 3) RGB. At least one picture must have been added."""
        last = self.history[len(self.pictures)]
        maps = _history(self.history) if len(self.history) > 1 else _single(last)
        results = _beside(maps, _lights(last, maps.height))
        parts = [
            _header(self.title, _pictures_word(len(self.pictures)), results.width),
            _contact_strip(self.pictures, results.width),
            results,
        ]
        height = sum(p.height for p in parts) + _GUTTER * (len(parts) - 1)
        sheet = _canvas(results.width + 2 * _MARGIN, height + 2 * _MARGIN)
        top = _MARGIN
        for part in parts:
            sheet.paste(part, (_MARGIN, top))
            top += part.height + _GUTTER
        return np.asarray(sheet)


def _thumbnail(picture: Image8) -> Image8:
    return np.asarray(_resized(picture, _THUMBNAIL))


def _header(title: str, subtitle: str, width: int) -> Image.Image:
    block = _canvas(width, 64)
    pen = ImageDraw.Draw(block)
    pen.text((0, 46), title, _TEXT, _font(52), anchor="ls")
    pen.text((width, 46), subtitle, _DIM, _font(26), anchor="rs")
    return block


def _contact_strip(pictures: list[Image8], width: int) -> Image.Image:
    columns = max(6, len(pictures)) if len(pictures) <= _FEW else 20
    pitch = (width + _GAP) / columns
    side = math.ceil(pitch - _GAP)
    rows = math.ceil(len(pictures) / columns)
    block = _canvas(width, round(rows * pitch) - _GAP)
    for number, picture in enumerate(pictures):
        row, column = divmod(number, columns)
        block.paste(_resized(picture, side), (round(column * pitch), round(row * pitch)))
    return block


def _history(history: dict[int, Maps]) -> Image.Image:
    """A row of the four maps for each entry, the number of pictures before it."""
    pitch = _TILE + _GAP
    block = _canvas(_LABELS + 4 * pitch - _GAP, _CAPTION + len(history) * pitch - _GAP)
    pen = ImageDraw.Draw(block)
    for row, (count, maps) in enumerate(history.items()):
        top = _CAPTION + row * pitch
        pen.text((0, top + _TILE // 2 + 4), str(count), _TEXT, _font(44), anchor="ls")
        word = "picture" if count == 1 else "pictures"
        pen.text((0, top + _TILE // 2 + 30), word, _DIM, _font(18), anchor="ls")
        for column, (name, image) in enumerate(shown(maps).items()):
            left = _LABELS + column * pitch
            block.paste(_resized(image, _TILE), (left, top))
            if row == 0:
                _caption(pen, left, 0, name)
    return block


def _single(maps: Maps) -> Image.Image:
    """The four maps two by two, for a sheet without a history."""
    side = 2 * _TILE + _GAP - _CAPTION // 2
    block = _canvas(2 * side + _GAP, 2 * (_CAPTION + side))
    pen = ImageDraw.Draw(block)
    for number, (name, image) in enumerate(shown(maps).items()):
        row, column = divmod(number, 2)
        left, top = column * (side + _GAP), row * (_CAPTION + side)
        _caption(pen, left, top, name)
        block.paste(_resized(image, side), (left, top + _CAPTION))
    return block


def _lights(maps: Maps, height: int) -> Image.Image:
    """The material relit: large from the upper left, and small under three more lights."""
    side = (height - _CAPTION - 3 * _GAP) // 4
    hero = height - _CAPTION - _GAP - side
    block = _canvas(hero, height)
    _caption(ImageDraw.Draw(block), 0, 0, "Relit")
    block.paste(_resized(relit(maps, UPPER_LEFT), hero), (0, _CAPTION))
    for number, light in enumerate(_OTHER_LIGHTS):
        left = round(number * (hero - side) / 2)
        block.paste(_resized(relit(maps, light), side), (left, height - side))
    return block


def _beside(left: Image.Image, right: Image.Image) -> Image.Image:
    block = _canvas(left.width + _GUTTER + right.width, left.height)
    block.paste(left, (0, 0))
    block.paste(right, (left.width + _GUTTER, 0))
    return block


def _caption(pen: ImageDraw.ImageDraw, left: int, top: int, text: str) -> None:
    pen.text((left, top + _CAPTION - 14), text, _DIM, _font(22), anchor="ls")


def _canvas(width: int, height: int) -> Image.Image:
    return Image.new("RGB", (width, height), _GROUND)


def _resized(image: Image8, side: int) -> Image.Image:
    return Image.fromarray(image).resize((side, side), Image.Resampling.LANCZOS)


def _font(size: int) -> ImageFont.FreeTypeFont | ImageFont.ImageFont:
    return ImageFont.load_default(size)


def _pictures_word(count: int) -> str:
    return "1 picture" if count == 1 else f"{count} pictures"
