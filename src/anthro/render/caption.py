"""Words on film frames: time, the controller's state and the muscles' colours."""

from __future__ import annotations

from collections.abc import Mapping

import matplotlib.font_manager
import numpy as np
from PIL import Image, ImageDraw, ImageFont

INK, PAPER = "#20262C", "#FFFFFF"
STRIP_SHARE = 0.085


def strip_height(height: int) -> int:
    """Rows of a frame of that height that the caption takes; even."""
    return 2 * round(height * STRIP_SHARE / 2)


def caption(
    picture: np.ndarray, time: float, controller_on: bool, height: int, legend: Mapping[str, str]
) -> np.ndarray:
    """A picture with a strip of words below it.

    Parameters
    ----------
    picture : ndarray (h, width, 3) uint8
    time : float
        s.
    controller_on : bool
    height : int
        Of the strip, pixels.
    legend : mapping of str to str
        Words and their colours ``#rrggbb``; left out where there is no room.

    Returns
    -------
    ndarray (h + height, width, 3) uint8
    """
    width = picture.shape[1]
    strip = Image.new("RGB", (width, height), PAPER)
    draw = ImageDraw.Draw(strip)
    font = fit_font(height, width)
    middle, gap = height / 2, font.size * 0.45
    draw.line([(0, 0), (width, 0)], fill="#D5D9DC")
    x = gap * 2
    draw.text((x, middle), f"{time:5.2f} s", INK, font, anchor="lm")
    x += draw.textlength("00.00 s", font) + 3 * gap
    radius = font.size * 0.36
    # On and off differ in shape and word, not in hue alone.
    draw.ellipse(
        [x, middle - radius, x + 2 * radius, middle + radius],
        fill=INK if controller_on else PAPER,
        outline=INK,
        width=max(1, round(font.size / 8)),
    )
    x += 2 * radius + gap
    draw.text((x, middle), f"controller {'ON' if controller_on else 'OFF'}", INK, font, anchor="lm")
    x += draw.textlength("controller OFF", font) + 2 * gap
    swatch = font.size * 0.8
    widths = [swatch + gap * 0.7 + draw.textlength(group, font) + 1.6 * gap for group in legend]
    # A thumbnail has no room for the legend.
    if x + sum(widths) <= width:
        x = width - sum(widths)
        for (group, colour), step in zip(legend.items(), widths, strict=True):
            box = [x, middle - radius * 0.55, x + swatch, middle + radius * 0.55]
            draw.rectangle(box, fill=colour)
            draw.text((x + swatch + gap * 0.7, middle), group, INK, font, anchor="lm")
            x += step
    return np.concatenate([picture, np.asarray(strip)])


def fit_font(height: int, width: int) -> ImageFont.FreeTypeFont:
    """Matplotlib's default sans serif at a size that fits the strip both ways."""
    path = matplotlib.font_manager.findfont("DejaVu Sans")
    return ImageFont.truetype(path, max(6, min(round(height * 0.42), round(width / 42))))
