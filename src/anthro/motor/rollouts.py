"""Rollouts that visit the states which a limb's networks will meet, labelled by the teacher.

An episode starts anywhere in the joint ranges, sometimes slack, and reaches for a few targets under
noise on the drive and pushes at the hand. Round 0 follows the teacher; later rounds follow the
networks of the round before (data aggregation, DAgger), still labelled by the teacher.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from anthro.body import Body
from anthro.body.simulator import DEFAULT_STEP, Simulator
from anthro.motor.controller import NeuromuscularController
from anthro.motor.reflex import DRIVE_RANGE, activation
from anthro.motor.teacher import Teacher, TeacherPolicy


@dataclass(frozen=True)
class Regimen:
    """What episodes are like; the keys of ``rollout`` in ``config/data/<dataset>.yaml``."""

    seconds_per_target: float
    targets_per_episode: int
    record_every: int
    start_share: float
    target_share: float
    near_target_probability: float
    near_target_angle: float
    slack_probability: float
    drive_noise: tuple[float, ...]
    drive_noise_correlation: float
    push_probability: float
    push_force: float
    push_seconds: float


def random_pose(body: Body, share: float, rng: np.random.Generator) -> np.ndarray:
    """Pose (m,) rad, uniform in the middle ``share`` of each joint's range."""
    low, high = body.q_range.T
    return 0.5 * (low + high) + 0.5 * share * (high - low) * rng.uniform(-1.0, 1.0, len(low))


class Episodes:
    """Generates labelled steps (offset, drive, strain, label) without end.

    Parameters
    ----------
    students : controllers of which each episode draws one; empty, the teacher moves the arm.
    """

    def __init__(
        self,
        body: Body,
        teacher: Teacher,
        students: list[NeuromuscularController],
        regimen: Regimen,
        rng: np.random.Generator,
    ):
        self.body, self.teacher, self.students = body, teacher, students
        self.regimen, self.rng = regimen, rng
        self.simulator: Simulator = body.simulator(DEFAULT_STEP)

    def __iter__(self):
        while True:
            yield from self._episode()

    def _episode(self):
        rng, regimen = self.rng, self.regimen
        self.simulator.reset(self._start_pose())
        drive = np.zeros(self.body.muscle_count)
        if rng.random() >= regimen.slack_probability:
            drive, _ = self.teacher.holding_state(self.simulator.qpos)
        policy = self._policy()
        policy.reset(self.simulator, drive)
        amplitude = rng.choice(regimen.drive_noise)
        noise = np.zeros_like(drive)
        for _ in range(regimen.targets_per_episode):
            noise = yield from self._reach(policy, amplitude, noise)

    def _policy(self):
        if self.students:
            return self.students[self.rng.integers(len(self.students))]
        return TeacherPolicy(self.teacher)

    def _start_pose(self) -> np.ndarray:
        """Half of the starts are canonical poses, where targets end, half are any poses."""
        q = random_pose(self.body, self.regimen.start_share, self.rng)
        if self.rng.random() < 0.5:
            return q
        return self.teacher.kinematics.solve(self.teacher.kinematics.hand(q)).q

    def _target(self) -> np.ndarray:
        rng, regimen = self.rng, self.regimen
        q = random_pose(self.body, regimen.target_share, rng)
        if rng.random() < regimen.near_target_probability:
            near = self.simulator.qpos + rng.normal(0.0, regimen.near_target_angle, len(q))
            q = np.clip(near, *self.body.q_range.T)
        return self.teacher.kinematics.hand(q)

    def _reach(self, policy, amplitude, noise):
        regimen, rng, simulator = self.regimen, self.rng, self.simulator
        target = self._target()
        self.teacher.aim(target)
        steps = round(regimen.seconds_per_target / simulator.step_seconds)
        pushed = range(0)
        if rng.random() < regimen.push_probability:
            first = int(rng.integers(steps))
            pushed = range(first, first + round(regimen.push_seconds / simulator.step_seconds))
            force = rng.normal(0.0, regimen.push_force, 3)
        for step in range(steps):
            if step % regimen.record_every == 0:
                label = self.teacher.voluntary(simulator, policy.drive)
                offset = target - simulator.hand_position
                yield offset, policy.drive.copy(), simulator.strain, label
            policy.activation(simulator, target)
            noise = regimen.drive_noise_correlation * noise + amplitude * rng.normal(size=len(noise))
            policy.drive = np.clip(policy.drive + noise, *DRIVE_RANGE)
            simulator.push(force if step in pushed else (0.0, 0.0, 0.0))
            simulator.step(activation(policy.drive))
        return noise
