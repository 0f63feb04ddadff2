"""Inverse kinematics: one canonical pose for each target (Nakada et al. 2018, Appendix B).

A hand position leaves four of the arm's seven degrees of freedom open. The pose is made a function
of the target alone: damped least squares from the rest posture, along the straight line from the
rest hand to the target, each iterate sliding in the null space towards rest.
"""

from __future__ import annotations

from typing import NamedTuple

import mujoco
import numpy as np
from numba import njit

from anthro.body import Body
from anthro.errors import UserError

LIMIT_MARGIN = 0.05  # share of each joint's range that canonical poses keep from its limits
REACHED = 1e-3  # m


class Pose(NamedTuple):
    """Canonical pose (m,) rad of a target and how far its hand is from it, m."""

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
    square = jacobian @ jacobian.T + damping * np.eye(3)
    return jacobian.T @ np.linalg.solve(square, gap - jacobian @ pull) + pull


class InverseKinematics:
    """Solves targets for one body; holds its own MuJoCo data."""

    def __init__(self, body: Body):
        self.body = body
        self._data = mujoco.MjData(body.model)
        low, high = body.q_range.T
        margin = LIMIT_MARGIN * (high - low)
        self._low, self._high = low + margin, high - margin
        self._jacobian = np.zeros((3, body.dof_count))

    def hand(self, q) -> np.ndarray:
        """Hand position (3,) m at pose ``q`` (m,) rad."""
        self._data.qpos[:] = q
        mujoco.mj_kinematics(self.body.model, self._data)
        return self._data.site_xpos[self.body.hand_site].copy()

    def solve(self, target, waypoints: int = 8, settle: int = 200) -> Pose:
        """Canonical pose of a target (3,) m. An unreachable one gives the nearest pose found.

        Raises
        ------
        UserError
            The target is not three finite numbers.
        """
        target = np.asarray(target, float)
        if target.shape != (3,) or not np.isfinite(target).all():
            raise UserError(f"target must be three finite numbers in m, got {target.tolist()}")
        q = self.body.q_rest.copy()
        start = self.hand(q)
        for k in range(1, waypoints + 1):
            q = self._descend(q, start + (target - start) * k / waypoints, 6)
        q = self._descend(q, target, settle)
        return Pose(q, float(np.linalg.norm(target - self.hand(q))))

    def _descend(self, q, target, iterations: int) -> np.ndarray:
        for _ in range(iterations):
            gap = target - self.hand(q)
            mujoco.mj_comPos(self.body.model, self._data)
            mujoco.mj_jacSite(
                self.body.model, self._data, self._jacobian, None, self.body.hand_site
            )
            change = self._step(q, gap)
            new = np.clip(q + change, self._low, self._high)
            if np.abs(new - q).max() < 1e-5:
                return new
            q = new
        return q

    def _step(self, q, gap) -> np.ndarray:
        """Bounded step; a joint that would leave its range is held and the others take over."""
        towards_rest = self.body.q_rest - q
        free = np.ones_like(q)
        for _ in range(3):
            change = _pose_step(self._jacobian, gap, towards_rest, free, 1e-4, 0.2)
            change *= min(1.0, 0.2 / max(np.abs(change).max(), 1e-12))
            held = ((q <= self._low) & (change < 0.0)) | ((q >= self._high) & (change > 0.0))
            if not (held & (free > 0.0)).any():
                break
            free[held] = 0.0
        return change
