"""Fig. 5: training progress of the core's voluntary and reflex networks. Green training, red validation."""

import sys
from pathlib import Path

from anthro import cli
from anthro.figures import command
from anthro.figures.training import draw_panels, read_curve, voluntary_curves


def draw(run: Path):
    """Draw the voluntary net in both variants, and the reflex net."""
    reflex = [read_curve(run, "core_reflex", "")]
    return draw_panels({"(a) voluntary": voluntary_curves(run, "core"), "(b) reflex": reflex})


if __name__ == "__main__":
    sys.exit(cli.run(lambda argv: command(draw, argv, __doc__)))
