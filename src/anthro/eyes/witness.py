"""A seated body in random postures, with a ball before its eyes: what the vision DNNs' pairs are pictures of."""

from __future__ import annotations

from collections.abc import Sequence

import mujoco
import numpy as np

from anthro.body import Body
from anthro.eyes.scene import Scene, sole_height
from anthro.eyes.sight import Eyes, as_bytes
from anthro.eyes.vision import BALL_RADIUS, RED, WHITE
from anthro.motor.limb import Limb, limb_plan
from anthro.render.parts import Ball, Part
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
    data : mujoco.MjData
        Where the body lies.
    """

    def __init__(self, body: Body, limbs: dict[str, dict], retina: str, seed: int):
        self.body, self.data = body, mujoco.MjData(body.model)
        self.limbs = {name: Limb(limb_plan({"name": name} | plan), body) for name, plan in limbs.items()}
        self._joints = slice(body.model.nq - body.dof_count, None)
        self._balls = {colour: Ball(BALL_RADIUS, colour) for colour in COLOURS}
        self.eyes = Eyes(body, Scene(body.model, floor=sole_height(body), stool=True), retina, seed=seed)
        self.show(WHITE)

    def show(self, colour: str) -> None:
        """Let the ball be `WHITE` or `RED` from now on."""
        self.ball = self._balls[colour]
        self.eyes.scene.balls = [self.ball]

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
        scene = self.eyes.scene.place(self.data)
        origins, directions = self.eyes.rays(self.data)
        away = self.ball.centre - origins
        along = (away * directions).sum(axis=1)
        near = np.flatnonzero((along > 0) & ((away * away).sum(axis=1) - along**2 < self.ball.radius**2))
        if not len(near):
            return np.zeros(2, int)
        parts = [*before(scene.parts[:-1], origins[:: len(origins) // 2], self.ball), self.ball]
        hits = intersect(parts, origins[near], directions[near])
        seen = near[hits.part == len(parts) - 1]
        return np.bincount(2 * seen // len(origins), minlength=2)

    def look(self) -> np.ndarray:
        """Optic nerve vectors of both eyes as stored, (2, n) uint8."""
        return as_bytes(self.eyes.see(self.data))


def before(parts: Sequence[Part | Ball], origins: np.ndarray, ball: Ball) -> list[Part | Ball]:
    """Those of the parts that may hide some of a ball from points (k, 3) m: they come near the way from one to it."""
    centres, radii = np.array([part.centre for part in parts]), np.array([part.radius for part in parts])
    ways = (ball.centre - origins)[:, None]
    along = ((centres - origins[:, None]) * ways).sum(axis=2) / (ways * ways).sum(axis=2)
    nearest = origins[:, None] + np.clip(along, 0.0, 1.0)[..., None] * ways
    near = np.linalg.norm(centres - nearest, axis=2) < radii + ball.radius
    return [parts[index] for index in np.flatnonzero(near.any(axis=0))]
