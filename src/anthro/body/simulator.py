"""Forward dynamics of a muscle-driven body at 5 to 7 ms: linearly implicit Euler.

Zhou et al. 2021, Appendix B, Eq. 3 to 7. The velocity change of a step h solves

    (M + h D + h^2 K) dv = h (f - h K v)

with f all generalized forces at the start of the step, K = -df/dq and D = -df/dv of the muscles
(J^T diag(k) J over the path Jacobian J = dl/dq, the transposed moment arms), of the joint damping
and of the limit springs. Gravity and Coriolis terms are taken at the start of the step; the scheme
stays first order, and everything stiff is implicit.
"""

from __future__ import annotations

import mujoco
import numpy as np
from numba import njit

from anthro.body import hill
from anthro.body.model import Body
from anthro.errors import UserError

DEFAULT_STEP = 0.005
LIMIT_STIFFNESS = 800.0  # N m/rad beyond the anatomical range
LIMIT_DAMPING = 4.0  # N m s/rad beyond the anatomical range


@njit(cache=True)
def _dense_jacobian(values, row_start, row_count, columns, jacobian):
    jacobian[:] = 0.0
    for i in range(jacobian.shape[0]):
        for k in range(row_start[i], row_start[i] + row_count[i]):
            jacobian[i, columns[k]] = values[k]


@njit(cache=True)
def limit_torque(q, v, low, high):
    """Torque of the limit springs (m,) N m: none inside the range."""
    torque = np.zeros_like(q)
    for j in range(q.shape[0]):
        over = max(q[j] - high[j], 0.0) + min(q[j] - low[j], 0.0)
        if over != 0.0:
            pull = -LIMIT_STIFFNESS * over - LIMIT_DAMPING * v[j]
            # a limit pushes back and never sucks
            torque[j] = min(pull, 0.0) if over > 0.0 else max(pull, 0.0)
    return torque


@njit(cache=True)
def _solve_step(h, q, v, mass, force, jacobian, k, d, joint_damping, low, high):
    m = q.shape[0]
    weight = h * d + h * h * k
    system = mass.copy()
    stiffness_v = jacobian.T @ (k * (jacobian @ v))
    for i in range(jacobian.shape[0]):
        for r in range(m):
            left = jacobian[i, r] * weight[i]
            if left != 0.0:
                for c in range(m):
                    system[r, c] += left * jacobian[i, c]
    for j in range(m):
        system[j, j] += h * joint_damping[j]
        if q[j] > high[j] or q[j] < low[j]:
            system[j, j] += h * LIMIT_DAMPING + h * h * LIMIT_STIFFNESS
            stiffness_v[j] += LIMIT_STIFFNESS * v[j]
    return np.linalg.solve(system, h * (force - h * stiffness_v))


class Simulator:
    """Steps one body. State is read through properties; all arrays are views unless said.

    Parameters
    ----------
    body : the loaded body.
    step : time step h in s.
    """

    def __init__(self, body: Body, step: float = DEFAULT_STEP):
        self.body = body
        self.step_seconds = float(step)
        self.model, self.data = body.model, mujoco.MjData(body.model)
        self.low, self.high = np.ascontiguousarray(body.q_range.T)
        self.jacobian = np.zeros((body.muscle_count, body.dof_count))
        self.mass = np.zeros((body.dof_count, body.dof_count))
        self._path = (self.model.ten_J_rowadr, self.model.ten_J_rownnz, self.model.ten_J_colind)
        self._applied = np.zeros(body.dof_count)
        self.reset(body.q_rest)

    def reset(self, qpos, qvel=None, time: float = 0.0) -> None:
        """Set posture (m,) rad, velocity (m,) rad/s (zero when None) and time in s."""
        self.data.qpos[:] = qpos
        self.data.qvel[:] = 0.0 if qvel is None else qvel
        self.data.time = time
        self._applied[:] = 0.0
        self.refresh()

    def refresh(self) -> None:
        """Recompute everything that follows from position and velocity."""
        model, data = self.model, self.data
        mujoco.mj_fwdPosition(model, data)
        mujoco.mj_fwdVelocity(model, data)
        mujoco.mj_fullM(model, data, self.mass)
        _dense_jacobian(data.ten_J, *self._path, self.jacobian)
        self.strain = hill.strain(data.ten_length - self.body.tendon_length, self.body.slack_length)
        self.strain_rate = (self.jacobian @ data.qvel) / self.body.slack_length

    qpos = property(lambda self: self.data.qpos)
    qvel = property(lambda self: self.data.qvel)
    time = property(lambda self: self.data.time)

    @property
    def hand_position(self) -> np.ndarray:
        """Hand's position (3,) m, a copy."""
        return self.data.site_xpos[self.body.hand_site].copy()

    def push(self, force) -> None:
        """Apply a world force (3,) N at the hand until it is changed; zeros end it."""
        jacobian = np.zeros((3, self.body.dof_count))
        mujoco.mj_jacSite(self.model, self.data, jacobian, None, self.body.hand_site)
        self._applied[:] = jacobian.T @ np.asarray(force, float)

    def muscle_force(self, activation) -> np.ndarray:
        """Tensions (n,) N at the present strains and the given activations (n,)."""
        return hill.force(activation, self.strain, self.strain_rate, self.body.max_force)

    def step(self, activation) -> None:
        """Advance by one step with activations (n,) in [0, 1].

        Raises
        ------
        UserError
            The activations or the state are not finite; the state is kept.
        """
        body, data, h = self.body, self.data, self.step_seconds
        e, rate, strength = self.strain, self.strain_rate, body.max_force
        tension = hill.force(activation, e, rate, strength)
        force = (
            self._applied
            - data.qfrc_bias
            - body.joint_damping * data.qvel
            - self.jacobian.T @ tension
            + limit_torque(data.qpos, data.qvel, self.low, self.high)
        )
        if not np.isfinite(force).all():
            raise UserError(f"simulation is not finite at {data.time:.3f} s")
        change = _solve_step(
            h,
            data.qpos,
            data.qvel,
            self.mass,
            force,
            self.jacobian,
            hill.stiffness(activation, e, rate, strength) / body.slack_length,
            hill.damping(activation, e, rate, strength) / body.slack_length,
            body.joint_damping,
            self.low,
            self.high,
        )
        data.qvel += change
        mujoco.mj_integratePos(self.model, data.qpos, data.qvel, h)
        data.time += h
        self.refresh()

    def energy(self) -> float:
        """Kinetic, gravitational and elastic energy (parallel elements, limit springs), J."""
        data, body = self.data, self.body
        kinetic = 0.5 * data.qvel @ self.mass @ data.qvel
        gravity = -sum(self.model.body_mass * (data.xipos @ self.model.opt.gravity))
        elastic = hill.passive_energy(self.strain, body.max_force, body.slack_length).sum()
        over = np.maximum(data.qpos - self.high, 0.0) + np.minimum(data.qpos - self.low, 0.0)
        return float(kinetic + gravity + elastic + 0.5 * LIMIT_STIFFNESS * (over @ over))
