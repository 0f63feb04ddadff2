"""Random targets that a limb can reach and that its muscles can hold."""

from __future__ import annotations

import numpy as np

from anthro.motor.kinematics import Pose
from anthro.motor.teacher import Teacher

TRIES = 10  # at a target near a pose, before any other is taken


class Targets:
    """Draws targets: what the limb does in random poses, where its muscles can hold the canonical pose.

    Parameters
    ----------
    teacher : solves the targets and knows the muscles.
    share : of each joint's range that poses are drawn from.

    Attributes
    ----------
    drawn, refused : number of poses looked at, and of those that the muscles cannot hold.
    """

    def __init__(self, teacher: Teacher, share: float, rng: np.random.Generator):
        self.teacher, self.share, self.rng = teacher, share, rng
        self.drawn = self.refused = 0

    def draw(self) -> tuple[np.ndarray, Pose]:
        """A target in the world and its canonical pose."""
        while True:
            target, pose, is_held = self._look(self.teacher.limb.random_pose(self.share, self.rng))
            if is_held:
                return target, pose

    def near(self, angles, spread: float) -> tuple[np.ndarray, Pose]:
        """A target that a pose close to ``angles`` (d,) reaches; any one where the muscles hold none of those."""
        for _ in range(TRIES):
            target, pose, is_held = self._look(self.teacher.limb.near(angles, spread, self.rng))
            if is_held:
                return target, pose
        return self.draw()

    def _look(self, angles) -> tuple[np.ndarray, Pose, bool]:
        target = self.teacher.kinematics.feature(angles)
        pose = self.teacher.kinematics.solve(target)
        is_held = self.teacher.lacks(pose) <= self.teacher.limb.plan.lack
        self.drawn, self.refused = self.drawn + 1, self.refused + (not is_held)
        return target, pose, is_held
