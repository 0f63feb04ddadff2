"""Fig. 3: the neck and its muscles."""

import sys
from collections.abc import Sequence
from pathlib import Path

import matplotlib.pyplot as plt

from anthro import cli, figures
from anthro.body import Body
from anthro.figures.plate import plate
from anthro.render.anatomy import BACK, FRONT, RIGHT, Anatomy, assemble, picture

SIZE = (620, 760)
# The picture reaches from the skull down to the lowest bones that the neck's muscles come from.
FRAMED = ("cranium", "mandible", "clavicle_r", "clavicle_l", "rib1_r", "rib1_l", "rib2_r", "T4")


def draw(run: Path) -> plt.Figure:
    """Draw front, right side and back of the neck of a run's seated body."""
    anatomy = Anatomy(Body.load(Path(run) / "body" / "nakada2018"))
    muscles = anatomy.body.muscles_of("neck")
    part = assemble([*anatomy.bones_without(("humerus_r", "humerus_l")).values(), *anatomy.muscles(muscles)])
    points = anatomy.points(FRAMED)
    panels = [(view.title, picture(part, points, view, *SIZE)) for view in (FRONT, RIGHT, BACK)]
    return plate(panels, f"Neck: {len(muscles)} muscles")


def main(argv: Sequence[str] | None = None) -> None:
    """Run the command line."""
    figures.command(draw, argv, __doc__)


if __name__ == "__main__":
    sys.exit(cli.run(main))
