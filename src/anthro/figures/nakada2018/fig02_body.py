"""Fig. 2: the whole body, with its muscles and as bones alone."""

import sys
from collections.abc import Sequence
from pathlib import Path

import matplotlib.pyplot as plt

from anthro import cli, figures
from anthro.body import Body
from anthro.figures.plate import plate
from anthro.render.anatomy import BACK, FRONT, RIGHT, Anatomy, assemble, picture, width_of

HEIGHT, MARGIN = 900, 0.01


def draw(run: Path) -> plt.Figure:
    """Draw front, right side and back of a run's whole body."""
    anatomy = Anatomy(Body.load(Path(run) / "body" / "zhou2021"))
    bones = [*anatomy.bones.values(), *anatomy.ligaments()]
    points = anatomy.points(anatomy.bones)
    counts = f"{len(anatomy.bones)} bones, {anatomy.body.muscle_count} muscles"
    panels = []
    for meshes in (bones + anatomy.muscles(), bones):
        part = assemble(meshes)
        for view in (FRONT, RIGHT, BACK):
            width = width_of(points, view, HEIGHT, MARGIN)
            panels.append((view.title, picture(part, points, view, width, HEIGHT, MARGIN)))
    return plate(panels, counts)


def main(argv: Sequence[str] | None = None) -> None:
    """Run the command line."""
    figures.command(draw, argv, __doc__)


if __name__ == "__main__":
    sys.exit(cli.run(main))
