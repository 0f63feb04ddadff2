"""Rollouts that visit the states which a limb's networks will meet, labelled by the teacher.

An episode starts anywhere in the joint ranges, sometimes slack, and reaches for a few targets under
noise on the drive and pushes at the hand. Round 0 follows the teacher; later rounds follow the
networks of the round before (data aggregation, DAgger), still labelled by the teacher.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from anthro.body.simulator import DEFAULT_STEP, Simulator
from anthro.motor.balance import Balance
from anthro.motor.controller import NeuromuscularController
from anthro.motor.kinematics import Pose
from anthro.motor.others import Others
from anthro.motor.reflex import DRIVE_RANGE, activation
from anthro.motor.targets import Targets
from anthro.motor.teacher import TeacherPolicy


@dataclass(frozen=True)
class Regimen:
    """What episodes are like; the keys of ``rollout`` in ``config/data/<dataset>.yaml``."""

    seconds_per_target: float
    targets_per_episode: int
    record_every: int
    start_share: float
    target_share: float
    near_target_probability: float
    near_target_spread: float
    slack_probability: float
    drive_noise: tuple[float, ...]
    drive_noise_correlation: float
    push_probability: float
    push_force: float
    push_seconds: float


class Episodes:
    """Generates labelled steps (offset, drive, strain, label) without end.

    Parameters
    ----------
    targets : draws targets, and knows the teacher whose labels are recorded.
    others : what the rest of the body does meanwhile.
    balance : where the body's support ends; an episode ends there too. None: it cannot fall.
    students : controllers of which each episode draws one; empty, the teacher moves the limb.

    Attributes
    ----------
    falls : number of episodes that ended early.
    """

    def __init__(
        self,
        targets: Targets,
        others: Others,
        balance: Balance | None,
        students: list[NeuromuscularController],
        regimen: Regimen,
        rng: np.random.Generator,
    ):
        self.targets, self.teacher, self.limb = targets, targets.teacher, targets.teacher.limb
        self.others, self.balance, self.students = others, balance, students
        self.regimen, self.rng, self.falls = regimen, rng, 0
        self.simulator: Simulator = self.limb.body.simulator(DEFAULT_STEP)

    def __iter__(self):
        while True:
            yield from self._episode()

    def _episode(self):
        rng, regimen, simulator = self.rng, self.regimen, self.simulator
        simulator.reset(self.teacher.settled(self.limb.with_angles(self.others.pose(), self._start_angles())))
        self.others.begin(simulator)
        if self.balance:
            self.balance.begin(simulator)
        drive = np.zeros(self.limb.size)
        if rng.random() >= regimen.slack_probability:
            drive, _ = self.teacher.holding_state(simulator.joint_angles)
        policy = self._policy()
        policy.reset(simulator, drive)
        amplitude = rng.choice(regimen.drive_noise)
        noise = np.zeros_like(drive)
        for _ in range(regimen.targets_per_episode):
            noise = yield from self._reach(policy, amplitude, noise)
            if noise is None:
                self.falls += 1
                return

    def _policy(self):
        if self.students:
            return self.students[self.rng.integers(len(self.students))]
        return TeacherPolicy(self.teacher)

    def _start_angles(self) -> np.ndarray:
        """Half of the starts are canonical poses, where targets end, half are any poses."""
        angles = self.limb.random_pose(self.regimen.start_share, self.rng)
        if self.rng.random() < 0.5:
            return angles
        return self.teacher.kinematics.solve(self.teacher.kinematics.feature(angles)).q

    def _target(self) -> tuple[np.ndarray, Pose]:
        """A target of the world and its canonical pose, sometimes close to where the limb is."""
        regimen = self.regimen
        if self.rng.random() >= regimen.near_target_probability:
            return self.targets.draw()
        here = self.simulator.joint_angles[self.limb.driven]
        return self.targets.near(here, regimen.near_target_spread)

    def _reach(self, policy, amplitude, noise):
        """Steps towards one target; returns the noise to go on with, None after a fall."""
        regimen, rng, simulator, limb = self.regimen, self.rng, self.simulator, self.limb
        target, pose = self._target()
        self.teacher.aim_at(target, pose)
        steps = round(regimen.seconds_per_target / simulator.step_seconds)
        pushed = range(0)
        if rng.random() < regimen.push_probability:
            first = int(rng.integers(steps))
            pushed = range(first, first + round(regimen.push_seconds / simulator.step_seconds))
            force = rng.normal(0.0, regimen.push_force, 3)
        effector = limb.plan.effector
        for step in range(steps):
            activations = self.others.activation(simulator)
            self.teacher.others = activations
            if step % regimen.record_every == 0:
                label = self.teacher.voluntary(simulator, policy.drive)
                strain, _ = limb.strains(simulator)
                yield limb.offset(simulator.data, target), policy.drive.copy(), strain, label
            policy.activation(simulator, target)
            noise = regimen.drive_noise_correlation * noise + amplitude * rng.normal(size=len(noise))
            policy.drive = np.clip(policy.drive + noise, *DRIVE_RANGE)
            simulator.push(force if step in pushed else (0.0, 0.0, 0.0), effector)
            simulator.step(limb.into(activations, activation(policy.drive)))
            if self.balance and self.balance.lost(simulator):
                return None
        return noise
