"""Fig. 5: the right leg and its muscles."""

import sys
from collections.abc import Sequence
from pathlib import Path

import matplotlib.pyplot as plt

from anthro import cli, figures
from anthro.body import Body
from anthro.figures.limb import limb_plate


def draw(run: Path) -> plt.Figure:
    """Draw front, right side and back of the right leg of a run's seated body."""
    body = Body.load(Path(run) / "body" / "nakada2018")
    framed = ("hip_bone_r", "femur_r", "tibia_r", "calcaneus_r", "metatarsal_1_r")
    return limb_plate(body, "leg", framed, ("humerus_r",), (400, 1100))


def main(argv: Sequence[str] | None = None) -> None:
    """Run the command line."""
    figures.command(draw, argv, __doc__)


if __name__ == "__main__":
    sys.exit(cli.run(main))
