"""Desired accelerations and inverse dynamics (Nakada et al. 2018, Appendix B, Eq. 7)."""

from __future__ import annotations

import numpy as np

from anthro.body import hill
from anthro.body.simulator import Simulator
from anthro.motor.limb import Limb

STEP = 0.1  # h of Eq. 7, s
LEAST_STIFFNESS = 1e-3  # N m/rad, of a passive joint
RANGE_ROUNDS = 10  # of finding the passive joints that stand at an end of their range
REDUCTION = 0.1  # gamma, the error reduction rate


def pose_acceleration(q, v, goal, goal_velocity=0.0, step=STEP, reduction=REDUCTION):
    """PD acceleration towards a goal pose, rad/s^2 (Eq. 7): k_p = 2 (1 - gamma) / h^2, k_d = 2/h."""
    proportional, derivative = 2.0 * (1.0 - reduction) / step**2, 2.0 / step
    return proportional * (np.asarray(goal) - q) + derivative * (goal_velocity - v)


def required_torque(simulator: Simulator, acceleration) -> np.ndarray:
    """Joint torque (nv,) N m that the muscles must make for an acceleration (nv,) rad/s^2, None for none.

    Inverse dynamics at the simulator's present state: gravity, Coriolis terms, joint springs, joint damping, limit
    springs and ligaments included. Where the root is free, its rows say what must hold it.
    """
    torque = simulator.data.qfrc_bias - simulator.ligament_torque()
    torque[-simulator.body.dof_count :] -= simulator.joint_torque()
    return torque if acceleration is None else torque + simulator.mass @ acceleration


def torque_problem(simulator: Simulator, limb: Limb, others=None, acceleration=None) -> tuple[np.ndarray, np.ndarray]:
    """Moment matrix A (d + p, n) N m and torque b (d + p,) N m of the muscle problem A a = b of one limb.

    A holds the torque of each of the limb's muscles on its driven, then its passive joints at full activation, at the
    present strains and strain rates; b is the required torque less what the parallel elements of all muscles make by
    themselves, and less what the body's other muscles make with activations ``others`` (n_body,), those of the limb's
    own not being looked at.
    """
    body = simulator.body
    e, rate = simulator.strain, simulator.strain_rate
    tension, strength = (force(e, rate, body.max_force) for force in (hill.passive_force, hill.active_force))
    chosen = limb.muscles
    if others is not None:
        pull = others * strength
        pull[chosen] = 0.0
        tension = tension + pull
    torque = required_torque(simulator, acceleration) - simulator.muscle_torque(tension)
    strength = strength[chosen]
    matrix = simulator.torque_matrix(chosen, limb.rows, strength)
    return matrix, torque[np.concatenate([limb.columns, limb.passive_columns])]


class Yielding:
    """How a limb's passive joints give way, linearized at the simulator's present state.

    Ribs and patellae are the passive joints q_p of Zhou et al. 2021, Appendix B, Eq. 3. With K the stiffness of
    ligaments and joint springs, balance of the passive joints under torques t_p asks for a displacement K_pp^-1 t_p.

    Attributes
    ----------
    gradient : (p,) N m, slopes of the energy of ligaments and joint springs.
    """

    def __init__(self, simulator: Simulator, limb: Limb):
        self._limb, body = limb, limb.body
        stiffness = simulator.ligament_stiffness(limb.passive_columns)
        own = stiffness[:, limb.passive_columns]
        own[np.diag_indices_from(own)] += body.joint_stiffness[limb.passive] + LEAST_STIFFNESS
        self._own, self._coupling = own, stiffness[:, limb.columns]
        self._angles = simulator.joint_angles[limb.passive]
        self.gradient = body.joint_stiffness[limb.passive] * self._angles
        self.gradient -= simulator.ligament_torque()[limb.passive_columns]

    def to_rest(self) -> np.ndarray:
        """Displacement (p,) rad after which ligaments and springs balance by themselves, within the joints' ranges."""
        low, high = (self._limb.body.q_range[self._limb.passive] - self._angles[:, None]).T
        change, held = np.zeros_like(low), None
        for _ in range(RANGE_ROUNDS):
            slope, before = self.gradient + self._own @ change, held
            held = ((change <= low) & (slope > 0.0)) | ((change >= high) & (slope < 0.0))
            if before is not None and (held == before).all():
                break
            free, pull = ~held, self.gradient + self._own[:, held] @ change[held]
            change[free] = np.linalg.solve(self._own[np.ix_(free, free)], -pull[free])
            change = np.clip(change, low, high)
        return change

    def following(self, change) -> np.ndarray:
        """Displacement (p,) rad of the passive joints that a ``change`` (d,) rad of the driven ones brings."""
        return np.linalg.solve(self._own, -self._coupling @ change)

    def condense(self, torque) -> np.ndarray:
        """Torques (d + p, ...) on all joints as (t, ...) N m on those that muscles hold.

        What muscles do to a joint that yields, a patella, reaches the driven ones through its ligament: its torque
        displaces it by K_yy^-1 t_y, which pulls at the driven joints by -K_dy K_yy^-1 t_y.
        """
        count, driven = self._limb.torques, len(self._limb.driven)
        yielding = slice(count - driven, None)
        kept = np.array(torque[:count])
        kept[:driven] -= self._coupling[yielding].T @ np.linalg.solve(self._own[yielding, yielding], torque[count:])
        return kept


def effort_problem(simulator: Simulator, limb: Limb, others=None, acceleration=None) -> tuple[np.ndarray, np.ndarray]:
    """:func:`torque_problem` on the joints that muscles hold, (t, n) and (t,), where others yield."""
    matrix, torque = torque_problem(simulator, limb, others, acceleration)
    if len(torque) > limb.torques:
        yielding = Yielding(simulator, limb)
        matrix, torque = yielding.condense(matrix), yielding.condense(torque)
    return matrix, torque
