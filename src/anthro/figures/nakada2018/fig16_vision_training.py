"""Fig. 16's networks in training: foveation and limb vision DNNs of both eyes. Green training, red validation."""

import sys
from pathlib import Path

from anthro import cli
from anthro.eyes.eye import SIDES
from anthro.figures import command
from anthro.figures.training import draw_panels, read_curve

PANELS = {  # nets but for their eye, and the epochs that the paper trained them (Nakada 2018, Sec. 6.2)
    "foveation": 80,
    "right_arm_vision": 388,
    "left_arm_vision": 388,
    "right_leg_vision": 388,
    "left_leg_vision": 388,
}


def draw(run: Path):
    """Draw a panel for foveation and for each limb, a line style for each eye."""
    panels = {}
    for letter, (net, epochs) in zip("abcde", PANELS.items(), strict=True):
        title = f"({letter}) {net.removesuffix('_vision').replace('_', ' ')}: {epochs} epochs in the paper"
        panels[title] = [read_curve(run, f"{net}_{side}", f"{side} eye") for side in SIDES]
    return draw_panels(panels)


if __name__ == "__main__":
    sys.exit(cli.run(lambda argv: command(draw, argv, __doc__)))
