"""What the rest of a body does beside one limb: its other muscles follow random postures by their stretch reflex.

Zhou et al. 2021, Sec. 4.1.1, train the core while head, arms and legs move at random, so that it learns to bear their
forces. Here each of the other muscles contracts with its stretch beyond a threshold, and the thresholds travel from
one random posture's strains to the next. They give way to the limb: the limb is, in each of these postures, where it is
when the travel begins, so that muscles which cross its joints too do not draw it back to its rest.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from anthro.body.simulator import DEFAULT_STEP, Simulator
from anthro.motor.limb import Limb
from anthro.motor.reflex import STRAIN_GAIN, activation


@dataclass(frozen=True)
class Company:
    """The keys of ``others`` in ``config/data/<limb>_<role>.yaml``.

    Attributes
    ----------
    pose_share : of the half ranges by which the other joints leave their rest.
    travel_seconds : least and most time from one posture to the next.
    tone : activation at the threshold.
    """

    pose_share: float
    travel_seconds: tuple[float, float]
    tone: float


class Others:
    """The muscles of ``limb.body`` that are not the limb's; none move where the limb is alone."""

    def __init__(self, limb: Limb, company: Company | None, rng: np.random.Generator):
        body = limb.body
        self.limb, self.company, self.rng = limb, company, rng
        self._muscles = np.setdiff1d(np.arange(body.muscle_count), limb.muscles)
        own = np.concatenate([limb.driven, limb.passive])
        self._joints = np.setdiff1d(np.arange(body.dof_count), own)
        self._scratch = body.simulator() if len(self._muscles) else None
        self._activation = np.zeros(body.muscle_count)
        self._left = 0

    def pose(self, present: np.ndarray | None = None) -> np.ndarray:
        """A posture (m,) rad of the whole body: the other joints at random about their rest, the limb's as at present.

        Without `present`, angles (m,) rad of all joints, the limb is at rest.
        """
        body, joints = self.limb.body, self._joints
        q = (body.q_rest if present is None else present).copy()
        q[joints] = body.q_rest[joints]
        if self.company and len(joints):
            low, high = body.q_range[joints].T
            away = 0.5 * (high - low) * self.rng.uniform(-1.0, 1.0, len(joints))
            q[joints] = np.clip(q[joints] + self.company.pose_share * away, low, high)
        return q

    def begin(self, simulator: Simulator) -> None:
        """Start at the simulator's posture."""
        if self._scratch is not None:
            self._threshold = simulator.strain
            self._left = 0

    def activation(self, simulator: Simulator) -> np.ndarray:
        """Activations (n_body,) for the next step; the limb's own are what its caller last put there."""
        if self._scratch is not None:
            self._travel(simulator)
            stretch = (simulator.strain - self._threshold)[self._muscles]
            tone = self.company.tone if self.company else 0.0
            self._activation[self._muscles] = activation(tone + STRAIN_GAIN * stretch)
        return self._activation

    def _travel(self, simulator: Simulator) -> None:
        if self.company is None:
            return
        if self._left == 0:
            self._left = round(self.rng.uniform(*self.company.travel_seconds) / DEFAULT_STEP)
            self._scratch.reset(self.pose(simulator.joint_angles))
            self._rate = (self._scratch.strain - self._threshold) / self._left
        self._threshold = self._threshold + self._rate
        self._left -= 1
