"""One limb of the right side with its muscles, seen from three sides."""

from __future__ import annotations

from collections.abc import Sequence

import matplotlib.pyplot as plt

from anthro.body import Body
from anthro.figures.plate import plate
from anthro.render.anatomy import BACK, FRONT, RIGHT, Anatomy, assemble, picture


def limb_plate(
    body: Body, region: str, framed: Sequence[str], hidden: Sequence[str], size: tuple[int, int]
) -> plt.Figure:
    """Draw a region's right muscles on the bones of the midline and of the right side.

    Parameters
    ----------
    body : Body
    region : str
        Whose muscles, ``arm`` or ``leg``.
    framed : sequence of str
        Bones that every picture holds.
    hidden : sequence of str
        Bones that are left out, with all that hangs on them.
    size : tuple of int
        Width and height of a picture, pixels.

    Returns
    -------
    matplotlib.figure.Figure
    """
    anatomy = Anatomy(body)
    muscles = [name for name in body.muscles_of(region) if name.endswith("_r")]
    bones = [mesh for name, mesh in anatomy.bones_without(hidden).items() if not name.endswith("_l")]
    part = assemble([*bones, *anatomy.ligaments("_r"), *anatomy.muscles(muscles)])
    points = anatomy.points(framed)
    panels = [(view.title, picture(part, points, view, *size)) for view in (FRONT, RIGHT, BACK)]
    return plate(panels, f"Right {region}: {len(muscles)} muscles")
