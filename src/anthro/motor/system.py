"""The motor control architecture: independent controllers on one body (Zhou et al. 2021, Sec. 5.1, Fig. 6)."""

from __future__ import annotations

import numpy as np

from anthro.body import Body
from anthro.body.simulator import Simulator
from anthro.errors import UserError


class MotorSystem:
    """Some limbs' policies on one body; muscles of no limb are limp.

    Parameters
    ----------
    policies : a :class:`~anthro.motor.controller.NeuromuscularController` or
        :class:`~anthro.motor.teacher.TeacherPolicy` for each limb's name.

    Raises
    ------
    UserError
        Two limbs share a muscle, or a policy's limb is of another body.
    """

    def __init__(self, body: Body, policies: dict):
        self.body, self.policies = body, dict(policies)
        self._activation = np.zeros(body.muscle_count)
        taken = np.zeros(body.muscle_count, int)
        for name, policy in self.policies.items():
            if policy.limb.body.muscle_count != body.muscle_count:
                raise UserError(f"{name}: its controller is for {policy.limb.body.name}, not for {body.name}")
            taken[policy.limb.muscles] += 1
        if taken.max(initial=0) > 1:
            raise UserError(f"{body.name}: {', '.join(self.policies)} share muscles")

    def reset(self, simulator: Simulator, drives: dict | None = None) -> None:
        """Begin at the simulator's state with each limb's neural drive (n,), zero where none is given."""
        for name, policy in self.policies.items():
            policy.reset(simulator, (drives or {}).get(name))

    def activation(self, simulator: Simulator, targets: dict) -> np.ndarray:
        """Activations (n_body,) for the next control step; limbs without a target in ``targets`` are limp."""
        self._activation[:] = 0.0
        for name, policy in self.policies.items():
            if targets.get(name) is not None:
                policy.limb.into(self._activation, policy.activation(simulator, targets[name]))
        return self._activation
