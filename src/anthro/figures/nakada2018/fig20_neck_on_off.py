"""Fig. 20: the neck's controller is turned off, the head droops, it is turned on and lifts the head."""

import sys
from collections.abc import Sequence
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

from anthro import cli, figures
from anthro.errors import UserError
from anthro.figures import on_off
from anthro.render.rollout import read_rollout

DEMO = "neck_on_off"


def draw(run: Path) -> plt.Figure:
    """Draw the figure of a run's neck_on_off rollout.

    Raises
    ------
    UserError
        There is none, it lacks the head's direction, or the controller is not switched.
    """
    rollout = read_rollout(run, DEMO)
    direction = rollout.others.get("direction")
    if direction is None or direction.shape != (len(rollout.time), 2):
        raise UserError(f"demo {DEMO}: no column direction of azimuth and elevation")
    return on_off.draw(rollout, np.rad2deg(direction[:, 1]), "head pitch, up (deg)")


def main(argv: Sequence[str] | None = None) -> None:
    """Run the command line."""
    figures.command(draw, argv, __doc__)


if __name__ == "__main__":
    sys.exit(cli.run(main))
