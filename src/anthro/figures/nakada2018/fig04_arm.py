"""Fig. 4: the right arm and its muscles."""

import sys
from collections.abc import Sequence
from pathlib import Path

import matplotlib.pyplot as plt

from anthro import cli, figures
from anthro.body import Body
from anthro.figures.limb import limb_plate


def draw(run: Path) -> plt.Figure:
    """Draw front, right side and back of the right arm of a run's seated body."""
    body = Body.load(Path(run) / "body" / "nakada2018")
    framed = ("scapula_r", "clavicle_r", "humerus_r", "ulna_r", "radius_r", "metacarpal_3_r", "T1")
    return limb_plate(body, "arm", framed, ("hip_bone_r",), (480, 1000))


def main(argv: Sequence[str] | None = None) -> None:
    """Run the command line."""
    figures.command(draw, argv, __doc__)


if __name__ == "__main__":
    sys.exit(cli.run(main))
