"""Fig. 22: the body sees a ball, foveates it, turns its head to it and reaches for it."""

import sys
from collections.abc import Sequence
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

from anthro import cli, figures
from anthro.figures.gaze import FOVEA, approach, farthest, first, gaze_error, read
from anthro.figures.sequence import sequence

DEMO = "perception"
SHARES = (0.67, 0.33, 0.1)  # of the hand's way that are left
COLUMNS, TALL = 3, 0.85


def draw(run: Path) -> plt.Figure:
    """Draw the trial of a run's perception demo with the longest way: at first, foveated, on the way, at the end."""
    rollout = read(run, DEMO)
    trial, distance = farthest(rollout)
    foveated = first((gaze_error(rollout)[trial] < FOVEA).all(axis=1), 0)
    instants = np.sort([0, foveated, *approach(distance, SHARES), len(trial) - 1])
    return sequence(rollout, [(trial, instants)], COLUMNS, TALL)


def main(argv: Sequence[str] | None = None) -> None:
    """Run the command line."""
    figures.command(draw, argv, __doc__)


if __name__ == "__main__":
    sys.exit(cli.run(main))
