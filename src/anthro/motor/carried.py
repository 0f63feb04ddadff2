"""Controllers of limbs that hang on a body which moves too; they were trained on one that rests.

Muscles of the neck and the arms reach down to the chest and the girdle. When the trunk bends they are stretched by
joints that are not their limb's, by more than any stretch they learned from, and their networks answer as if the limb
had moved. Such a controller is told the strains that the limb's own joints make.
"""

from __future__ import annotations

import numpy as np

from anthro.body.simulator import Simulator
from anthro.motor.controller import NeuromuscularController
from anthro.motor.feedback import PLAIN, Feedback
from anthro.motor.limb import Limb
from anthro.motor.network import FeedForward


class CarriedController(NeuromuscularController):
    """A controller of a limb whose base is moved by other limbs, on a body with a fixed root; parameters as there."""

    def __init__(
        self,
        limb: Limb,
        voluntary: FeedForward,
        reflex: FeedForward | None,
        pace: float = 1.0,
        feedback: Feedback = PLAIN,
    ):
        super().__init__(limb, voluntary, reflex, pace, feedback)
        self._own = np.concatenate([limb.driven, limb.passive])
        self._scratch = limb.body.simulator()

    def strains(self, simulator: Simulator) -> tuple[np.ndarray, np.ndarray]:
        """Strains (n,) and strain rates (n,) 1/s as they would be with all joints but the limb's own at rest."""
        body, own = self.limb.body, self._own
        q, v = body.q_rest.copy(), np.zeros(body.dof_count)
        q[own], v[own] = simulator.joint_angles[own], simulator.joint_velocities[own]
        self._scratch.reset(q, v)
        return self.limb.strains(self._scratch)
