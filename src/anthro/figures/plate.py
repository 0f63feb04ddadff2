"""Pictures side by side, pixel by pixel, each under its title."""

from __future__ import annotations

from collections.abc import Sequence

import matplotlib.pyplot as plt
import numpy as np

DPI = 200
HEAD = 44  # pixels above the pictures
GAP = 16


def plate(panels: Sequence[tuple[str, np.ndarray]], heading: str = "") -> plt.Figure:
    """A figure of pictures in one row.

    Parameters
    ----------
    panels : sequence of (str, ndarray (height, width, 3) uint8)
        Titles and pictures of one height.
    heading : str
        Above all of them.

    Returns
    -------
    matplotlib.figure.Figure
        Each of the pictures' pixels is one of the figure's.
    """
    height = panels[0][1].shape[0]
    head = HEAD * (2 if heading else 1)
    wide = sum(picture.shape[1] for _, picture in panels) + GAP * (len(panels) + 1)
    tall = height + head + GAP
    plt.rcParams["savefig.dpi"] = DPI
    figure = plt.figure(figsize=(wide / DPI, tall / DPI), layout="none")
    left = GAP
    for title, picture in panels:
        width = picture.shape[1]
        axes = figure.add_axes([left / wide, GAP / tall, width / wide, height / tall])
        axes.imshow(picture, interpolation="none")
        axes.set_axis_off()
        figure.text(
            (left + width / 2) / wide, (GAP + height + HEAD / 2) / tall, title, ha="center", va="center", size=8
        )
        left += width + GAP
    if heading:
        figure.text(GAP / wide, 1 - HEAD / 2 / tall, heading, va="center", size=9, weight="bold")
    return figure
