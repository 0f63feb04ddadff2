"""Fig. 3: the whole body from the front and the back, and the torso with its muscles alone."""

import sys
from collections.abc import Sequence
from pathlib import Path

import matplotlib.pyplot as plt

from anthro import cli, figures
from anthro.body import Body
from anthro.figures.plate import plate
from anthro.render.anatomy import BACK, FRONT, Anatomy, assemble, picture, width_of

HEIGHT, MARGIN = 700, 0.01
TORSO = ("hip_bone_r", "hip_bone_l", "scapula_r", "scapula_l", "clavicle_r", "clavicle_l", "sternum", "T1")
FOREARMS = ("ulna_r", "ulna_l")


def draw(run: Path) -> plt.Figure:
    """Draw the four panels of a run's whole body."""
    anatomy = Anatomy(Body.load(Path(run) / "body" / "zhou2021"))
    whole, torso = anatomy.body.muscle_names, anatomy.body.muscles_of("core")
    panels = []
    for what, names, framed, hidden in (("body", whole, anatomy.bones, ()), ("torso", torso, TORSO, FOREARMS)):
        bones = [*anatomy.bones_without(hidden).values(), *anatomy.ligaments()]
        part, points = assemble(bones + anatomy.muscles(names)), anatomy.points(framed)
        for view in (FRONT, BACK):
            width = width_of(points, view, HEIGHT, MARGIN)
            title = f"({'abcd'[len(panels)]}) {what}, {view.title}"
            panels.append((title, picture(part, points, view, width, HEIGHT, MARGIN)))
    return plate(panels, f"{len(anatomy.bones)} bones, {len(whole)} muscles; torso: {len(torso)} muscles")


def main(argv: Sequence[str] | None = None) -> None:
    """Run the command line."""
    figures.command(draw, argv, __doc__)


if __name__ == "__main__":
    sys.exit(cli.run(main))
