"""Fig. 3: the whole body from the front and the back, and the torso with its muscles alone."""

import sys
from collections.abc import Sequence
from pathlib import Path

import matplotlib.pyplot as plt

from anthro import cli, figures
from anthro.body import Body
from anthro.figures.plate import plate
from anthro.render.anatomy import BACK, FRONT, Anatomy, assemble, picture, width_of

HEIGHT, MARGIN = 1000, 0.01
TORSO = ("hip_bone_r", "hip_bone_l", "scapula_r", "scapula_l", "clavicle_r", "clavicle_l", "sternum", "T1")


def draw(run: Path) -> plt.Figure:
    """Draw the four panels of a run's whole body."""
    anatomy = Anatomy(Body.load(Path(run) / "body" / "zhou2021"))
    body, bones = anatomy.body, [*anatomy.bones.values(), *anatomy.ligaments()]
    torso = body.muscles_of("core")
    panels = []
    for names, framed in ((body.muscle_names, anatomy.bones), (torso, TORSO)):
        part, points = assemble(bones + anatomy.muscles(names)), anatomy.points(framed)
        for view in (FRONT, BACK):
            width = width_of(points, view, HEIGHT, MARGIN)
            title = f"{len(names)} muscles, {view.title}"
            panels.append((title, picture(part, points, view, width, HEIGHT, MARGIN)))
    return plate([(f"({letter}) {title}", image) for letter, (title, image) in zip("abcd", panels, strict=True)])


def main(argv: Sequence[str] | None = None) -> None:
    """Run the command line."""
    figures.command(draw, argv, __doc__)


if __name__ == "__main__":
    sys.exit(cli.run(main))
