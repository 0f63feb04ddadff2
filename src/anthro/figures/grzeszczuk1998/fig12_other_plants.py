"""After Fig. 12: error of the other plants' emulators over time."""

import sys
from pathlib import Path

import matplotlib.pyplot as plt

from anthro import cli
from anthro.figures import command
from anthro.figures.grzeszczuk1998.errors import panel, units

PLANTS = ("forced_pendulum", "truck", "lander", "dolphin")


def draw(run: Path) -> plt.Figure:
    """Draw a panel for each plant."""
    figure, table = plt.subplots(2, 2, figsize=(7.0, 4.6))
    for axes, plant in zip(table.flat, PLANTS, strict=True):
        panel(axes, run, plant)
        axes.set_ylim(0, None)
        axes.set_ylabel(f"mean error ({units(plant)})")
    return figure


if __name__ == "__main__":
    sys.exit(cli.run(lambda argv: command(draw, argv, __doc__)))
