"""Fig. 21: the left arm's controller is turned off, the arm falls, it is turned on and lifts the arm."""

import sys
from collections.abc import Sequence
from pathlib import Path

import matplotlib.pyplot as plt

from anthro import cli, figures
from anthro.figures import on_off
from anthro.render.rollout import read_rollout

DEMO = "on_off"


def draw(run: Path) -> plt.Figure:
    """Draw the figure of a run's on_off rollout.

    Raises
    ------
    UserError
        There is none, or the controller is not switched.
    """
    rollout = read_rollout(run, DEMO)
    return on_off.draw(rollout, rollout.effector[:, 0, 2], "hand height (m)", rollout.target[:, 0, 2])


def main(argv: Sequence[str] | None = None) -> None:
    """Run the command line."""
    figures.command(draw, argv, __doc__)


if __name__ == "__main__":
    sys.exit(cli.run(main))
