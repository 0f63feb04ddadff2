"""Single states along imagined reaches, labelled by the teacher: the breadth of the training data.

Successive states of a rollout resemble each other, so that many pairs tell little. Here every pair
is a state of its own: somewhere on the way between two targets' canonical poses, more often near
the end, off the way by a little, with a drive that holds a pose ahead or behind.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from anthro.body import Body
from anthro.body.simulator import DEFAULT_STEP
from anthro.motor.reflex import DRIVE_RANGE, STRAIN_GAIN
from anthro.motor.teacher import Teacher


@dataclass(frozen=True)
class Scatter:
    """How states scatter; the keys of ``postures`` in ``config/data/<dataset>.yaml``."""

    targets: int
    near_share: float
    pose_angle: tuple[float, float]
    drive_angle: tuple[float, float]
    drive_noise: tuple[float, float]


class Postures:
    """Generates labelled single states (offset, drive, strain, label) without end.

    Parameters
    ----------
    poses : function that draws a pose (m,) rad whose hand is a target.
    """

    def __init__(
        self, body: Body, teacher: Teacher, poses, scatter: Scatter, rng: np.random.Generator
    ):
        self.body, self.teacher, self.scatter, self.rng = body, teacher, scatter, rng
        self._poses = poses
        self._simulator = body.simulator(DEFAULT_STEP)

    def __iter__(self):
        solve, hand = self.teacher.kinematics.solve, self.teacher.kinematics.hand
        targets = [hand(self._poses()) for _ in range(self.scatter.targets)]
        canonical = [solve(target) for target in targets]
        while True:
            start, end = self.rng.integers(len(targets), size=2)
            self.teacher.aim_at_pose(canonical[end])
            yield self._state(canonical[start].q, canonical[end].q, targets[end])

    def _spread(self, bounds) -> float:
        """A scale drawn log-uniformly between two bounds."""
        return float(np.exp(self.rng.uniform(*np.log(bounds))))

    def _state(self, start, end, target):
        rng, scatter = self.rng, self.scatter
        left = rng.random() ** 3 if rng.random() < scatter.near_share else rng.random()
        away = self._spread(scatter.pose_angle) * rng.normal(size=len(end))
        q = np.clip(end + left * (start - end) + away, *self.body.q_range.T)
        intended = q + self._spread(scatter.drive_angle) * rng.normal(size=len(end))
        drive, strain_there = self.teacher.holding_state(np.clip(intended, *self.body.q_range.T))
        self._simulator.reset(q)
        strain = self._simulator.strain
        drive = drive + STRAIN_GAIN * (strain - strain_there)
        drive += self._spread(scatter.drive_noise) * rng.normal(size=len(drive))
        drive = np.clip(drive, *DRIVE_RANGE)
        label = self.teacher.voluntary(self._simulator, drive)
        return target - self._simulator.hand_position, drive, strain, label
