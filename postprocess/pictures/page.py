"""A finished picture: panels side by side under their captions, with one colour bar and one scale bar.

What stays the same through a film is drawn once, by matplotlib; captions are set anew for each picture.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import cache
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.font_manager import FontProperties, findfont
from PIL import Image, ImageDraw, ImageFont

from postprocess.pictures.camera import Look
from postprocess.pictures.captions import Caption
from postprocess.pictures.colouring import ColourScale
from postprocess.report import figures

if TYPE_CHECKING:
    from numpy.typing import NDArray

_MARGIN = 2.6  # all in hundredths of the picture's shorter side
_TITLE, _TEXT, _SMALL = 2.5, 1.9, 1.7
_LINE = 1.4  # of a line's own height
_SMALLEST, _STEPS = 0.6, 8  # how small longer captions become, of their size and in how many steps, before they are cut
_SCALE_BAR = 0.2  # of a panel's width, at most


class Page:
    """The picture around one or more panels of one look.

    Args:
        look: Of each panel; the size is that of a picture with one panel.
        scale: What the colours mean; None for no colour bar.
        pixel: How long a pixel of a panel is at half depth [mm]; None for no scale bar.
        columns: Panels side by side.
    """

    def __init__(self, look: Look, scale: ColourScale | None, pixel: float | None, *, columns: int = 1) -> None:
        self._look = look
        self._columns = columns
        self._unit = look.unit
        self.size = page_size(look, columns)
        self._background = self._drawn(scale, pixel)

    def picture(self, panels: Sequence[NDArray[np.uint8]], captions: Sequence[Caption]) -> Image.Image:
        """One picture.

        Args:
            panels: (height, width, 3) of `Look.panel`, from the left.
            captions: Of each.
        """
        image = self._background.copy()
        pencil = ImageDraw.Draw(image)
        across, high = self._look.panel
        top = self.size[1] - self._look.foot - high
        for column, (panel, caption) in enumerate(zip(panels, captions, strict=True)):
            left = column * across
            image.paste(Image.fromarray(panel), (left, top))
            room = (across if column < self._columns - 1 else self.size[0] - left) - 2 * _MARGIN * self._unit
            self._write(pencil, left, room, caption)
        return image

    def _write(self, pencil: ImageDraw.ImageDraw, left: float, room: float, caption: Caption) -> None:
        x, y = left + _MARGIN * self._unit, 2.2 * self._unit
        rows = [
            (caption.title, _TITLE, True, figures.BLACK),
            *((line, _TEXT, False, figures.GREY) for line in caption.lines),
        ]
        for text, points, bold, colour in rows:
            said, font = fitted(text, points * self._unit, room, bold=bold)
            pencil.text((x, y), said, fill=colour, font=font)
            y += _LINE * points * self._unit

    def _drawn(self, scale: ColourScale | None, pixel: float | None) -> Image.Image:
        """What is the same in all pictures."""
        width, height = self.size
        with figures.style():
            figure = figures.blank_figure(width / 72, height / 72, dpi=72)
            if scale is not None:
                scale.draw(figure, self._look.colouring.label, self._unit, right=_MARGIN * self._unit)
            image = Image.fromarray(figures.pixels(figure))
        if pixel is not None:
            at = _MARGIN * self._unit, self.size[1] - self._look.foot / 2
            draw_scale_bar(image, at, pixel, room=self._look.panel[0], unit=self._unit)
        return image


def draw_scale_bar(image: Image.Image, at: tuple[float, float], pixel: float, *, room: float, unit: float) -> None:
    """Draws how long some millimetres are.

    Args:
        image: Where to.
        at: Left end of the bar, right and down [pixel].
        pixel: How long a pixel is [mm].
        room: Width for bar and text [pixel].
        unit: A hundredth of a picture's shorter side [pixel].
    """
    x, y = at
    length = round_length(_SCALE_BAR * room * pixel)
    pencil = ImageDraw.Draw(image)
    pencil.rectangle((x, y - 0.2 * unit, x + length / pixel, y + 0.2 * unit), fill=figures.BLACK)
    said, font = fitted(f"{length:g} mm at mid-depth", _SMALL * unit, 0.6 * room)
    pencil.text((x + length / pixel + unit, y), said, fill=figures.BLACK, font=font, anchor="lm")


def page_size(look: Look, columns: int) -> tuple[int, int]:
    """Width and height of a picture of some panels [pixel]: only the last one has room for a colour bar beside it."""
    return look.panel[0] * (columns - 1) + look.size[0], look.size[1]


def round_length(most: float) -> float:
    """The largest of 1, 2, 5, 10, … that is no longer than a length above 0, in its unit.

    Example:
        >>> round_length(37.0), round_length(0.6)
        (20.0, 0.5)
    """
    power = 10.0 ** math.floor(math.log10(most))
    return max(step * power for step in (1.0, 2.0, 5.0) if step * power <= most * (1 + 1e-9))


def fitted(text: str, size: float, room: float, *, bold: bool = False) -> tuple[str, ImageFont.FreeTypeFont]:
    """A text with the font in which it has room: smaller if need be, and cut where that would be too small.

    Args:
        text: One line; what cannot be printed becomes a question mark.
        size: Of the font, at most [pixel].
        room: Width [pixel].
        bold: Which font.

    Returns:
        The text and its font.
    """
    text = "".join(character if character.isprintable() else "?" for character in text)
    for step in range(_STEPS + 1):
        font = _font(size * (1 - (1 - _SMALLEST) * step / _STEPS), bold)
        if font.getlength(text) <= room:
            return text, font
    kept = next((k for k in range(len(text), 0, -1) if font.getlength(text[:k] + "…") <= room), 0)
    return text[:kept] + "…", font


@cache
def _font(size: float, bold: bool) -> ImageFont.FreeTypeFont:
    """DejaVu Sans, which comes with matplotlib."""
    path = findfont(FontProperties(family="DejaVu Sans", weight="bold" if bold else "normal"))
    return ImageFont.truetype(path, size)
