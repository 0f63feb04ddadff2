"""Fig. 13: training progress of the right leg's reflex network. Green training, red validation."""

import sys
from pathlib import Path

from anthro import cli
from anthro.figures import command
from anthro.figures.training import draw_panels, read_curve


def draw(run: Path):
    """Draw the right leg's reflex net."""
    return draw_panels({"right leg, reflex": [read_curve(run, "right_leg_reflex", "")]}, columns=1)


if __name__ == "__main__":
    sys.exit(cli.run(lambda argv: command(draw, argv, __doc__)))
