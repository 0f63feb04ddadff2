"""The offline teacher: what the voluntary network should have said in a given state.

Two label rules share inverse kinematics, inverse dynamics and muscle optimisation:

``equilibrium`` (the default) moves the threshold of the stretch reflex. A pose q is held by its
minimal-effort drive a_s(q); with the reflex accumulated by Eq. 1 its threshold is
a_s(q) - k_p e(q). The label is the threshold's way from the present pose to one a little nearer to
the target's canonical pose, plus a leak that draws the drive to a_s(q):

    da_v = [a_s(q_look) - a_s(q)] - k_p [e(q_look) - e(q)] + leak h [a_s(q) - a]

It is a function of pose, target and drive alone, so a network can learn it, and its errors are
divided by a loop gain instead of piling up.

``appendix_b`` is the paper's: PD acceleration (Eq. 7), inverse dynamics, minimal effort, label
a_d - a. It also depends on velocities, which the network does not see; it is kept to show so.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from anthro.body import Body
from anthro.body.simulator import Simulator
from anthro.errors import UserError
from anthro.motor import reflex
from anthro.motor.dynamics import effort_problem, pose_acceleration
from anthro.motor.effort import solve
from anthro.motor.kinematics import InverseKinematics, Pose

SLACK = 1e-3  # keeps the drive smooth and finite where a torque is out of reach
STATIC_DRIVE_RANGE = (-3.0, 2.0)
RULES = ("equilibrium", "appendix_b")


@dataclass(frozen=True)
class Gains:
    """The equilibrium rule's numbers.

    Attributes
    ----------
    approach_rate : 1/s, share of the way to the target's pose that the look-ahead takes.
    max_joint_speed : rad/s, of the look-ahead.
    leak_rate : 1/s, with which the drive is drawn to the present pose's holding drive.
    tone : activation from which effort is measured, at the rest posture's strain.
    tone_stretch : how much that tone grows with strain (a tonic stretch reflex). Muscle torque does
        not change with it, but the drive then says where the limb is.
    max_adjustment : bound of a label's entries.
    """

    approach_rate: float = 8.0
    max_joint_speed: float = 2.5
    leak_rate: float = 8.0
    tone: float = 0.05
    tone_stretch: float = 2.0
    max_adjustment: float = 0.1


class StaticPosture:
    """Minimal-effort drive that holds a pose still, and the strains there."""

    def __init__(self, body: Body, gains: Gains):
        self._simulator = body.simulator()
        self._tone = gains.tone - gains.tone_stretch * self._simulator.strain
        self._tone_stretch = gains.tone_stretch
        self._start = np.zeros(body.dof_count)
        self._still = np.zeros(body.dof_count)

    def problem(self, q) -> tuple[np.ndarray, np.ndarray]:
        """Moment matrix (m, n) and holding torque (m,), N m, at rest in pose ``q``.

        A pose beyond the joint ranges counts as the nearest one within: muscles need not work
        against the limit springs.
        """
        self._simulator.reset(np.clip(q, self._simulator.low, self._simulator.high))
        return effort_problem(self._simulator, self._still)

    def drive(self, q) -> tuple[np.ndarray, np.ndarray, float]:
        """Holding drive (n,), strains (n,) and unmet torque in N m at pose ``q`` (m,) rad."""
        matrix, torque = self.problem(q)
        strain = self._simulator.strain
        tone = self._tone + self._tone_stretch * strain
        _, drive, residual, _, self._start = solve(matrix, torque, tone, SLACK, self._start)
        return np.clip(drive, *STATIC_DRIVE_RANGE), strain, residual


class Teacher:
    """Labels voluntary adjustments for one body; solves inverse kinematics once a target.

    Parameters
    ----------
    step : control step in s.
    rule : one of ``RULES``.
    """

    def __init__(
        self, body: Body, step: float, gains: Gains | None = None, rule: str = "equilibrium"
    ):
        if rule not in RULES:
            raise UserError(f"unknown label rule {rule!r}: known are {', '.join(RULES)}")
        self.body, self.step, self.rule = body, step, rule
        self.gains = gains or Gains()
        self.kinematics = InverseKinematics(body)
        self._here = StaticPosture(body, self.gains)
        self._ahead = StaticPosture(body, self.gains)
        self._tone = np.full(body.muscle_count, self.gains.tone)
        self._start = np.zeros(body.dof_count)
        self.pose: Pose | None = None
        self._target: np.ndarray | None = None

    def aim(self, target) -> Pose:
        """Set the target (3,) m; returns its canonical pose, solved for once."""
        if self._target is None or not np.array_equal(target, self._target):
            self.pose = self.kinematics.solve(target)
            self._target = np.array(target, float)
        return self.pose

    def aim_at_pose(self, pose: Pose) -> None:
        """Set a target by its canonical pose, solved for before."""
        self.pose, self._target = pose, None

    def holding_state(self, q) -> tuple[np.ndarray, np.ndarray]:
        """Minimal-effort drive (n,) that holds pose ``q`` (m,) rad, and the strains (n,) there."""
        drive, strain, _ = self._here.drive(q)
        return drive, strain

    def voluntary(self, simulator: Simulator, drive) -> np.ndarray:
        """The label da_v (n,) in the simulator's state with neural drive (n,)."""
        if self.rule == "appendix_b":
            return self.desired_activation(simulator) - reflex.activation(drive)
        q = simulator.qpos
        a_here, e_here, _ = self._here.drive(q)
        a_ahead, e_ahead, _ = self._ahead.drive(q + self._stride(q))
        way = (a_ahead - a_here) - reflex.STRAIN_GAIN * (e_ahead - e_here)
        label = way + self.gains.leak_rate * self.step * (a_here - drive)
        return np.clip(label, -self.gains.max_adjustment, self.gains.max_adjustment)

    def _stride(self, q) -> np.ndarray:
        gap = self.pose.q - q
        share = self.gains.approach_rate * self.step
        limit = self.gains.max_joint_speed * self.step
        return gap * min(share, limit / max(np.abs(gap).max(), 1e-12))

    def desired_activation(self, simulator: Simulator) -> np.ndarray:
        """Appendix B: activations (n,) that give the PD acceleration to the canonical pose."""
        wanted = pose_acceleration(simulator.qpos, simulator.qvel, self.pose.q)
        matrix, torque = effort_problem(simulator, wanted)
        result = solve(matrix, torque, self._tone, SLACK, self._start)
        self._start = result[4]
        return result[0]


class TeacherPolicy:
    """Drives a simulator by the teacher's labels and the exact reflex, as Eq. 1 adds them up."""

    def __init__(self, teacher: Teacher):
        self.teacher = teacher
        self.drive = np.zeros(teacher.body.muscle_count)

    def reset(self, simulator: Simulator, drive=None) -> None:
        """Begin at the simulator's state with neural drive (n,), zero when None."""
        self.drive = np.zeros_like(self.drive) if drive is None else np.array(drive, float)
        self._strain, self._rate = simulator.strain, simulator.strain_rate

    def activation(self, simulator: Simulator, target) -> np.ndarray:
        """Activations (n,) for the next control step towards ``target`` (3,) m."""
        self.teacher.aim(target)
        label = self.teacher.voluntary(simulator, self.drive)
        adjustment = reflex.reflex_adjustment(
            simulator.strain - self._strain, simulator.strain_rate - self._rate
        )
        if self.teacher.rule == "appendix_b":
            self.drive = reflex.activation(self.drive) + label
        else:
            self.drive = reflex.accumulate(self.drive, label, adjustment)
        self._strain, self._rate = simulator.strain, simulator.strain_rate
        return reflex.activation(self.drive)
