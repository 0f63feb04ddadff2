"""Fig. 12: error of the emulators N25, N50 and N100 of the passive (a) and the active pendulum (b) over time."""

import sys
from pathlib import Path

import matplotlib.pyplot as plt

from anthro import cli
from anthro.figures import command
from anthro.figures.grzeszczuk1998.errors import panel, units


def draw(run: Path) -> plt.Figure:
    """Draw both panels."""
    figure, table = plt.subplots(1, 2, figsize=(7.0, 2.8), sharey=True)
    for axes, plant in zip(table, ("passive_pendulum", "active_pendulum"), strict=True):
        panel(axes, run, plant)
    table[0].set_ylim(0, None)  # once both have been drawn, as they share it
    table[0].set_ylabel(f"mean absolute error ({units(plant)})")
    return figure


if __name__ == "__main__":
    sys.exit(cli.run(lambda argv: command(draw, argv, __doc__)))
