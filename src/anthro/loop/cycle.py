"""The sensorimotor cycle (Nakada 2018, Sec. 7, Fig. 19): eyes, vision DNNs, motor DNNs, muscles, body.

Looks, activations and steps of the simulation have rates of their own. Between looks the last answers are kept: places
and directions in the frame of the world, from which the limbs' and eyes' own movements, which the body senses, are
taken off at each step. Motor DNNs are told offsets from such places, in the frames of their limbs' bases.

Limbs that are not led, or have seen nothing, go to where they were when the cycle began; so does the head.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from anthro.body.simulator import Simulator
from anthro.loop.gaze import Gaze, head_target
from anthro.loop.leads import Lead
from anthro.loop.percept import Onlooker, Percept
from anthro.loop.plan import LoopPlan
from anthro.motor.limb import Limb
from anthro.motor.system import MotorSystem


class Cycle:
    """Leads a body by what it sees.

    Parameters
    ----------
    simulator : of the body.
    system : motor DNNs of all its limbs.
    onlooker : its eyes with their vision DNNs.
    plan : rates and gains.
    leads : of the limbs that are led by sight.
    neck : the limb that carries the head; None leaves the head at rest.

    Attributes
    ----------
    percept : what was seen last; None before the first look.
    activation : (n,) of all muscles, those of the last step.
    goals : by limb, where sight leads it now (3,) m; those at rest are left out.
    """

    def __init__(
        self,
        simulator: Simulator,
        system: MotorSystem,
        onlooker: Onlooker,
        plan: LoopPlan,
        leads: dict[str, Lead],
        neck: str | None,
    ):
        self.simulator, self.system, self.onlooker, self.plan = simulator, system, onlooker, plan
        self.leads, self._neck = leads, neck
        self._gaze = Gaze(plan.gaze)
        self._limbs: dict[str, Limb] = {name: policy.limb for name, policy in system.policies.items()}
        self.restart()

    def restart(self) -> None:
        """Begin with nothing seen, the simulator's present posture as that of rest, and eyes that look ahead."""
        self._steps = 0
        self.percept: Percept | None = None
        self.activation = np.zeros(self.simulator.body.muscle_count)
        self.goals: dict[str, np.ndarray] = {}
        self._gaze.reset()
        self.onlooker.eyes.reset()
        for lead in self.leads.values():
            lead.reset()
        self._rest = {name: self._sensed(limb, limb.feature(self.simulator.data)) for name, limb in self._limbs.items()}

    def step(self, before: Callable[[Simulator], None] | None = None) -> None:
        """One step of the simulation, with a look and new activations where they are due.

        Parameters
        ----------
        before : what is done to the world once all is sensed, just before the step.
        """
        simulator, plan = self.simulator, self.plan
        if self._steps % plan.sight_steps == 0:
            self.look()
        if self._steps % plan.control_steps == 0:
            self.activation = self.system.activation(simulator, self._targets())
        eyes = self.onlooker.eyes
        rotation, _ = eyes.head(simulator.data)
        eyes.turn(self._gaze.command(eyes, rotation, simulator.time), simulator.step_seconds)
        if before:
            before(simulator)
        simulator.step(self.activation)
        self._steps += 1

    def look(self) -> None:
        """See, and tell gaze and leads."""
        data = self.simulator.data
        self.percept = self.onlooker.look(data, self.simulator.time, list(self.leads))
        self._gaze.follow(self.percept.directions, self.percept.time)
        for name, offset in self.percept.offsets.items():
            self.leads[name].notice(self.percept, offset, data.site_xpos[self._limbs[name].site])

    def _targets(self) -> dict[str, np.ndarray]:
        """Where each limb is led, in the world."""
        data = self.simulator.data
        self.goals = {name: goal for name, lead in self.leads.items() if (goal := lead.goal()) is not None}
        targets = {name: self._placed(limb, self._rest[name]) for name, limb in self._limbs.items()} | self.goals
        if self._neck and self.percept is not None and self.percept.directions is not None:
            base = data.xmat[self._limbs[self._neck].base].reshape(3, 3)
            towards = self._gaze.directions(self.simulator.time).mean(axis=0)
            targets[self._neck] = head_target(self.plan.head, base, towards)
        return targets

    def _sensed(self, limb: Limb, feature: np.ndarray) -> np.ndarray:
        """A place or direction of the world in the frame of the limb's base."""
        data = self.simulator.data
        origin = data.xpos[limb.base] if limb.plan.senses == "position" else 0.0
        return data.xmat[limb.base].reshape(3, 3).T @ (feature - origin)

    def _placed(self, limb: Limb, sensed: np.ndarray) -> np.ndarray:
        """The inverse of `_sensed`."""
        data = self.simulator.data
        origin = data.xpos[limb.base] if limb.plan.senses == "position" else 0.0
        return origin + data.xmat[limb.base].reshape(3, 3) @ sensed
