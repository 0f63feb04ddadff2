"""The space that a limb reaches: where its effector is in random poses, ahead of the body and clear of it."""

from __future__ import annotations

import mujoco
import numpy as np
from scipy.spatial import cKDTree

from anthro.body.rows import velocities_above
from anthro.body.simulator import ROOT
from anthro.errors import UserError
from anthro.motor.limb import Limb
from anthro.world.capsules import Capsules

SPACING = 0.05  # m from a sampled point, within which a point counts as reached
AHEAD = 0.15  # m, how far before the root points lie at least
LOWEST = 0.1  # m, least height over the floor
CLEAR = 0.06  # m, how far from the rest of the body


class Reach:
    """Points that a limb's effector reaches while the rest of the body is at rest.

    Parameters
    ----------
    limb : moves its effector.
    rng : of the poses.
    share : of each joint's range that poses are drawn from.
    count : number of points to keep.
    ahead, clear : m, see :data:`AHEAD` and :data:`CLEAR`.

    Attributes
    ----------
    points : (count, 3) m, in the world.

    Raises
    ------
    UserError
        ``share`` is not of (0, 1], ``count`` not positive, or hardly any pose is ahead, clear and over the floor.
    """

    def __init__(
        self,
        limb: Limb,
        rng: np.random.Generator,
        share: float = 0.7,
        count: int = 2000,
        ahead: float = AHEAD,
        clear: float = CLEAR,
    ):
        if not 0.0 < share <= 1.0 or count < 1:
            raise UserError(f"reach of {limb.name}: share must be of (0, 1] and count positive, got {share}, {count}")
        self.limb, self._rng = limb, rng
        rest = _others(limb)
        found, drawn = np.zeros((0, 3)), 0
        while len(found) < count:
            if drawn >= 100 * count:
                raise UserError(f"reach of {limb.name}: hardly any pose is ahead, clear and over the floor")
            points = self._sample(share, count)
            points = points[(points[:, 0] > limb.body.model.body_pos[ROOT, 0] + ahead) & (points[:, 2] > LOWEST)]
            found = np.vstack([found, points if rest is None else points[rest.clearance(points) > clear]])
            drawn += count
        self.points = found[:count]
        self._tree = cKDTree(self.points)

    def _sample(self, share: float, count: int) -> np.ndarray:
        limb, data = self.limb, mujoco.MjData(self.limb.body.model)
        points, angles = np.empty((count, 3)), data.qpos[len(data.qpos) - limb.body.dof_count :]
        for k in range(count):
            angles[:] = limb.with_angles(limb.body.q_rest, limb.random_pose(share, self._rng))
            mujoco.mj_kinematics(limb.body.model, data)
            points[k] = data.site_xpos[limb.site]
        return points

    def contains(self, points) -> np.ndarray:
        """Whether points (3,) or (n, 3) m are within :data:`SPACING` of one that is reached, () or (n,)."""
        return self._tree.query(np.asarray(points, float))[0] <= SPACING

    def draw(self) -> np.ndarray:
        """One of the reached points (3,) m."""
        return self.points[self._rng.integers(len(self.points))].copy()


def _others(limb: Limb) -> Capsules | None:
    """The capsules of the resting body that the limb does not move; None where there are none."""
    simulator = limb.body.simulator()
    own = np.zeros(limb.body.model.nv, bool)
    own[limb.columns] = True
    model = limb.body.model
    rows = [r for r in Capsules(limb.body).rows if not own[velocities_above(model, model.body(r.bone).id)].any()]
    if not rows:
        return None
    capsules = Capsules(limb.body, rows)
    capsules.refresh(simulator)
    return capsules
