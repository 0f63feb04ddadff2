"""The frame of the limbs' tasks: what is asked on the command line, measured, compared and written.

Targets are held out: they come from streams of their own, by the seed of the command line. Each begins where the last
one ended. Networks alone move the limb; the first of the same targets are then tried without the reflex and by the
teacher.
"""

from __future__ import annotations

import argparse
from contextlib import nullcontext

import numpy as np

from anthro import registry
from anthro.body.simulator import DEFAULT_STEP
from anthro.demos.attempt import RECORDED_EVERY, Attempt, Staged, attempt, hold
from anthro.demos.criterion import Task, task_of
from anthro.demos.quality import minimum_jerk_shape, speed_shape
from anthro.demos.session import Recorder, Session, finish, parser, row
from anthro.errors import UserError
from anthro.motor.feedback import PLAIN
from anthro.motor.teacher import TeacherPolicy
from anthro.runcard import RunCard

STAGES = {"neck": "neck", "core": "whole_fixed"}  # bodies on which limbs show their tasks; the others sit
SEATED = "nakada2018"
UNITS = {"_per_s": "1/s", "_m": "m", "_deg": "deg", "_s": "s"}  # of metrics, by the endings of their names


def arguments(name: str, doc: str, limb: str | None, targets: int) -> argparse.ArgumentParser:
    """The arguments that all tasks take."""
    result = parser(name, doc, limb)
    result.add_argument("--targets", type=positive, default=targets, help=f"number of targets (default {targets})")
    if limb:
        result.add_argument("--body", help="body of the run that moves (default: the seated one, or the limb's)")
    return result


def positive(text: str) -> int:
    """A whole number above zero of the command line; UserError for another one."""
    number = int(text)
    if number < 1:
        raise UserError(f"--targets: {number} is not a positive number")
    return number


def opened(args) -> Session:
    """The session on the body that the limb's task is shown on; UserError for what is not there."""
    registry.limb(args.limb)
    return Session.open(args.run, args.body or STAGES.get(args.limb, SEATED))


def card_of(args, demo: str, **spec):
    """Run card beside a demo's files; nothing where none are written."""
    return RunCard(args.out / "run_card.json", {"demo": demo, **spec}, args.seed) if args.out else nullcontext()


def measure(session: Session, name: str, inputs: str, targets: list, seed: int):
    """Attempts by who makes them, metrics, and the recorded rollout of the networks."""
    limb = session.limb(name)
    task = task_of(limb)
    policies = {
        inputs: session.controller(name, inputs),
        f"{inputs}_no_reflex": session.controller(name, inputs, with_reflex=False),
        f"{inputs}_plain": session.controller(name, inputs, feedback=PLAIN),
        "teacher": TeacherPolicy(session.teacher(name)),
    }
    if task.unit == "m":
        policies["appendix_b"] = TeacherPolicy(session.teacher(name, "appendix_b"))
    attempts, metrics = {}, {"limb": name, "inputs": inputs, "targets": len(targets)}
    for who, policy in policies.items():
        system = Staged(session.body, {name: policy}, session.others(name, seed, task.name))
        simulator = session.begin(system)
        if who != inputs:
            attempts[who] = attempt(simulator, system, limb, targets[: task.compared], who)
            continue
        rest, recorder = limb.feature(simulator.data), Recorder(simulator, [limb], RECORDED_EVERY)
        attempts[who] = attempt(simulator, system, limb, targets, who, recorder)
        if task.unit == "deg":
            error, deviation = np.rad2deg(hold(simulator, system, limb, rest))
            metrics |= {"held_error_deg": float(error), "held_deviation_deg": float(deviation)}
    return attempts, metrics | compared(task, attempts, inputs), recorder


def compared(task: Task, attempts: dict[str, Attempt], inputs: str) -> dict:
    """Metrics of the networks, and of the others on the first of the same targets."""
    networks, teacher = attempts[inputs], attempts["teacher"]
    same = len(teacher.distance)
    metrics: dict = {"compared_targets": same}
    for who, one in attempts.items():
        metrics |= task.summary(one.distance, "" if who == inputs else who.removeprefix(f"{inputs}_") + "_")
    metrics |= {
        "effort": float(networks.effort.mean()),
        "effort_over_teacher": float(networks.effort[:same].mean() / teacher.effort.mean()),
        "activation_rate_per_s": networks.activation_rate,
        "teacher_activation_rate_per_s": teacher.activation_rate,
    }
    if task.unit == "m":
        ratios, peaks = np.transpose([speed_shape(path, DEFAULT_STEP) for path in networks.path])
        metrics |= {
            "speed_peak_over_mean": float(np.median(ratios)),
            "minimum_jerk_peak_over_mean": minimum_jerk_shape(),
            "speed_peaks": float(np.median(peaks)),
        }
    return metrics


def rows_of(metrics: dict, item: str, paper: str, source: str, bars: dict[str, tuple[float, str]]) -> list[dict]:
    """A scorecard row of each metric that is not a count: with a bar's target and sense, or for information."""
    told = {name: value for name, value in metrics.items() if value is None or isinstance(value, float)}
    return [
        row(item, name, value, unit_of(name), *bars.get(name, (None, "info")), source, paper)
        for name, value in told.items()
    ]


def title(limb: str, task: str) -> str:
    """A limb and its task in words."""
    return " ".join(dict.fromkeys((limb.replace("_", " "), task)))


def unit_of(metric: str) -> str:
    """Unit of a metric, from the ending of its name."""
    return next((unit for ending, unit in UNITS.items() if metric.endswith(ending)), "1")


def error_columns(attempts: dict[str, Attempt], task: Task, targets: list) -> dict[str, np.ndarray]:
    """Targets, and distances (n, steps) in m or rad by who made them, for the rollout file."""
    steps = next(iter(attempts.values())).distance.shape[1]
    columns = {"targets": np.array(targets), "target_time": np.arange(1, steps + 1) * DEFAULT_STEP}
    for who, one in attempts.items():
        columns[f"errors_{who}"] = one.distance.astype(np.float32)
        columns[f"success_{who}"] = task.met(one.distance).astype(np.uint8)
    return columns


def perform(args, name: str, given: list | None = None, more=None) -> int:
    """Run the task ``name`` as the command line asks and write what came of it.

    Parameters
    ----------
    given : targets instead of random ones.
    more : function of session and targets: further metrics.

    Raises
    ------
    UserError
        The limb has another task, or what it needs is not in the run.
    """
    session = opened(args)
    limb = session.limb(args.limb)
    task = task_of(limb)
    if task.name != name:
        raise UserError(f"{name}: the task of {limb.name} is {task.name}")
    inputs = session.chosen_inputs(limb.name, args.inputs)
    count = len(given) if given else args.targets
    with card_of(args, name, limb=limb.name, body=session.body.name, inputs=inputs, targets=count) as card:
        targets = given or session.targets(limb.name, count, task.share, args.seed, name)
        attempts, metrics, recorder = measure(session, limb.name, inputs, targets, args.seed)
        metrics |= more(session, targets) if more else {}
        bars = {"success_rate": (task.bar, "min")} | {key: (value, "max") for key, value in task.bars.items()}
        item = f"{title(limb.name, name)}, {inputs} inputs"
        columns = recorder.columns() | error_columns(attempts, task, targets)
        rows = rows_of(metrics, item, registry.limb(limb.name).paper, task.source, bars)
        finish(args, name, columns, recorder.attrs(args.seed), metrics, rows, card)
    return 0
