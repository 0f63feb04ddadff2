"""A seated body in random postures, with a ball before its eyes: what the vision DNNs' pairs are pictures of."""

from __future__ import annotations

import mujoco
import numpy as np

from anthro.body import Body
from anthro.eyes.scene import Scene, sole_height
from anthro.eyes.sight import Eyes, as_bytes
from anthro.eyes.vision import BALL_RADIUS, RED, WHITE
from anthro.motor.limb import Limb, limb_plan
from anthro.render.parts import REAL, Ball
from anthro.render.raytrace import intersect

COLOURS = (WHITE, RED)


class Witness:
    """A body that is posed, and looks.

    Parameters
    ----------
    body : Body
        The seated one.
    limbs : dict of str to dict
        Plans of its limbs, as in ``config/limbs``.
    retina : str
        Of `anthro.eyes.layout.LAYOUTS`.
    seed : int
        Of the run, by which receptors are placed.

    Attributes
    ----------
    limbs : dict of str to Limb
    ball : Ball
    eyes : Eyes
        They see the ball and the body's limbs.
    data : mujoco.MjData
        Where the body lies.
    """

    def __init__(self, body: Body, limbs: dict[str, dict], retina: str, seed: int):
        self.body, self.data = body, mujoco.MjData(body.model)
        self.limbs = {name: Limb(limb_plan({"name": name} | plan), body) for name, plan in limbs.items()}
        self._joints = slice(body.model.nq - body.dof_count, None)
        self.ball = Ball(BALL_RADIUS, WHITE)
        scene = Scene(body.model, [self.ball], floor=sole_height(body), stool=True)
        self.eyes = Eyes(body, scene, retina, seed=seed)

    def show(self, colour: str) -> None:
        """Let the ball be `WHITE` or `RED` from now on."""
        self.ball.paint(colour)

    def pose(self, share: float, rng: np.random.Generator, **angles: np.ndarray) -> None:
        """Put each limb in a random pose of the middle share of its joints' ranges, or where it is told to be (d,)."""
        q = self.body.q_rest
        for name, limb in self.limbs.items():
            drawn = limb.random_pose(share, rng)
            q = limb.with_angles(q, angles.get(name, drawn))
        self.put(q)

    @property
    def q(self) -> np.ndarray:
        """Its joints' angles (m,), rad."""
        return self.data.qpos[self._joints].copy()

    def put(self, q: np.ndarray) -> None:
        """Put its joints at angles (m,), rad."""
        self.data.qpos[self._joints] = q
        mujoco.mj_kinematics(self.body.model, self.data)

    def in_world(self, point: np.ndarray) -> np.ndarray:
        """A point (3,), m, of the head's frame in the world."""
        rotation, position = self.eyes.head(self.data)
        return position + rotation @ point

    def in_head(self, point: np.ndarray) -> np.ndarray:
        """A point (3,), m, of the world in the head's frame."""
        rotation, position = self.eyes.head(self.data)
        return (point - position) @ rotation

    def within(self, angles: np.ndarray) -> bool:
        """Whether both eyes can look at angles (2, 2), rad."""
        return all((eye.within(pair) == pair).all() for eye, pair in zip(self.eyes.eyes, angles, strict=True))

    def on_ball(self) -> np.ndarray:
        """Receptors of each eye (2,) that see the ball, not hidden by anything."""
        parts = self.eyes.scene.place(self.data).parts
        layouts = self.eyes.near(self.data, self.ball.centre, self.ball.radius)
        origins, directions = self.eyes.rays(self.data, layouts)
        reach = (np.linalg.norm(self.ball.centre - origins, axis=1) + self.ball.radius).astype(REAL)
        seen = intersect(parts, origins, directions, reach).part == len(parts) - 1
        return np.array([side.sum() for side in np.split(seen, [layouts[0].count])])

    def look(self) -> np.ndarray:
        """Optic nerve vectors of both eyes as stored, (2, n) uint8."""
        return as_bytes(self.eyes.see(self.data))
