"""Desired accelerations and inverse dynamics (Nakada et al. 2018, Appendix B, Eq. 7)."""

from __future__ import annotations

import numpy as np

from anthro.body import hill
from anthro.body.simulator import Simulator

STEP = 0.1  # h of Eq. 7, s
REDUCTION = 0.1  # gamma, the error reduction rate


def pose_acceleration(q, v, goal, goal_velocity=0.0, step=STEP, reduction=REDUCTION):
    """PD acceleration towards a goal pose, rad/s^2 (Eq. 7): k_p = 2 (1 - gamma) / h^2, k_d = 2/h."""
    proportional, derivative = 2.0 * (1.0 - reduction) / step**2, 2.0 / step
    return proportional * (np.asarray(goal) - q) + derivative * (goal_velocity - v)


def required_torque(simulator: Simulator, acceleration) -> np.ndarray:
    """Joint torque (m,) N m that the muscles must make for an acceleration (m,) rad/s^2.

    Inverse dynamics of a fixed root at the simulator's present state, gravity, Coriolis terms, joint
    springs, joint damping and limit springs included.
    """
    return simulator.mass @ acceleration + simulator.data.qfrc_bias - simulator.joint_torque()


def effort_problem(simulator: Simulator, acceleration) -> tuple[np.ndarray, np.ndarray]:
    """Moment matrix A (m, n) N m and torque b (m,) N m of the muscle problem A a = b.

    A holds each muscle's joint torque at full activation at the present strains and strain rates;
    b is the required torque less what the parallel elements make by themselves.
    """
    body, moment_arm = simulator.body, -simulator.jacobian.T
    e, rate = simulator.strain, simulator.strain_rate
    strength = hill.active_force(e, rate, body.max_force)
    passive = hill.passive_force(e, rate, body.max_force)
    torque = required_torque(simulator, acceleration) - moment_arm @ passive
    return np.ascontiguousarray(moment_arm * strength), torque
