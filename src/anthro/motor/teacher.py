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

from anthro.body.simulator import Simulator
from anthro.errors import UserError
from anthro.motor import reflex
from anthro.motor.dynamics import Yielding, effort_problem, pose_acceleration
from anthro.motor.effort import solve
from anthro.motor.kinematics import InverseKinematics, Pose
from anthro.motor.limb import SLACK, Limb

SETTLING_STEPS, SETTLING_STRIDE, SETTLED = 20, 0.05, 4e-3  # at most so many and so long (rad), until they are so short
OVERSHOT = 0.3  # share of the energy's slope at a step's start that may stand against the step at its end
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
    drive_range : bounds of the drive that holds a pose, beyond which muscles are silent or full anyway.
    """

    approach_rate: float = 8.0
    max_joint_speed: float = 2.5
    leak_rate: float = 8.0
    tone: float = 0.05
    tone_stretch: float = 2.0
    max_adjustment: float = 0.1
    drive_range: tuple[float, float] = (-3.0, 2.0)


class StaticPosture:
    """Minimal-effort drive of a limb that holds a pose still, and the strains there.

    The limb's passive joints (ribs, patellae) rest where their ligaments and springs balance.
    """

    def __init__(self, limb: Limb, gains: Gains):
        self.limb, self._simulator = limb, limb.body.simulator()
        strain, _ = limb.strains(self._simulator)
        self._tone = gains.tone - gains.tone_stretch * strain
        self._tone_stretch, self._range = gains.tone_stretch, gains.drive_range
        self._start = np.zeros(limb.torques)
        self._settled = self._simulator.joint_angles[limb.passive].copy()
        self._followed = self._simulator.joint_angles[limb.driven].copy()
        if len(limb.passive):
            self._following = Yielding(self._simulator, limb).following(np.eye(len(limb.driven)))

    def place(self, q) -> np.ndarray:
        """Put the body into pose ``q`` (m,) rad, the limb's passive joints settled under ligaments and springs.

        Angles beyond the joint ranges count as the nearest ones within: muscles need not work against the limit
        springs. Returns the pose.
        """
        limb, simulator = self.limb, self._simulator
        q = np.clip(q, simulator.low, simulator.high)
        if not len(limb.passive):
            simulator.reset(q)
            return q
        low, high = limb.body.q_range[limb.passive].T
        guess = self._settled + self._following @ (q[limb.driven] - self._followed)
        self._settled, self._followed = np.clip(guess, low, high), q[limb.driven]
        step, slope = np.zeros(len(limb.passive)), 0.0
        for _ in range(SETTLING_STEPS):
            q[limb.passive] = self._settled
            simulator.reset(q)
            yielding = Yielding(simulator, limb)
            rising = yielding.gradient @ step
            if rising > OVERSHOT * -slope:  # cords became taut on the way: back to where energy is least
                kept = slope / (slope - rising)
                self._settled = self._settled - (1.0 - kept) * step
                step, slope = kept * step, kept * slope
                continue
            change = yielding.to_rest()
            largest = np.abs(change).max()
            if largest < SETTLED:
                break
            step = change * min(1.0, SETTLING_STRIDE / largest)
            slope = yielding.gradient @ step
            self._settled = self._settled + step
        return q

    def drive(self, q, others=None) -> tuple[np.ndarray, np.ndarray, float]:
        """Holding drive (n,), strains (n,) and unmet torque in N m, in pose ``q`` (m,) rad of the whole body.

        Torque that soft joints lack does not count. ``others`` are the activations (n_body,) of the body's other
        muscles, limp when None.
        """
        self.place(q)
        return self._solve(others)

    def moved(self, change, others=None) -> tuple[np.ndarray, np.ndarray, float]:
        """As :meth:`drive`, ``change`` (d,) rad from the pose of the last call, which passive joints follow."""
        limb, simulator = self.limb, self._simulator
        q = simulator.joint_angles.copy()
        q[limb.driven] += change
        if len(limb.passive):
            q[limb.passive] += Yielding(simulator, limb).following(change)
        simulator.reset(np.clip(q, simulator.low, simulator.high))
        return self._solve(others)

    def _solve(self, others) -> tuple[np.ndarray, np.ndarray, float]:
        limb = self.limb
        matrix, torque = effort_problem(self._simulator, limb, others)
        strain, _ = limb.strains(self._simulator)
        tone = self._tone + self._tone_stretch * strain
        activations, drive, _, _, self._start = solve(matrix, torque, tone, limb.slack, self._start)
        unmet = np.abs(matrix @ activations - torque)[limb.slack <= SLACK].max()
        return np.clip(drive, *self._range), strain, unmet


class Teacher:
    """Labels voluntary adjustments of one limb; solves inverse kinematics once a target.

    Parameters
    ----------
    step : control step in s.
    rule : one of ``RULES``.

    Attributes
    ----------
    others : activations (n_body,) of the body's other muscles at present, limp when None.
    """

    def __init__(self, limb: Limb, step: float, gains: Gains | None = None, rule: str = "equilibrium"):
        if rule not in RULES:
            raise UserError(f"unknown label rule {rule!r}: known are {', '.join(RULES)}")
        self.limb, self.step, self.rule = limb, step, rule
        self.gains = gains or Gains()
        self.kinematics = InverseKinematics(limb)
        self._here = StaticPosture(limb, self.gains)
        self._tone = np.full(limb.size, self.gains.tone)
        self._start = np.zeros(limb.torques)
        self.others: np.ndarray | None = None
        self.pose: Pose | None = None
        self._target: np.ndarray | None = None

    def aim(self, target) -> Pose:
        """Set the target, in the world; returns its canonical pose, solved for once."""
        if self._target is None or not np.array_equal(target, self._target):
            self.pose = self.kinematics.solve(target)
            self._target = np.array(target, float)
        return self.pose

    def aim_at(self, target, pose: Pose) -> None:
        """Set a target whose canonical pose was solved for before."""
        self.pose, self._target = pose, target

    def holding_state(self, q) -> tuple[np.ndarray, np.ndarray]:
        """Minimal-effort drive (n,) that holds pose ``q`` (m,) rad of the whole body, and the strains (n,) there."""
        drive, strain, _ = self._here.drive(q)
        return drive, strain

    def settled(self, q) -> np.ndarray:
        """Pose ``q`` (m,) rad of the whole body with the limb's passive joints settled."""
        return self._here.place(q)

    def lacks(self, pose: Pose) -> float:
        """Largest torque in N m that the limb's muscles lack to hold a canonical pose, the body at rest elsewhere."""
        return self._here.drive(self.limb.with_angles(self.limb.body.q_rest, pose.q))[2]

    def voluntary(self, simulator: Simulator, drive) -> np.ndarray:
        """The label da_v (n,) in the simulator's state with neural drive (n,)."""
        if self.rule == "appendix_b":
            return self.desired_activation(simulator) - reflex.activation(drive)
        q = simulator.joint_angles
        a_here, e_here, _ = self._here.drive(q, self.others)
        a_ahead, e_ahead, _ = self._here.moved(self._stride(q[self.limb.driven]), self.others)
        way = (a_ahead - a_here) - reflex.STRAIN_GAIN * (e_ahead - e_here)
        label = way + self.gains.leak_rate * self.step * (a_here - drive)
        return np.clip(label, -self.gains.max_adjustment, self.gains.max_adjustment)

    def _stride(self, angles) -> np.ndarray:
        gap = np.where(self.limb.led, self.pose.q - angles, 0.0)
        share = self.gains.approach_rate * self.step
        limit = self.gains.max_joint_speed * self.step
        return gap * min(share, limit / max(np.abs(gap).max(), 1e-12))

    def desired_activation(self, simulator: Simulator) -> np.ndarray:
        """Appendix B: activations (n,) that give the PD acceleration to the canonical pose."""
        limb = self.limb
        wanted = np.zeros(simulator.model.nv)
        angles, velocities = simulator.joint_angles[limb.driven], simulator.joint_velocities[limb.driven]
        wanted[limb.columns] = pose_acceleration(angles, velocities, self.pose.q)
        matrix, torque = effort_problem(simulator, limb, acceleration=wanted)
        result = solve(matrix, torque, self._tone, self.limb.slack, self._start)
        self._start = result[4]
        return result[0]


class TeacherPolicy:
    """Drives a limb by the teacher's labels and the exact reflex, as Eq. 1 adds them up."""

    def __init__(self, teacher: Teacher):
        self.teacher, self.limb = teacher, teacher.limb
        self.drive = np.zeros(teacher.limb.size)

    def reset(self, simulator: Simulator, drive=None) -> None:
        """Begin at the simulator's state with neural drive (n,), zero when None."""
        self.drive = np.zeros_like(self.drive) if drive is None else np.array(drive, float)
        self._strain, self._rate = self.limb.strains(simulator)

    def activation(self, simulator: Simulator, target) -> np.ndarray:
        """Activations (n,) of the limb's muscles for the next control step towards ``target``."""
        self.teacher.aim(target)
        label = self.teacher.voluntary(simulator, self.drive)
        strain, rate = self.limb.strains(simulator)
        adjustment = reflex.reflex_adjustment(strain - self._strain, rate - self._rate)
        if self.teacher.rule == "appendix_b":
            self.drive = reflex.activation(self.drive) + label
        else:
            self.drive = reflex.accumulate(self.drive, label, adjustment)
        self._strain, self._rate = strain, rate
        return reflex.activation(self.drive)
