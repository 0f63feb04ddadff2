"""Frames of a demo side by side, each under its letter, its time and the controller's state."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import matplotlib.font_manager
import numpy as np
from PIL import Image, ImageDraw, ImageFont

from anthro.render.raytrace import render
from anthro.render.rollout import Rollout, read_rollout
from anthro.render.stage import Stage

LETTERS = "abcdefghijkl"
INK, PAPER = "#202020", "#FFFFFF"
GAP = 6  # pixels between frames
LABEL_SHARE = 0.09  # of a frame's height that its label takes


def strip(
    run: Path, demo: str, times: Sequence[float], width: int, height: int, azimuth: float | None = None
) -> np.ndarray:
    """Draw some instants of a demo's rollout.

    Parameters
    ----------
    run : Path
        The run's folder; ``demos/<demo>/rollout.h5`` in it is read.
    demo : str
    times : sequence of float
        s, at most 12 of them.
    width, height : int
        Pixels of each frame, its label included.
    azimuth : float, optional
        Degrees, as in `anthro.render.camera.view_direction`; by what moves if it is left out.

    Returns
    -------
    ndarray (height, n * width + (n - 1) * GAP, 3) uint8

    Raises
    ------
    UserError
        The rollout or its body is missing or does not fit.
    """
    return frames(read_rollout(run, demo), times, width, height, azimuth)


def frames(
    rollout: Rollout,
    times: Sequence[float],
    width: int,
    height: int,
    azimuth: float | None = None,
    columns: int = len(LETTERS),
    clock: Sequence[float] | None = None,
) -> np.ndarray:
    """The same of a rollout already read, so many columns side by side; `clock` (n,), s, is told instead of times."""
    label = round(LABEL_SHARE * height)
    stage = Stage(rollout)
    camera, studio = stage.shot(width, height - label, azimuth, key_rays=9)
    # No gradient behind: a figure has few colours, and needs them for the muscles.
    studio = replace(studio, backdrop_top=studio.backdrop_horizon)
    now = rollout.at(np.asarray(times, float))
    switched = len(rollout.switches()) > 0
    rows, across = -(-len(times) // columns), min(columns, len(times))
    image = np.full((rows * (height + GAP) - GAP, across * (width + GAP) - GAP, 3), 255, np.uint8)
    for index, (time, told) in enumerate(zip(times, times if clock is None else clock, strict=True)):
        state = bool(now.controller_on[index]) if switched else None
        row, column = divmod(index, columns)
        frame = image[row * (height + GAP) :, column * (width + GAP) :][:height, :width]
        frame[:label] = _label(LETTERS[index], told, state, width, label)
        frame[label:] = render(stage.parts(time), camera, studio)
    return image


def _label(letter: str, time: float, on: bool | None, width: int, height: int) -> np.ndarray:
    """A band (height, width, 3) of words; nothing of a controller that is never switched."""
    band = Image.new("RGB", (width, height), PAPER)
    draw = ImageDraw.Draw(band)
    middle = height / 2
    plain, bold = _font(height, "normal"), _font(height, "bold")
    draw.text((0.2 * height, middle), letter, INK, bold, anchor="lm")
    draw.text((width / 2, middle), f"{time:.2f} s", INK, plain, anchor="mm")
    if on is not None:
        word = "ON" if on else "OFF"
        long = draw.textlength("OFF", plain) + 0.5 * height
        right = width - 0.15 * height
        pill = [right - long, 0.12 * height, right, 0.88 * height]
        draw.rounded_rectangle(pill, 0.25 * height, fill=INK if on else PAPER, outline=INK, width=2)
        draw.text((right - long / 2, middle), word, PAPER if on else INK, plain, anchor="mm")
    return np.asarray(band)


def _font(height: int, weight: str) -> ImageFont.FreeTypeFont:
    face = matplotlib.font_manager.FontProperties(family="DejaVu Sans", weight=weight)
    return ImageFont.truetype(matplotlib.font_manager.findfont(face), max(6, round(0.62 * height)))
