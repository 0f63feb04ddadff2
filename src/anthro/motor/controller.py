"""The online neuromuscular controller (Nakada et al. 2018, Fig. 7, Eq. 1): networks only.

Nothing here, or in what it imports, solves inverse kinematics, inverse dynamics or an
optimisation; a test holds it to that.
"""

from __future__ import annotations

from functools import partial

import numpy as np

from anthro.body.simulator import DEFAULT_STEP, Simulator
from anthro.motor.feedback import PLAIN, Feedback, FeedbackState
from anthro.motor.limb import Limb
from anthro.motor.network import FeedForward
from anthro.motor.reflex import accumulate, activation


class NeuromuscularController:
    """Voluntary and reflex network of one limb, with the drive that they add up.

    Parameters
    ----------
    limb : what it senses and moves.
    voluntary : network of (offset, drive) or, ``proprioceptive``, (offset, drive, strain).
    reflex : network of (strain change, strain rate change); None switches the reflex off.
    pace : share of the voluntary network's adjustments that is made; 1, as they were trained.
    feedback : what is made of the discrepancy before the voluntary network is told it; by default nothing.
    """

    def __init__(
        self,
        limb: Limb,
        voluntary: FeedForward,
        reflex: FeedForward | None,
        pace: float = 1.0,
        feedback: Feedback = PLAIN,
    ):
        self.limb, self.voluntary, self.reflex, self.pace = limb, voluntary, reflex, pace
        self.proprioceptive = voluntary.n_in == limb.width + 2 * limb.size
        self.drive = np.zeros(limb.size)
        self._silent = np.zeros(limb.size)
        self._feedback = FeedbackState(feedback, DEFAULT_STEP)

    @classmethod
    def load(
        cls, limb: Limb, voluntary, reflex, inputs: str, pace: float = 1.0, feedback: Feedback = PLAIN
    ) -> NeuromuscularController:
        """Load both networks from their files; UserError when a shape does not fit."""
        width = limb.width + limb.size * (2 if inputs == "proprioceptive" else 1)
        reflex_net = reflex and FeedForward.load(reflex, inputs=2 * limb.size, outputs=limb.size)
        voluntary_net = FeedForward.load(voluntary, inputs=width, outputs=limb.size)
        return cls(limb, voluntary_net, reflex_net, pace, feedback)

    def reset(self, simulator: Simulator, drive=None) -> None:
        """Begin at the simulator's state with neural drive (n,), zero when None."""
        self.drive = np.zeros_like(self.drive) if drive is None else np.array(drive, float)
        self._strain, self._rate = self.strains(simulator)
        self._feedback.reset()

    def strains(self, simulator: Simulator) -> tuple[np.ndarray, np.ndarray]:
        """Strains (n,) and strain rates (n,) 1/s that it senses."""
        return self.limb.strains(simulator)

    def activation(self, simulator: Simulator, target) -> np.ndarray:
        """Activations (n,) of the limb's muscles for the next control step towards ``target`` (Eq. 1).

        The controller senses its limb's discrepancy from the target, its own drive, strains and strain rates; nothing
        else of the simulator is read.
        """
        offset = self._feedback.told(partial(self.limb.offset, simulator.data), target)
        return self.control(offset, *self.strains(simulator))

    def control(self, offset, strain, strain_rate) -> np.ndarray:
        """One control step from offset (width,) m or rad, strain (n,) and strain rate (n,) 1/s."""
        sensed = [offset, self.drive, strain] if self.proprioceptive else [offset, self.drive]
        voluntary = self.pace * self.voluntary.predict(np.concatenate(sensed))
        adjustment = self._silent
        if self.reflex is not None:
            change = np.concatenate([strain - self._strain, strain_rate - self._rate])
            adjustment = self.reflex.predict(change)
        self._strain, self._rate = strain, strain_rate
        self.drive = accumulate(self.drive, voluntary, adjustment)
        return activation(self.drive)
