"""What every demo shares: its command line, the run that it reads, what it records and writes."""

from __future__ import annotations

import argparse
import json
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from anthro.body import Body
from anthro.body.simulator import DEFAULT_STEP, Simulator
from anthro.errors import UserError
from anthro.files import read_json, write_json, write_shard
from anthro.motor.controller import INPUTS, NeuromuscularController
from anthro.motor.teacher import Gains, Teacher
from anthro.registry import limb as limb_of
from anthro.runcard import RunCard

SUCCESS_RADIUS = 0.03  # m


@dataclass
class Session:
    """One run's body and networks, as a demo finds them in ``results/<run>``."""

    run: Path
    limb: str
    body: Body

    @classmethod
    def open(cls, run: Path, limb: str) -> Session:
        """Load the limb's body; UserError for an unknown limb or a run that is not there."""
        limb_of(limb)
        if not Path(run).is_dir():
            raise UserError(f"{run}: no such run; `make run` makes it")
        return cls(Path(run), limb, Body.load(Path(run) / "body" / limb))

    def weights(self, role: str) -> Path:
        """Weights of the limb's ``paper``, ``proprioceptive`` or ``reflex`` network."""
        return self.run / "nets" / limb_of(self.limb).nets[role] / "weights.h5"

    def controller(self, inputs: str, with_reflex: bool = True) -> NeuromuscularController:
        """The neuromuscular controller of one input variant."""
        reflex = self.weights("reflex") if with_reflex else None
        muscles = self.body.muscle_count
        return NeuromuscularController.load(self.weights(inputs), reflex, muscles, inputs)

    def teacher(self, rule: str = "equilibrium") -> Teacher:
        """The teacher with the gains that this run's data were labelled with."""
        spec = read_json(self.run / "specs" / "data" / f"{self.limb}_voluntary.json")
        return Teacher(self.body, DEFAULT_STEP, Gains(**spec["teacher"]), rule)

    def chosen_inputs(self, inputs: str | None) -> str:
        """The variant asked for, or the one that reached better in this run."""
        if inputs:
            return inputs
        choice = self.run / "demos" / "choice.json"
        return read_json(choice)["inputs"] if choice.is_file() else "proprioceptive"

    def simulator(self) -> Simulator:
        """A simulator at the rest posture, at the control step."""
        return self.body.simulator(DEFAULT_STEP)


@dataclass
class Recorder:
    """Collects a rollout, one row a control step."""

    simulator: Simulator
    rows: list = field(default_factory=list)

    def take(self, activation, target, controller_on: bool = True) -> None:
        """Record the simulator's state with the activations (n,) that act on it."""
        s = self.simulator
        hand, aim = s.hand_position, np.full(3, np.nan) if target is None else np.asarray(target)
        self.rows.append((s.time, s.qpos.copy(), np.array(activation), hand, aim, controller_on))

    def columns(self) -> dict[str, np.ndarray]:
        """Columns of the rollout file."""
        names = ("time", "qpos", "activation", "hand", "target", "controller_on")
        columns = {name: np.array(values) for name, values in zip(names, zip(*self.rows, strict=True), strict=True)}
        columns["controller_on"] = columns["controller_on"].astype(np.uint8)
        return columns


def advance(simulator: Simulator, policy, target, seconds: float, recorder=None) -> np.ndarray:
    """Run a policy towards ``target`` (3,) m; distances (steps,) m after each control step."""
    steps = round(seconds / simulator.step_seconds)
    distance = np.empty(steps)
    for k in range(steps):
        activation = policy.activation(simulator, target)
        if recorder:
            recorder.take(activation, target)
        simulator.step(activation)
        distance[k] = np.linalg.norm(simulator.hand_position - target)
    return distance


def row(item, metric, value, unit, target=None, sense="info", source="Nakada 2018") -> dict:
    """One row of the scorecard; ``sense`` says on which side of the target is good."""
    return {
        "paper": "nakada2018",
        "item": item,
        "metric": metric,
        "value": None if value is None else float(value),
        "unit": unit,
        "target": target,
        "sense": sense,
        "source": source,
    }


def parser(name: str, doc: str) -> argparse.ArgumentParser:
    """The arguments that all demos take."""
    result = argparse.ArgumentParser(prog=f"anthro.demos.{name}", description=doc.partition("\n")[0])
    result.add_argument("--run", type=Path, required=True, help="folder of the run, results/<run>")
    result.add_argument("--limb", default="right_arm", help="limb that moves (default right_arm)")
    result.add_argument("--seed", type=int, default=7, help="seed of the targets (default 7)")
    result.add_argument(
        "--inputs", choices=INPUTS, help="inputs of the voluntary net (default: the better of the run)"
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
