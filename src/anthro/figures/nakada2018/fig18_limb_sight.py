"""Fig. 18: a foveated red ball and the arm that reaches for it, on both retinas."""

import sys
from collections.abc import Sequence
from pathlib import Path

import matplotlib.pyplot as plt

from anthro import cli, figures
from anthro.eyes.eye import SIDES
from anthro.eyes.sight import as_floats
from anthro.figures.gaze import approach, farthest, read, retinas
from anthro.figures.retina import percept

DEMO = "perception"
SIZE = (7.0, 4.9)
SHARES = (0.95, 0.5, 0.1)  # of the way that is left: the arm sets out, is half way there, is nearly there


def draw(run: Path) -> plt.Figure:
    """Draw three instants of the trial of a run's perception demo with the longest way, a row for each eye."""
    rollout = read(run, DEMO)
    trial, distance = farthest(rollout)
    shown = approach(distance, SHARES)
    figure, axes = plt.subplots(2, len(shown), figsize=SIZE)
    vectors, receptors = as_floats(rollout.others["nerve"][trial[shown]]), retinas(rollout)
    time = rollout.time[trial] - rollout.time[trial[0]]
    for column, index in enumerate(shown):
        told = f"{time[index]:.2f} s: {100 * distance[index]:.0f} cm"
        for row, side in enumerate(SIDES):
            title = f"{told}, {side}" if column == 0 else told
            percept(axes[row, column], receptors[row], vectors[column, row], title, SIZE[0] / len(shown))
    return figure


def main(argv: Sequence[str] | None = None) -> None:
    """Run the command line."""
    figures.command(draw, argv, __doc__)


if __name__ == "__main__":
    sys.exit(cli.run(main))
