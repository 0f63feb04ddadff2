"""Single states along imagined movements, labelled by the teacher: the breadth of the training data.

Successive states of a rollout resemble each other, so that many pairs tell little. Here every pair
is a state of its own: somewhere on the way between two targets' canonical poses, more often near
the end, off the way by a little, with a drive that holds a pose ahead or behind.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from anthro.body.simulator import DEFAULT_STEP
from anthro.motor.others import Others
from anthro.motor.reflex import DRIVE_RANGE, STRAIN_GAIN
from anthro.motor.targets import Targets
from anthro.motor.teacher import Teacher


@dataclass(frozen=True)
class Scatter:
    """How states scatter; the keys of ``postures`` in ``config/data/<dataset>.yaml``."""

    targets: int
    near_share: float
    pose_spread: tuple[float, float]
    drive_spread: tuple[float, float]
    drive_noise: tuple[float, float]


class Postures:
    """Generates labelled single states (offset, drive, strain, label) without end."""

    def __init__(self, teacher: Teacher, targets: Targets, others: Others, scatter: Scatter, rng: np.random.Generator):
        self.teacher, self.targets, self.others, self.scatter, self.rng = teacher, targets, others, scatter, rng
        self.limb = teacher.limb
        self._simulator = self.limb.body.simulator(DEFAULT_STEP)

    def __iter__(self):
        known = [self.targets.draw() for _ in range(self.scatter.targets)]
        while True:
            start, end = self.rng.integers(len(known), size=2)
            self.teacher.aim_at(*known[end])
            yield self._state(known[start][1].q, *known[end])

    def _spread(self, bounds) -> float:
        """A scale drawn log-uniformly between two bounds."""
        return float(np.exp(self.rng.uniform(*np.log(bounds))))

    def _state(self, start, target, end):
        rng, scatter, limb, simulator = self.rng, self.scatter, self.limb, self._simulator
        left = rng.random() ** 3 if rng.random() < scatter.near_share else rng.random()
        angles = limb.near(end.q + left * (start - end.q), self._spread(scatter.pose_spread), rng)
        intended = limb.near(angles, self._spread(scatter.drive_spread), rng)
        elsewhere = self.others.pose()
        drive, strain_there = self.teacher.holding_state(limb.with_angles(elsewhere, intended))
        simulator.reset(self.teacher.settled(limb.with_angles(elsewhere, angles)))
        strain, _ = limb.strains(simulator)
        drive = drive + STRAIN_GAIN * (strain - strain_there)
        drive += self._spread(scatter.drive_noise) * rng.normal(size=len(drive))
        drive = np.clip(drive, *DRIVE_RANGE)
        self.others.begin(simulator)
        self.teacher.others = self.others.activation(simulator)
        label = self.teacher.voluntary(simulator, drive)
        return limb.offset(simulator.data, target), drive, strain, label
