"""Fig. 15: the core's networks with hidden layers of 300 and of 600 units. Green training, red validation."""

import sys
from pathlib import Path

from anthro import cli
from anthro.figures import command
from anthro.figures.training import Curve, draw_panels
from anthro.learn.curves import read_losses

ROLES = {"voluntary": "(a) voluntary", "reflex": "(b) reflex"}
WIDTHS = (300, 600)


def draw(run: Path):
    """Draw a panel for each role, both widths in each."""
    folder = run / "ablations" / "core_widths"
    return draw_panels(
        {
            title: [Curve(f"6 × {width}", [read_losses(folder / f"{role}_{width}" / "loss.csv")]) for width in WIDTHS]
            for role, title in ROLES.items()
        }
    )


if __name__ == "__main__":
    sys.exit(cli.run(lambda argv: command(draw, argv, __doc__)))
