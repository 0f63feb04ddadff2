"""A body whose fixed root leans back: on a reclining chair, or laid on its back.

The root bone turns about the left-right axis through its origin, which for the sacrum is near the hips. It is placed
before each step, so that positions are right and gravity acts along the turned body; inertial forces of the base's own
motion are left out. A chair that reclines by 35 degrees and rises within 10 s accelerates the hands by less than
0.1 m/s^2, a hundredth of gravity.
"""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from anthro.body import Body
from anthro.body.simulator import ROOT
from anthro.errors import UserError


class Leaning:
    """Places the root of a movable body (:meth:`anthro.body.Body.movable`).

    Angles are in rad, positive backwards, zero where the body was built; each may be one number for points (3,), or an
    array (T,) for points (T, 3).

    Raises
    ------
    UserError
        The body's root is free.
    """

    def __init__(self, body: Body):
        if body.root_free:
            raise UserError(f"{body.name}: its root is free; only a fixed one can be made to lean")
        self._model = body.model
        self._origin = body.model.body_pos[ROOT].copy()
        self._place = self._origin.copy()
        self._upright = Rotation.from_quat(body.model.body_quat[ROOT], scalar_first=True)

    def put(self, angle: float) -> None:
        """Lean by an angle; a simulator notices at its next refresh, so at the end of its next step."""
        pose = self.pose(angle)
        self._model.body_pos[ROOT], self._model.body_quat[ROOT] = pose[:3], pose[3:]

    def rise(self, height: float) -> None:
        """Have the root higher by some m from the next :meth:`put` on."""
        self._place[2] += height

    def pose(self, angles) -> np.ndarray:
        """Position in m and quaternion (w first) of the root, (7,) or (T, 7)."""
        quaternion = (_turn(angles) * self._upright).as_quat(scalar_first=True)
        origin = np.broadcast_to(self._place, (*quaternion.shape[:-1], 3))
        return np.concatenate([origin, quaternion], axis=-1)

    def turn(self, directions, angles) -> np.ndarray:
        """Directions of the upright body, in the world."""
        return _turn(angles).apply(directions)

    def carry(self, points, angles) -> np.ndarray:
        """Points in m around the upright body, in the world."""
        return self._place + self.turn(np.asarray(points) - self._origin, angles)

    def raised(self, points, angles) -> np.ndarray:
        """Points in m of the world, as they lie around the upright body: the inverse of :meth:`carry`."""
        return self._origin + _turn(angles).inv().apply(np.asarray(points) - self._place)


def _turn(angles) -> Rotation:
    return Rotation.from_rotvec(np.multiply.outer(angles, [0.0, -1.0, 0.0]))
