"""Frames of trials of the closed loop, in rows, each under its letter and its time within the trial."""

from __future__ import annotations

from collections.abc import Sequence

import matplotlib.pyplot as plt
import numpy as np

from anthro.figures.strip import GAP, frames
from anthro.render.rollout import Rollout

DPI, WIDTH = 300, 2100  # pixels: a page's width


def sequence(rollout: Rollout, shown: Sequence[tuple[np.ndarray, np.ndarray]], columns: int, tall: float) -> plt.Figure:
    """Draw some instants of some trials.

    Parameters
    ----------
    rollout : Rollout
    shown : sequence of (ndarray (k,), ndarray (n,))
        A trial's indices, and the instants among these that are shown; at most 12 in all.
    columns : int
        Frames side by side.
    tall : float
        A frame's height over its width, its label included.

    Returns
    -------
    matplotlib.figure.Figure
        Each of the frames' pixels is one of the figure's.
    """
    times = np.concatenate([rollout.time[trial[instants]] for trial, instants in shown])
    clock = np.concatenate([rollout.time[trial[instants]] - rollout.time[trial[0]] for trial, instants in shown])
    width = (WIDTH + GAP) // columns - GAP
    image = frames(rollout, times, width, round(tall * width), columns=columns, clock=clock)
    plt.rcParams["savefig.dpi"] = DPI
    figure = plt.figure(figsize=(image.shape[1] / DPI, image.shape[0] / DPI), layout="none")
    axes = figure.add_axes([0, 0, 1, 1])
    axes.imshow(image, interpolation="none", aspect="auto")
    axes.set_axis_off()
    return figure
