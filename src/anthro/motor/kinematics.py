"""Inverse kinematics: one canonical pose for each target (Nakada et al. 2018, Appendix B).

A hand position leaves four of the arm's seven degrees of freedom open, an orientation of T1 most of the spine's. The
pose is made a function of the target alone: damped least squares from the rest posture, with the discrepancy led to
zero in equal parts, each iterate sliding in the null space towards rest. Angles count as shares of their joints'
ranges, so that bending is shared as the ranges are.
"""

from __future__ import annotations

from typing import NamedTuple

import mujoco
import numpy as np
from numba import njit

from anthro.errors import UserError
from anthro.motor.limb import Limb

LIMIT_MARGIN = 0.05  # share of each joint's range that canonical poses keep from its limits
REACHED = 1e-3  # m or rad
LONGEST_STEP = 0.2  # of the half range


class Pose(NamedTuple):
    """Canonical pose (d,) rad of a target and how far the limb is from the target there, m or rad."""

    q: np.ndarray
    error: float

    @property
    def reached(self) -> bool:
        return self.error < REACHED


@njit(cache=True)
def _pose_step(jacobian, gap, towards_rest, free, damping, null_gain):
    """One step of damped least squares plus the null-space part of ``towards_rest``, free joints."""
    jacobian = jacobian * free
    pull = null_gain * towards_rest * free
    square = jacobian @ jacobian.T + damping * np.eye(len(gap))
    return jacobian.T @ np.linalg.solve(square, gap - jacobian @ pull) + pull


class InverseKinematics:
    """Solves targets for one limb, the rest of its body at rest; holds its own MuJoCo data."""

    def __init__(self, limb: Limb):
        self.limb, body = limb, limb.body
        self._model, self._data = body.model, mujoco.MjData(body.model)
        first = body.model.nq - body.dof_count
        self._angles = self._data.qpos[first:]
        self._angles[:] = body.q_rest
        self._rest = body.q_rest[limb.driven]
        margin = LIMIT_MARGIN * 2.0 * limb.half_range
        self._low, self._high = limb.low + margin, limb.high - margin
        self._linear, self._angular = np.zeros((2, 3, body.model.nv))

    def feature(self, q) -> np.ndarray:
        """What the limb does in the world at angles ``q`` (d,) rad: a target that this pose reaches."""
        self._place(q)
        return self.limb.feature(self._data)

    def solve(self, target, waypoints: int = 8, settle: int = 200) -> Pose:
        """Canonical pose of a target in the world. An unreachable one gives the nearest pose found.

        Raises
        ------
        UserError
            The target is not made of finite numbers, or of another shape than the limb's feature.
        """
        target = np.asarray(target, float)
        shape = self.limb.feature(self._data).shape
        if target.shape != shape or not np.isfinite(target).all():
            raise UserError(f"{self.limb.name}: a target is {shape} finite numbers, got {target.tolist()}")
        q = self._rest.copy()
        self._place(q)
        start = self.limb.offset(self._data, target)
        for left in np.linspace(1.0, 0.0, waypoints, endpoint=False)[1:]:
            q = self._descend(q, target, left * start, 6)
        q = self._descend(q, target, np.zeros_like(start), settle)
        self._place(q)
        return Pose(q, self.limb.distance(self._data, target))

    def _place(self, q) -> None:
        self._angles[self.limb.driven] = q
        mujoco.mj_kinematics(self._model, self._data)

    def _descend(self, q, target, kept, iterations: int) -> np.ndarray:
        for _ in range(iterations):
            self._place(q)
            gap = self.limb.offset(self._data, target) - kept
            new = np.clip(q + self._step(q, gap), self._low, self._high)
            if (np.abs(new - q) / self.limb.bending).max() < 1e-5:
                return new
            q = new
        return q

    def _slopes(self) -> np.ndarray:
        """Jacobian (width, d) of the discrepancy's features by shares of the half ranges."""
        limb, data = self.limb, self._data
        mujoco.mj_comPos(self._model, data)
        mujoco.mj_jacSite(self._model, data, self._linear, self._angular, limb.site)
        rotation, base = data.site_xmat[limb.site].reshape(3, 3), data.xmat[limb.base].reshape(3, 3)
        slopes = limb.sense.jacobian(rotation, base, self._linear, self._angular)
        return slopes[:, limb.columns] * limb.bending

    def _step(self, q, gap) -> np.ndarray:
        """Bounded step; a joint that would leave its range is held and the others take over."""
        slopes, half = self._slopes(), self.limb.bending
        towards_rest = (self._rest - q) / half
        free = np.ones_like(q)
        for _ in range(3):
            change = _pose_step(slopes, gap, towards_rest, free, 1e-4, 0.2)
            change *= min(1.0, LONGEST_STEP / max(np.abs(change).max(), 1e-12))
            held = ((q <= self._low) & (change < 0.0)) | ((q >= self._high) & (change > 0.0))
            if not (held & (free > 0.0)).any():
                break
            free[held] = 0.0
        return change * half
