"""Core, neck, arms and legs at once, each with targets of its own, by their networks alone; the pelvis is fixed.

Every 3 s each limb gets a new target. The targets of a round are what all limbs do in one random pose of the whole
body, so that they can be met together: the torso's canonical pose for its target, and the other limbs' on it. Each
limb is judged as in its own task; 0.8 of the rates there are asked for (Zhou et al. 2021, Sec. 5.1, Fig. 6).

The networks are those that were trained limb by limb, neck and arms on a trunk at rest. What these sense on a trunk
that moves :mod:`anthro.motor.carried` says.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass

import numpy as np

from anthro import cli, registry
from anthro.body.simulator import Simulator
from anthro.demos.attempt import RECORDED, RECORDED_EVERY
from anthro.demos.criterion import task_of
from anthro.demos.session import Recorder, Session, advance, finish
from anthro.demos.task import arguments, card_of, rows_of
from anthro.motor.carried import CarriedController
from anthro.motor.controller import NeuromuscularController
from anthro.motor.feedback import Feedback
from anthro.motor.system import MotorSystem
from anthro.progress import progress

BODY = "whole_fixed"
LIMBS = registry.WHOLE
SECONDS = 3.0
CARRIED = ("neck", "right_arm", "left_arm")  # limbs that hang on the trunk
# Share of the voluntary adjustments that is made. Limbs that correct as fast as on a trunk at rest push the trunk,
# which corrects in turn, and all of them sway. Arms look further ahead for the same reason than on a trunk at rest.
# A neck that a bent trunk carries stops further from its target than one on a trunk at rest: more is added up.
# Chosen by trying, on rounds of seeds 11 and 12.
PACE = {"neck": 0.5, "right_arm": 0.4, "left_arm": 0.4, "core": 1.2}
ARM = Feedback(lead=0.1, rate=2.0, near=0.06)
FEEDBACK = {
    "neck": Feedback(rate=3.0, near=0.3),
    "right_arm": ARM,
    "left_arm": ARM,
    "core": Feedback(lead=0.15, rate=1.0, near=0.1),
}
LENIENCE = 0.8  # of each limb's rate in its own task
ROUNDING = 1e-9  # of a muscle's strength


@dataclass
class Watch:
    """Told each step: whether all is finite, and how hard the muscles pull.

    Attributes
    ----------
    not_finite : number of states and activations that are not finite.
    over_strength : largest active force of a muscle, as a share of its strength.
    above_allowed : most by which one is above what force-length-velocity allows at full activation, likewise.
    """

    simulator: Simulator
    recorder: Recorder | None = None
    not_finite: int = 0
    over_strength: float = 0.0
    above_allowed: float = 0.0

    def take(self, activation, targets: dict, controller_on: bool = True) -> None:
        """Look at the step that begins with activations (n_body,)."""
        simulator = self.simulator
        passive = simulator.muscle_force(np.zeros_like(activation))
        active = simulator.muscle_force(activation) - passive
        allowed = simulator.muscle_force(np.ones_like(activation)) - passive
        for values in (simulator.qpos, simulator.qvel, activation):
            self.not_finite += int((~np.isfinite(values)).sum())
        strength = simulator.body.max_force
        self.over_strength = max(self.over_strength, float((active / strength).max()))
        self.above_allowed = max(self.above_allowed, float(((active - allowed) / strength).max()))
        if self.recorder:
            self.recorder.take(activation, targets, controller_on)


def rounds(session: Session, count: int, seed: int) -> list[dict]:
    """Targets in the world of all limbs, for each round."""
    drawers = {name: session.drawer(name, task_of(session.limb(name)).share, seed, "all_six") for name in LIMBS}
    scratch, result = session.simulator(), []
    for _ in range(count):
        q = session.body.q_rest
        for name, drawer in drawers.items():
            q = session.limb(name).with_angles(q, drawer.draw()[1].q)
        for drawer in drawers.values():
            q = drawer.teacher.settled(q)
        scratch.reset(q)
        result.append({name: session.limb(name).feature(scratch.data) for name in LIMBS})
    return result


def together(session: Session, inputs: str | None) -> MotorSystem:
    """The networks of all limbs, paced; those that the trunk carries as such."""
    kinds = dict.fromkeys(LIMBS, NeuromuscularController) | dict.fromkeys(CARRIED, CarriedController)
    return MotorSystem(
        session.body,
        {
            name: session.controller(name, inputs, kind=kind, pace=PACE.get(name, 1.0), feedback=FEEDBACK.get(name))
            for name, kind in kinds.items()
        },
    )


def measure(session: Session, inputs: str | None, targets: list[dict]):
    """Distances (rounds, steps) by limb, metrics, and the recorded rollout."""
    system = together(session, inputs)
    simulator = session.begin(system)
    recorder = Recorder(simulator, [session.limb(name) for name in LIMBS], RECORDED_EVERY)
    watch, found = Watch(simulator), []
    for index, aims in enumerate(progress(targets, len(targets), "rounds")):
        watch.recorder = recorder if index < RECORDED else None
        found.append(advance(simulator, system, aims, SECONDS, watch))
    distance = {name: np.array([one[name] for one in found]) for name in LIMBS}
    metrics: dict = {"rounds": len(targets)}
    for name, one in distance.items():
        metrics[f"{name}_inputs"] = session.chosen_inputs(name, inputs)
        metrics |= task_of(session.limb(name)).summary(one, f"{name}_")
    metrics |= {
        "not_finite": float(watch.not_finite),
        "active_force_over_strength": watch.over_strength,
        "active_force_above_allowed": watch.above_allowed,
    }
    return distance, metrics, recorder


def main(argv=None) -> int:
    args = arguments("all_six", __doc__, None, 40).parse_args(argv)
    session = Session.open(args.run, BODY)
    chosen = {name: session.chosen_inputs(name, args.inputs) for name in LIMBS}
    with card_of(args, "all_six", body=BODY, inputs=chosen, targets=args.targets) as card:
        targets = rounds(session, args.targets, args.seed)
        distance, metrics, recorder = measure(session, args.inputs, targets)
        bars = {f"{name}_success_rate": (LENIENCE * task_of(session.limb(name)).bar, "min") for name in LIMBS}
        bars |= {"not_finite": (0.0, "max"), "active_force_above_allowed": (ROUNDING, "max")}
        columns = recorder.columns() | {f"errors_{name}": one.astype(np.float32) for name, one in distance.items()}
        item = f"all six at once, {args.inputs or 'better'} inputs"
        rows = rows_of(metrics, item, "zhou2021", "Sec. 5.1", bars)
        finish(args, "all_six", columns, recorder.attrs(args.seed), metrics, rows, card)
    return 0


if __name__ == "__main__":
    sys.exit(cli.run(main))
