"""Fig. 11: training progress of the limbs' voluntary networks.

Green training, red validation. A dotted line marks each round of data aggregation: its shards add
states that the network of the round before ran into, so the error starts higher.
"""

import sys
from pathlib import Path

from anthro import cli
from anthro.figures import command
from anthro.figures.training import draw_panels, voluntary_curves

LIMBS = ("left_arm", "right_arm", "left_leg", "right_leg")  # the paper's order


def draw(run: Path):
    """Draw a panel for each limb."""
    titles = [f"({letter}) {limb.replace('_', ' ')}" for letter, limb in zip("abcd", LIMBS, strict=True)]
    return draw_panels({title: voluntary_curves(run, limb) for title, limb in zip(titles, LIMBS, strict=True)})


if __name__ == "__main__":
    sys.exit(cli.run(lambda argv: command(draw, argv, __doc__)))
