"""The world that the eyes see: the body's own limbs, balls, and what stands about, before an even background.

Each rigid piece is built once and only placed anew in each frame. Trunk and head are left out: they hardly come into
view, and the face would stand before the pinholes.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import lru_cache

import mujoco
import numpy as np

from anthro.body import Body
from anthro.errors import UserError
from anthro.eyes.flesh import flesh
from anthro.render.mesh import Mesh, linear_rgb
from anthro.render.parts import Ball, Part, Troop
from anthro.render.props import Piece, pieces
from anthro.render.raytrace import Studio
from anthro.render.scene import corners, root_bone

# First bones of the limbs that are seen, and their colours: arms are green as in Nakada 2018, Sec. 6.2.2; blue is ours.
GREEN, BLUE = "#3FA34D", "#3F6FB5"
SKIN = {"humerus_r": GREEN, "humerus_l": GREEN, "femur_r": BLUE, "femur_l": BLUE}
BACKGROUND = "#5B6066"
KEY_DIRECTION = np.array([0.5, 0.35, 1.0])  # to the light: before the body, at its left, above


class Scene:
    """What the eyes of a body see.

    Parameters
    ----------
    model : mujoco.MjModel
        Of the body.
    balls : sequence of Ball
        Placed by whoever moves them.
    things : sequence of Part
        Slopes and the like, where they stand.
    floor : float, optional
        Its height, m. It has the background's colour, so only shadows tell where it is; no floor if it is left out.
    stool : bool
        Whether the body sits on a stool, which needs a floor to stand on.
    background : str
        sRGB ``#rrggbb``.
    skin : dict of str to str
        Colour of each limb that is seen, by its first bone.

    Raises
    ------
    UserError
        The model has no limb, or a stool has no floor.
    """

    def __init__(
        self,
        model: mujoco.MjModel,
        balls: Sequence[Ball] = (),
        things: Sequence[Part] = (),
        floor: float | None = None,
        stool: bool = False,
        background: str = BACKGROUND,
        skin: Mapping[str, str] = SKIN,
    ) -> None:
        around = linear_rgb(background)
        self._names = [model.body(body).name for body in range(model.nbody)]
        self._limbs = {body: Part(mesh) for body, mesh in _skinned(model, tuple(skin.items())).items()}
        self._carriers, self._troop = list(self._limbs), Troop(list(self._limbs.values()))
        if not self._limbs:
            raise UserError(f"the body has none of the bones {', '.join(skin)}: nothing of it can be seen")
        if stool and floor is None:
            raise UserError("a stool needs a floor to stand on")
        self.balls, self._things = list(balls), list(things)
        self._root = root_bone(model)
        self._home, self._pieces = _stool(model, self._root, floor) if stool else (np.zeros(3), [])
        self.studio = Studio(
            KEY_DIRECTION,
            floor=floor,
            backdrop_top=around,
            backdrop_horizon=around,
            floor_colour=around,
        )

    @property
    def parts(self) -> list[Part | Ball]:
        """All that rays may meet, where it lies now."""
        return [*self._limbs.values(), *(piece.part for piece in self._pieces), *self._things, *self.balls]

    @property
    def limb_names(self) -> list[str]:
        """Bones with which the first of `parts` move, in their order."""
        return [self._names[body] for body in self._limbs]

    @property
    def triangles(self) -> int:
        """Of all parts that have a mesh."""
        return sum(len(part.mesh.faces) for part in self.parts if isinstance(part, Part))

    def place(self, data: mujoco.MjData) -> Scene:
        """Put the limbs and what the body sits on where `data` has them, after `mj_kinematics`."""
        self._troop.place(data.xmat[self._carriers].reshape(-1, 3, 3), data.xpos[self._carriers])
        for piece in self._pieces:
            piece.place(data.xmat[self._root].reshape(3, 3), data.xpos[self._root], self._home)
        return self


def sole_height(body: Body) -> float:
    """Height, m, of the lowest point of a body's bones at its rest posture: where its floor may lie."""
    data = mujoco.MjData(body.model)
    data.qpos[:] = body.q_rest
    mujoco.mj_kinematics(body.model, data)
    heights = [
        (points @ data.xmat[bone].reshape(3, 3).T)[:, 2].min() + data.xpos[bone][2]
        for bone, points in corners(body.model).items()
    ]
    return float(min(heights))


@lru_cache(maxsize=1)
def _skinned(model: mujoco.MjModel, skin: tuple[tuple[str, str], ...]) -> dict[int, Mesh]:
    """The limbs' surfaces, kept from one scene of a model to the next: to grow them takes seconds."""
    colours = {root: linear_rgb(colour) for root, colour in skin}
    return flesh(model, tuple(colours), colours)


def _stool(model: mujoco.MjModel, root: int, floor: float) -> tuple[np.ndarray, list[Piece]]:
    """Place (3,), m, of the root bone as the body is built, and the pieces of a stool beneath it."""
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    home, turn = data.xpos[root].copy(), data.xmat[root].reshape(3, 3)
    bones = {}
    for body, points in corners(model).items():
        placed = points @ data.xmat[body].reshape(3, 3).T + data.xpos[body]
        bones[model.body(body).name] = (placed - home) @ turn
    return home, pieces("stool", bones, floor - float(home[2]))
