"""Fig. 25: a ball bounces on sloped planes, is seen and followed, and is met by the right arm."""

import sys
from collections.abc import Sequence
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

from anthro import cli, figures
from anthro.figures.gaze import after, first, reaching, read, trials
from anthro.figures.sequence import sequence

DEMO = "bouncing"
BEFORE = 7  # frames until the arm is nearest to the ball, evenly in time
LATER = 0.15  # s, from then to the last frame
COLUMNS, TALL = 4, 0.95


def draw(run: Path) -> plt.Figure:
    """Draw the first trial of a run's bouncing demo."""
    rollout = read(run, DEMO)
    trial = trials(rollout)[0]
    _, distance = reaching(rollout, trial)
    nearest = int(np.argmin(distance))
    instants = np.linspace(first(np.isfinite(distance), 0), nearest, BEFORE).round().astype(int)
    instants = np.append(instants, after(rollout.time[trial], nearest, LATER))
    return sequence(rollout, [(trial, instants)], COLUMNS, TALL)


def main(argv: Sequence[str] | None = None) -> None:
    """Run the command line."""
    figures.command(draw, argv, __doc__)


if __name__ == "__main__":
    sys.exit(cli.run(main))
