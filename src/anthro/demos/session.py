"""What every demo shares: its command line, the run that it reads, what it records and writes."""

from __future__ import annotations

import argparse
import json
from collections.abc import Callable, Collection
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from anthro import registry
from anthro.body import Body
from anthro.body.simulator import DEFAULT_STEP, Simulator
from anthro.errors import UserError
from anthro.files import read_json, write_json, write_shard
from anthro.motor.controller import NeuromuscularController
from anthro.motor.feedback import Feedback
from anthro.motor.limb import Limb, limb_plan
from anthro.motor.others import Company, Others
from anthro.motor.system import MotorSystem
from anthro.motor.targets import Targets
from anthro.motor.teacher import Gains, Teacher
from anthro.runcard import RunCard
from anthro.streams import stream

SETTLED = 0.25  # s, at the end of a target
GAZE_DISTANCE = 0.6  # m ahead of the head, at which a gaze target is drawn
SUCCESS_RADIUS = 0.03  # m


def data_spec(run: Path, limb: str, role: str) -> dict:
    """What a limb's ``voluntary`` or ``reflex`` data of a run are synthesized from."""
    return read_json(run / "specs" / "data" / f"{limb}_{role}.json")


@dataclass
class Session:
    """One run's body and networks, as a demo finds them in ``results/<run>``."""

    run: Path
    body: Body
    _limbs: dict[str, Limb] = field(default_factory=dict)

    @classmethod
    def open(cls, run: Path, body: str, movable: bool = False) -> Session:
        """Load a body of the run, on demand one whose root may be moved; UserError for a run that is not there."""
        if not Path(run).is_dir():
            raise UserError(f"{run}: no such run; `make run` makes it")
        loaded = Body.load(Path(run) / "body" / body)
        return cls(Path(run), loaded.movable() if movable else loaded)

    def spec(self, limb: str) -> dict:
        """What a limb's voluntary data of this run are synthesized from; UserError for an unknown limb."""
        registry.limb(limb)
        return data_spec(self.run, limb, "voluntary")

    def limb(self, name: str) -> Limb:
        """A limb of this body; UserError for an unknown one, or one that the body lacks."""
        if name not in self._limbs:
            self._limbs[name] = Limb(limb_plan(self.spec(name)["limb"]), self.body)
        return self._limbs[name]

    def lead(self, name: str, effector: str) -> Limb:
        """The same limb led from now on by another effector than the one that its networks were trained with."""
        self._limbs[name] = Limb(replace(self.limb(name).plan, effector=effector), self.body)
        return self._limbs[name]

    def weights(self, limb: str, role: str) -> Path:
        """Weights of a limb's ``paper``, ``proprioceptive`` or ``reflex`` network."""
        return self.run / "nets" / registry.limb(limb).nets[role] / "weights.h5"

    def controller(
        self,
        limb: str,
        inputs: str | None = None,
        with_reflex: bool = True,
        kind: type[NeuromuscularController] = NeuromuscularController,
        pace: float = 1.0,
        feedback: Feedback | None = None,
        weights: Path | None = None,
    ) -> NeuromuscularController:
        """A limb's neuromuscular controller; with the better inputs, its region's feedback and the run's weights."""
        inputs = self.chosen_inputs(limb, inputs)
        reflex = self.weights(limb, "reflex") if with_reflex else None
        weights = weights or self.weights(limb, inputs)
        return kind.load(self.limb(limb), weights, reflex, inputs, pace, feedback or self.feedback(limb))

    def feedback(self, limb: str) -> Feedback:
        """What this run's controllers of a limb make of its discrepancy."""
        return Feedback(**read_json(self.run / "specs" / "feedback.json")[self.limb(limb).plan.region])

    def teacher(self, limb: str, rule: str = "equilibrium") -> Teacher:
        """The teacher with the gains that this run's data were labelled with."""
        return Teacher(self.limb(limb), DEFAULT_STEP, Gains(**self.spec(limb)["teacher"]), rule)

    def chosen_inputs(self, limb: str, inputs: str | None = None) -> str:
        """The variant asked for, or the one with which the limb did better in this run."""
        if inputs:
            return inputs
        choice = self.run / "demos" / "choice.json"
        return read_json(choice).get(limb, "proprioceptive") if choice.is_file() else "proprioceptive"

    def system(self, limbs: list[str], inputs: str | None = None) -> MotorSystem:
        """The controllers of some limbs, networks only."""
        return MotorSystem(self.body, {name: self.controller(name, inputs) for name in limbs})

    def simulator(self) -> Simulator:
        """A simulator at the rest posture, at the control step."""
        return self.body.simulator(DEFAULT_STEP)

    def begin(self, system: MotorSystem, simulator: Simulator | None = None) -> Simulator:
        """Rest posture, ribs and patellae settled, and a system's limbs as episodes of their training begin.

        They begin slack; a limb that was never trained so, the core, with the drive that holds the posture.
        """
        simulator = simulator or self.simulator()
        teachers = {name: self.teacher(name) for name in system.policies}
        q = self.body.q_rest
        for teacher in teachers.values():
            q = teacher.settled(q)
        simulator.reset(q)
        held = [name for name in teachers if not self.spec(name)["rollout"]["slack_probability"]]
        system.reset(simulator, {name: teachers[name].holding_state(q)[0] for name in held})
        return simulator

    def others(self, limb: str, seed: int, name: str) -> Others | None:
        """What the rest of the body does beside a limb, as in its training; None where it is limp."""
        company = self.spec(limb).get("others")
        if company is None:
            return None
        return Others(self.limb(limb), Company(**company), stream(seed, f"demos.{name}.{limb}.others"))

    def drawer(self, limb: str, share: float, seed: int, name: str) -> Targets:
        """Draws held-out targets of a limb, in the world with the body at rest, that its muscles can hold."""
        return Targets(self.teacher(limb), share, stream(seed, f"demos.{name}.{limb}"))

    def targets(self, limb: str, count: int, share: float, seed: int, name: str) -> list:
        """The first held-out targets of :meth:`drawer`."""
        drawn = self.drawer(limb, share, seed, name)
        return [drawn.draw()[0] for _ in range(count)]


@dataclass
class Recorder:
    """Collects a rollout of some limbs, a row every so many control steps."""

    simulator: Simulator
    limbs: list[Limb]
    every: int = 1
    rows: list = field(default_factory=list)
    _steps: int = 0

    def take(self, activation, targets: dict, controller_on: bool = True) -> None:
        """Record the simulator's state with the activations (n_body,) that act on it."""
        s, self._steps = self.simulator, self._steps + 1
        if (self._steps - 1) % self.every:
            return
        where = np.array([s.data.site_xpos[limb.site] for limb in self.limbs])
        aims = np.array([_shown(limb, s, targets.get(limb.name)) for limb in self.limbs])
        self.rows.append((s.time, s.qpos.copy(), np.array(activation), where, aims, controller_on))

    def columns(self) -> dict[str, np.ndarray]:
        """Columns of the rollout file; states and activations in single precision, as they are many."""
        names = ("time", "qpos", "activation", "effector", "target", "controller_on")
        columns = {name: np.array(values) for name, values in zip(names, zip(*self.rows, strict=True), strict=True)}
        kinds = {"qpos": np.float32, "activation": np.float32, "controller_on": np.uint8}
        columns |= {name: columns[name].astype(kind) for name, kind in kinds.items()}
        return columns

    def attrs(self, seed: int, props: str = "") -> dict:
        """Attributes of the rollout file."""
        return {
            "body": self.simulator.body.name,
            "limbs": " ".join(limb.name for limb in self.limbs),
            "seed": seed,
            "step_seconds": self.every * DEFAULT_STEP,
            "props": props,
        }


def _shown(limb: Limb, simulator: Simulator, target) -> np.ndarray:
    """Where a target is drawn (3,) m: itself, ahead of the face, or nowhere."""
    if target is None or limb.plan.senses == "orientation":
        return np.full(3, np.nan)
    if limb.plan.senses == "gaze":
        return simulator.data.site_xpos[limb.site] + GAZE_DISTANCE * np.asarray(target)
    return np.asarray(target, float)


def advance(
    simulator: Simulator,
    system: MotorSystem,
    targets: dict | Callable[[Simulator], dict],
    seconds: float,
    recorder: Recorder | None = None,
    off: Collection[str] = (),
    before_step: Callable[[Simulator], None] | None = None,
) -> dict[str, np.ndarray]:
    """Run a motor system for some time.

    Parameters
    ----------
    targets : dict of limb to target in the world, or a function of the simulator that gives one for each step.
    recorder : what is told each step, or None.
    off : limbs whose controllers are turned off: limp, whatever their targets.
    before_step : what is done to the world once all is sensed, just before each step.

    Returns
    -------
    dict of limb to ndarray (steps,)
        Distance from its target after each step, m or rad; NaN while it had none.
    """
    steps = round(seconds / simulator.step_seconds)
    distance = {name: np.full(steps, np.nan) for name in system.policies}
    for k in range(steps):
        now = targets(simulator) if callable(targets) else targets
        activation = system.activation(simulator, {name: aim for name, aim in now.items() if name not in off})
        if recorder:
            recorder.take(activation, now, controller_on=not off)
        if before_step:
            before_step(simulator)
        simulator.step(activation)
        for name, policy in system.policies.items():
            if now.get(name) is not None:
                distance[name][k] = policy.limb.distance(simulator.data, now[name])
    return distance


def settled(distance: np.ndarray) -> float:
    """Mean distance over the last 0.25 s of distances (steps,)."""
    return float(np.mean(distance[-round(SETTLED / DEFAULT_STEP) :]))


def row(item, metric, value, unit, target=None, sense="info", source="Nakada 2018", paper="nakada2018") -> dict:
    """One row of the scorecard; ``sense`` says on which side of the target is good."""
    return {
        "paper": paper,
        "item": item,
        "metric": metric,
        "value": None if value is None else float(value),
        "unit": unit,
        "target": target,
        "sense": sense,
        "source": source,
    }


def parser(name: str, doc: str, limb: str | None = "right_arm") -> argparse.ArgumentParser:
    """The arguments that all demos take; ``--limb`` only where a demo's limb may be chosen."""
    result = argparse.ArgumentParser(prog=f"anthro.demos.{name}", description=doc.partition("\n")[0])
    result.add_argument("--run", type=Path, required=True, help="folder of the run, results/<run>")
    if limb:
        result.add_argument("--limb", default=limb, help=f"limb that moves (default {limb})")
    result.add_argument("--seed", type=int, default=7, help="seed of the targets (default 7)")
    result.add_argument(
        "--inputs", choices=registry.INPUTS, help="inputs of the voluntary net (default: the better of the run)"
    )
    result.add_argument("--json", action="store_true", help="print the metrics as JSON")
    result.add_argument("--out", type=Path, help="folder for rollout, metrics and run card")
    return result


def finish(args, name: str, columns: dict, attrs: dict, metrics: dict, rows: list, card: RunCard):
    """Write a demo's files where ``--out`` says, and print its metrics."""
    if args.out:
        if columns:
            write_shard(args.out / "rollout.h5", columns, attrs)
        write_json(args.out / "metrics.json", metrics)
        write_json(args.out / "rows.json", rows)
        card.note(metrics={key: value for key, value in metrics.items() if np.isscalar(value)})
    if args.json:
        print(json.dumps(metrics, indent=1, sort_keys=True))
    else:
        for key, value in metrics.items():
            print(f"{name}: {key} = {value}")
