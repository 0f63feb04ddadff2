"""One system's attempt at a limb's targets: in what company, for how long, and what is kept of it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from anthro.body import Body
from anthro.body.simulator import DEFAULT_STEP, Simulator
from anthro.demos.criterion import task_of
from anthro.demos.quality import Gauge
from anthro.demos.session import Recorder, advance
from anthro.motor.limb import Limb
from anthro.motor.others import Others
from anthro.motor.system import MotorSystem
from anthro.motor.teacher import TeacherPolicy
from anthro.progress import progress

RECORDED, RECORDED_EVERY = 20, 4  # targets in the rollout, and steps from one of its rows to the next
HOLD_SECONDS = 20.0
FIRST_SECONDS = 1.0


class Staged(MotorSystem):
    """Limbs' policies among what the rest of the body does, some muscles off.

    Parameters
    ----------
    others : moves the rest of the body; None leaves it limp.
    silent : indices of muscles that are off: never active, though their controller does not know it.
    """

    def __init__(self, body: Body, policies: dict, others: Others | None = None, silent=()):
        super().__init__(body, policies)
        self._others, self._silent = others, np.asarray(silent, int)

    def reset(self, simulator: Simulator, drives: dict | None = None) -> None:
        """Begin at the simulator's state with each limb's neural drive (n,), zero where none is given."""
        super().reset(simulator, drives)
        if self._others:
            self._others.begin(simulator)

    def activation(self, simulator: Simulator, targets: dict) -> np.ndarray:
        """Activations (n_body,) for the next control step."""
        if self._others is None:
            whole = super().activation(simulator, targets)
        else:
            whole = self._others.activation(simulator)
            for policy in self.policies.values():
                if isinstance(policy, TeacherPolicy):
                    policy.teacher.others = whole
            own = super().activation(simulator, targets)
            for policy in self.policies.values():
                policy.limb.into(whole, own[policy.limb.muscles])
        whole[self._silent] = 0.0
        return whole


@dataclass(frozen=True)
class Attempt:
    """One system's way through n targets of T steps each.

    Attributes
    ----------
    distance : (n, T) m or rad, after each step.
    effort, change : (n, T) of :class:`~anthro.demos.quality.Gauge`.
    path : (n, T, 3) m, the effector before each step.
    """

    distance: np.ndarray
    effort: np.ndarray
    change: np.ndarray
    path: np.ndarray

    @property
    def activation_rate(self) -> float:
        """Root mean square of the activations' rates of change, 1/s."""
        return float(np.sqrt(self.change.mean()))


def attempt(
    simulator: Simulator, system: MotorSystem, limb: Limb, targets, label: str, recorder: Recorder | None = None
) -> Attempt:
    """Try all targets in a row; ``recorder`` is told of the first 20."""
    seconds, gauge, distance = task_of(limb).seconds, Gauge(simulator, limb), []
    for index, target in enumerate(progress(targets, len(targets), label)):
        gauge.recorder = recorder if index < RECORDED else None
        distance.append(advance(simulator, system, {limb.name: target}, seconds, gauge)[limb.name])
    shape = len(targets), -1
    return Attempt(
        np.array(distance),
        np.reshape(gauge.effort, shape),
        np.reshape(gauge.change, shape),
        np.reshape(gauge.path, (*shape, 3)),
    )


class _Offsets:
    """Keeps the discrepancies (width,) of a limb from a target, step by step."""

    def __init__(self, simulator: Simulator, limb: Limb, target):
        self._simulator, self._limb, self._target, self.found = simulator, limb, target, []

    def take(self, activation, targets: dict, controller_on: bool = True) -> None:
        self.found.append(self._limb.offset(self._simulator.data, self._target))


def hold(simulator: Simulator, system: MotorSystem, limb: Limb, target) -> tuple[float, float]:
    """Go to a target, then stay for 20 s: largest distance from it, and from the mean of the first second, rad."""
    offsets = _Offsets(simulator, limb, target)
    advance(simulator, system, {limb.name: target}, task_of(limb).seconds)
    advance(simulator, system, {limb.name: target}, HOLD_SECONDS, offsets)
    found = np.array(offsets.found)
    away = found - found[: round(FIRST_SECONDS / DEFAULT_STEP)].mean(axis=0)
    return tuple(float(np.linalg.norm(one, axis=1).max()) for one in (found, away))
