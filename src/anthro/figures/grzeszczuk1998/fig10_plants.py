"""Fig. 10: the four plants, each as its emulator moves it: pendulum, truck, lunar lander, dolphin."""

import sys
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

from anthro import cli
from anthro.figures import command
from anthro.neuroanimator import draw
from anthro.neuroanimator.film import read_motion
from anthro.neuroanimator.plants import plant_of
from anthro.neuroanimator.tasks import TASKS, task_of

MOMENTS = {"pendulum": (0.5, 0.95), "truck": (0.0, 0.25, 0.45, 1.0), "lander": (0.0, 0.5, 1.0), "dolphin": (0.4, 0.9)}
TITLES = {"pendulum": "three-link pendulum", "truck": "truck", "lander": "lunar lander", "dolphin": "dolphin"}


def draw_figure(run: Path) -> plt.Figure:
    """Draw each plant at some moments of the motion that it learned, the last in full colour."""
    figure, table = plt.subplots(2, 2, figsize=(7.0, 4.6))
    for axes, name in zip(table.flat, TASKS, strict=True):
        states = read_motion(run, name)["emulated"]
        chosen = states[np.round(np.array(MOMENTS[name]) * (len(states) - 1)).astype(int)]
        plant = plant_of(task_of(name).plant)
        draw.scene(axes, name, states, 3.5 / 2.1)
        for number, state in enumerate(chosen):
            extra = {"rocket": 0.5} if name == "lander" else {}
            draw.DRAWN[name](axes, plant, state, draw.EMULATOR, 1.0 if number == len(chosen) - 1 else 0.3, **extra)
        axes.set_title(TITLES[name])
    return figure


if __name__ == "__main__":
    sys.exit(cli.run(lambda argv: command(draw_figure, argv, __doc__)))
