"""Fig. 10: training progress of the neck's voluntary networks. Green training, red validation."""

import sys
from pathlib import Path

from anthro import cli
from anthro.figures import command
from anthro.figures.training import draw_panels, voluntary_curves


def draw(run: Path):
    """Draw both variants of the seated body's neck."""
    return draw_panels({"neck, voluntary": voluntary_curves(run, "neck_seated")}, columns=1)


if __name__ == "__main__":
    sys.exit(cli.run(lambda argv: command(draw, argv, __doc__)))
