"""Fig. 23: balls that a cannon shoots are seen, followed and intercepted by an arm, then by a leg."""

import sys
from collections.abc import Sequence
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

from anthro import cli, figures
from anthro.figures.gaze import after, approach, reaching, read, trials
from anthro.figures.sequence import sequence
from anthro.render.rollout import Rollout

DEMO = "cannon"
SHARES = (0.27, 0.12, 0.0)  # of the ball's way to the limb
LATER = 0.12  # s, from the touch to the last frame
COLUMNS, TALL = 4, 1.05
ROWS = ("arm", "leg")


def chosen(rollout: Rollout) -> list[np.ndarray]:
    """Indices (k,) of the first trial of an arm and of the first of a leg; of the first trials, if there is none."""
    every = trials(rollout)
    limbs = [rollout.limbs[reaching(rollout, trial)[0]] for trial in every]
    found = [next((number for number, limb in enumerate(limbs) if limb.endswith(kind)), None) for kind in ROWS]
    return [every[number] for number in found] if None not in found else every[: len(ROWS)]


def draw(run: Path) -> plt.Figure:
    """Draw two trials of a run's cannon demo, a row for each: the ball comes, is touched, leaves."""
    rollout = read(run, DEMO)
    shown = []
    for trial in chosen(rollout):
        way = approach(reaching(rollout, trial)[1], SHARES)
        shown.append((trial, np.append(way, after(rollout.time[trial], way[-1], LATER))))
    return sequence(rollout, shown, COLUMNS, TALL)


def main(argv: Sequence[str] | None = None) -> None:
    """Run the command line."""
    figures.command(draw, argv, __doc__)


if __name__ == "__main__":
    sys.exit(cli.run(main))
