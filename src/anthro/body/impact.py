"""Impulses on a body: what a blow at a point of a bone changes at once.

A blow is short beside a step, so muscles, springs and stops have no time to answer: only masses do, and the velocity
change is M^-1 J^T p. The step that follows meets it as any other velocity.
"""

from __future__ import annotations

import mujoco
import numpy as np

from anthro.body.simulator import Simulator
from anthro.errors import UserError


def point_jacobian(simulator: Simulator, bone: str, point) -> np.ndarray:
    """Slopes (3, nv) of the position of a world point (3,) m that moves with a bone.

    Raises
    ------
    UserError
        There is no bone of that name.
    """
    model = simulator.model
    index = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_BODY, bone)
    if index < 0:
        raise UserError(f"{simulator.body.name} has no bone {bone!r}")
    jacobian = np.zeros((3, model.nv))
    mujoco.mj_jac(model, simulator.data, jacobian, None, np.asarray(point, float), index)
    return jacobian


def response(simulator: Simulator, impulse) -> np.ndarray:
    """Velocity change (nv,) that a generalized impulse (nv,), N s or N m s, makes at once: M^-1 times it."""
    change = np.zeros((1, simulator.model.nv))
    mujoco.mj_factorM(simulator.model, simulator.data)
    mujoco.mj_solveM(simulator.model, simulator.data, change, np.asarray(impulse, float)[None])
    return change[0]


def jolt(simulator: Simulator, change, ago: float = 0.0) -> None:
    """Change the velocity by ``change`` (nv,) as if it had been so ``ago`` s before the present, within a step."""
    simulator.qvel[:] += change
    mujoco.mj_integratePos(simulator.model, simulator.qpos, np.asarray(change, float), ago)
    simulator.refresh()
