"""Frames of a learned motion (Fig. 13): how it ends as learning goes on, and instants of what was learned."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.lines import Line2D

from anthro.figures import command
from anthro.neuroanimator import draw
from anthro.neuroanimator.film import goal_state, read_motion, show
from anthro.neuroanimator.plants import plant_of
from anthro.neuroanimator.tasks import task_of

INSTANTS = 6
HEIGHTS = {"pendulum": 1.25, "truck": 0.75, "lander": 1.6, "dolphin": 0.75}  # inches of a frame


def frames(run: Path, name: str) -> plt.Figure:
    """Draw one task's frames.

    Raises
    ------
    UserError
        The run lacks the task.
    """
    motion = read_motion(run, name)
    shown = len(motion["progress"])
    figure, table = plt.subplots(2, max(INSTANTS, shown), figsize=(7.0, 2 * HEIGHTS[name] + 0.75), squeeze=False)
    for axes in table.flat:
        axes.set_axis_off()
    every = np.concatenate(
        [motion["plant"], motion["emulated"], motion["progress"].reshape(-1, motion["plant"].shape[1])]
    )
    wide = 7.0 / INSTANTS / HEIGHTS[name]
    plant, goal = plant_of(task_of(name).plant), goal_state(name)
    for axes, number, states in zip(table[0], motion["progress_iteration"], motion["progress"], strict=False):
        draw.scene(axes, name, every, wide)
        if goal is not None:
            draw.DRAWN[name](axes, plant, goal, draw.GOAL, 0.35)
        draw.DRAWN[name](axes, plant, states[-1], draw.EMULATOR)
        axes.set_title(f"iteration {number}", fontsize=7, fontweight="normal", loc="center")
    for axes, at in zip(table[1], np.linspace(0.0, motion["time"][-1], INSTANTS), strict=False):
        draw.scene(axes, name, every, wide)
        show(axes, name, motion, at)
        axes.set_title(f"{at:.0f} s", fontsize=7, fontweight="normal", loc="center")
    names = {"plant": draw.PLANT, "emulator": draw.EMULATOR} | ({} if goal is None else {"goal": draw.GOAL})
    handles = [Line2D([], [], color=colour, linewidth=4, label=label) for label, colour in names.items()]
    figure.legend(handles=handles, loc="outside lower center", ncols=len(handles))
    return figure


def main(name: str, argv: Sequence[str] | None = None, description: str | None = None) -> None:
    """Run the command line of one task's figure."""
    command(lambda run: frames(run, name), argv, description)
