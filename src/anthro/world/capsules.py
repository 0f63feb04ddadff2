"""The body as balls meet it: capsules over its limbs, from ``capsules.csv`` beside this module.

A capsule is all that lies within its radius of a line on one bone. The line's ends ``a`` and ``b`` are given from the
bone's joint centre, along the axes of the neutral posture; as in ``config/body``, rows of side R have a left twin.
Segments of limbs are as long as the body's own and as thick as a cylinder of their mass (de Leva 1996) and density
(Winter 2005, Biomechanics and Motor Control of Human Movement, after Dempster 1955).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import mujoco
import numpy as np
from numba import njit

from anthro.body import Body
from anthro.body.parts import left_name
from anthro.body.simulator import Simulator
from anthro.body.tables import read_table
from anthro.errors import UserError

TABLE = Path(__file__).with_suffix(".csv")


@dataclass(frozen=True)
class Capsule:
    """One capsule: the limb that it is part of, its bone, its line's ends in the bone's frame, its radius; m."""

    capsule: str
    side: str
    limb: str
    bone: str
    ax_m: float
    ay_m: float
    az_m: float
    bx_m: float
    by_m: float
    bz_m: float
    radius_m: float
    quality: str
    source: str

    ends = property(lambda self: ((self.ax_m, self.ay_m, self.az_m), (self.bx_m, self.by_m, self.bz_m)))

    def twin(self) -> Capsule:
        """The same capsule on the left."""
        return replace(
            self,
            capsule=left_name(self.capsule),
            limb=self.limb.replace("right", "left"),
            bone=left_name(self.bone),
            ay_m=-self.ay_m,
            by_m=-self.by_m,
        )


def read_capsules(path: Path = TABLE) -> list[Capsule]:
    """The rows of a table and the left twins of those of side R.

    Raises
    ------
    UserError
        As :func:`anthro.body.tables.read_table`, or a radius is not positive.
    """
    rows = read_table(path, Capsule)
    for row in rows:
        if not row.radius_m > 0.0:
            raise UserError(f"{path}: radius of {row.capsule} must be positive, got {row.radius_m}")
    return rows + [row.twin() for row in rows if row.side == "R"]


class Capsules:
    """Where the k capsules of a body are, and how they move.

    Parameters
    ----------
    body : the body; capsules on bones that it lacks are left out.
    rows : all capsules; those of the table when None.

    Attributes
    ----------
    rows : the body's capsules.  radius : (k,) m.
    ends : (k, 2, 3) m, of the lines.  speeds : (k, 2, 3) m/s, velocities of the ends.

    Raises
    ------
    UserError
        The body has none of the bones.
    """

    def __init__(self, body: Body, rows: list[Capsule] | None = None):
        place = {row: _bone(body, row.bone) for row in (read_capsules() if rows is None else rows)}
        self.rows = [row for row, index in place.items() if index >= 0]
        if not self.rows:
            raise UserError(f"{body.name} has no bone that a capsule covers")
        self.radius = np.array([row.radius_m for row in self.rows])
        self._bones = np.array([place[row] for row in self.rows])
        self._local = np.array([row.ends for row in self.rows])
        self._roots = body.model.body_rootid[self._bones]
        self.ends, self.speeds = np.zeros((2, *self._local.shape))

    def __len__(self) -> int:
        return len(self.rows)

    def refresh(self, simulator: Simulator) -> None:
        """Place the capsules as the simulator has the body now."""
        d = simulator.data
        frames = self._bones, self._roots, self._local, d.xpos, d.xmat, d.cvel, d.subtree_com
        _refresh(*frames, simulator.base_velocity, self.ends, self.speeds)

    def clearance(self, points) -> np.ndarray:
        """Distances (n,) m of points (n, 3) from the nearest capsule's surface, negative inside."""
        points = np.asarray(points, float)[:, None, :]
        first, along = self.ends[:, 0], self.ends[:, 1] - self.ends[:, 0]
        share = ((points - first) * along).sum(axis=2) / np.maximum(np.square(along).sum(axis=1), 1e-12)
        nearest = first + np.clip(share, 0.0, 1.0)[..., None] * along
        return (np.linalg.norm(points - nearest, axis=2) - self.radius).min(axis=1)


def _bone(body: Body, name: str) -> int:
    return mujoco.mj_name2id(body.model, mujoco.mjtObj.mjOBJ_BODY, name)


@njit(cache=True)
def _refresh(bones, roots, local, position, rotation, velocity, centres, base, ends, speeds):
    """MuJoCo's velocities are angular, then linear of the point that passes the centre of mass of the whole tree."""
    for i in range(bones.shape[0]):
        turn, spin, centre = rotation[bones[i]], velocity[bones[i]], centres[roots[i]]
        for side in range(2):
            end, speed = ends[i, side], speeds[i, side]
            for axis in range(3):
                end[axis] = position[bones[i], axis]
                for k in range(3):
                    end[axis] += turn[3 * axis + k] * local[i, side, k]
            x, y, z = end[0] - centre[0], end[1] - centre[1], end[2] - centre[2]
            speed[0] = base[0] + spin[3] + spin[1] * z - spin[2] * y
            speed[1] = base[1] + spin[4] + spin[2] * x - spin[0] * z
            speed[2] = base[2] + spin[5] + spin[0] * y - spin[1] * x
