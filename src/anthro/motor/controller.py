"""The online neuromuscular controller (Nakada et al. 2018, Fig. 7, Eq. 1): networks only.

Nothing here, or in what it imports, solves inverse kinematics, inverse dynamics or an
optimisation; a test holds it to that.
"""

from __future__ import annotations

import numpy as np

from anthro.motor.network import FeedForward
from anthro.motor.reflex import accumulate, activation

INPUTS = ("paper", "proprioceptive")


class NeuromuscularController:
    """Voluntary and reflex network of one limb, with the drive that they add up.

    Parameters
    ----------
    voluntary : network of (offset, drive) or, ``proprioceptive``, (offset, drive, strain).
    reflex : network of (strain change, strain rate change); None switches the reflex off.
    """

    def __init__(self, voluntary: FeedForward, reflex: FeedForward | None):
        self.voluntary, self.reflex = voluntary, reflex
        n = voluntary.n_out
        self.proprioceptive = voluntary.n_in == 3 + 2 * n
        self.drive = np.zeros(n)
        self._silent = np.zeros(n)

    @classmethod
    def load(cls, voluntary, reflex, muscles: int, inputs: str) -> NeuromuscularController:
        """Load both networks from their files; UserError when a shape does not fit."""
        width = 3 + muscles * (2 if inputs == "proprioceptive" else 1)
        reflex_net = reflex and FeedForward.load(reflex, inputs=2 * muscles, outputs=muscles)
        return cls(FeedForward.load(voluntary, inputs=width, outputs=muscles), reflex_net)

    def reset(self, simulator, drive=None) -> None:
        """Begin at the simulator's state with neural drive (n,), zero when None."""
        self.drive = np.zeros_like(self.drive) if drive is None else np.array(drive, float)
        self._strain, self._rate = simulator.strain, simulator.strain_rate

    def activation(self, simulator, target) -> np.ndarray:
        """Activations (n,) for the next control step towards ``target`` (3,) m (Eq. 1).

        The controller senses the hand's offset from the target, its own drive, strains and strain
        rates; nothing else of the simulator is read.
        """
        strain, rate = simulator.strain, simulator.strain_rate
        offset = target - simulator.hand_position
        return self.control(offset, strain, rate)

    def control(self, offset, strain, strain_rate) -> np.ndarray:
        """One control step from offset (3,) m, strain (n,) and strain rate (n,) 1/s."""
        sensed = [offset, self.drive, strain] if self.proprioceptive else [offset, self.drive]
        voluntary = self.voluntary.predict(np.concatenate(sensed))
        adjustment = self._silent
        if self.reflex is not None:
            change = np.concatenate([strain - self._strain, strain_rate - self._rate])
            adjustment = self.reflex.predict(change)
        self._strain, self._rate = strain, strain_rate
        self.drive = accumulate(self.drive, voluntary, adjustment)
        return activation(self.drive)
