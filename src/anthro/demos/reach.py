"""Reach for targets, one after the other, by the networks alone; the teacher beside them.

Targets are hand positions of poses drawn uniformly from the middle 70 % of each joint's range, each
begun where the last one ended. A target is a success when the mean distance over the last 0.25 s of
its 1.5 s is under 3 cm.
"""

from __future__ import annotations

import sys
from contextlib import nullcontext

import numpy as np

from anthro import cli
from anthro.body.simulator import DEFAULT_STEP
from anthro.demos.session import SUCCESS_RADIUS, Recorder, Session, advance, finish, parser, row
from anthro.errors import UserError
from anthro.motor.kinematics import InverseKinematics
from anthro.motor.rollouts import random_pose
from anthro.motor.teacher import TeacherPolicy
from anthro.progress import progress
from anthro.runcard import RunCard
from anthro.streams import stream

SECONDS = 1.5
SETTLED = 0.25  # s, at the end of a target
RANGE_SHARE = 0.7
UNREACHABLE = 0.01  # m, between a target and the nearest pose's hand


def random_targets(session: Session, count: int, seed: int) -> np.ndarray:
    """Held-out targets (count, 3) m."""
    rng = stream(seed, f"demos.reach.{session.limb}")
    hand = InverseKinematics(session.body).hand
    return np.array([hand(random_pose(session.body, RANGE_SHARE, rng)) for _ in range(count)])


def given_targets(values) -> np.ndarray:
    """Targets (n, 3) m from the command line; UserError when one is not finite."""
    targets = np.array(values, float)
    if not np.isfinite(targets).all():
        bad = int(np.argwhere(~np.isfinite(targets).all(axis=1))[0, 0])
        raise UserError(f"target {bad + 1} is not finite: {targets[bad].tolist()}")
    return targets


def reach(session: Session, policy, targets, label: str, recorder=None) -> np.ndarray:
    """Distances (targets, steps) m of one policy on all targets in a row."""
    simulator = session.simulator()
    policy.reset(simulator)
    if recorder is not None:
        recorder.simulator = simulator
    runs = progress(targets, len(targets), label)
    return np.array([advance(simulator, policy, target, SECONDS, recorder) for target in runs])


def summary(errors: np.ndarray) -> dict:
    """Success rate, settled errors in m and time to the success radius in s of (targets, steps)."""
    settled = settled_error(errors)
    success = settled < SUCCESS_RADIUS
    times = [time_to_radius(distance) for distance in errors[success]]
    return {
        "success_rate": float(success.mean()),
        "median_error_m": float(np.median(settled)),
        "p90_error_m": float(np.quantile(settled, 0.9)),
        "median_time_s": float(np.median(times)) if times else None,
    }


def time_to_radius(distance: np.ndarray) -> float | None:
    """Seconds after which distances (steps,) m first come under 3 cm; None when they never do."""
    inside = np.flatnonzero(distance < SUCCESS_RADIUS)
    return float((inside[0] + 1) * DEFAULT_STEP) if len(inside) else None


def settled_error(errors: np.ndarray) -> np.ndarray:
    """Mean distance (targets,) m over the last 0.25 s."""
    return errors[:, -round(SETTLED / DEFAULT_STEP) :].mean(axis=1)


def measure(session: Session, inputs: str, targets: np.ndarray):
    """Errors by policy, metrics and the recorded rollout of the networks."""
    recorder = Recorder(None)
    policies = {
        inputs: session.controller(inputs),
        f"{inputs}_no_reflex": session.controller(inputs, with_reflex=False),
        "teacher": TeacherPolicy(session.teacher()),
        "appendix_b": TeacherPolicy(session.teacher("appendix_b")),
    }
    errors = {
        name: reach(session, policy, targets, name, recorder if name == inputs else None)
        for name, policy in policies.items()
    }
    metrics = {"inputs": inputs, "targets": len(targets), **summary(errors[inputs])}
    prefixes = {"teacher": "teacher", "appendix_b": "appendix_b", f"{inputs}_no_reflex": "no_reflex"}
    for name, prefix in prefixes.items():
        metrics |= {f"{prefix}_{key}": value for key, value in summary(errors[name]).items()}
    solve = InverseKinematics(session.body).solve
    far = [index for index, target in enumerate(targets) if solve(target).error > UNREACHABLE]
    metrics["unreachable_targets"] = far
    return errors, metrics, recorder


def rows_of(inputs: str, m: dict) -> list[dict]:
    """Scorecard rows of one input variant."""
    item = f"right arm reach, {inputs} inputs"
    bars = {"success_rate": (0.90, "min"), "median_error_m": (0.015, "max")}
    units = {"success_rate": "1", "median_error_m": "m", "p90_error_m": "m", "median_time_s": "s"}
    result = []
    for metric, unit in units.items():
        target, sense = bars.get(metric, (None, "info"))
        result.append(row(item, metric, m[metric], unit, target, sense, "Sec. 8.1"))
        result.append(row(item, f"no_reflex_{metric}", m[f"no_reflex_{metric}"], unit))
    teacher, literal = "teacher on the same targets", "teacher by App. B to the letter"
    return [
        *result,
        row(f"{item}: {teacher}", "success_rate", m["teacher_success_rate"], "1", 0.95, "min", "App. B"),
        row(f"{item}: {teacher}", "median_error_m", m["teacher_median_error_m"], "m", source="App. B"),
        row(f"{item}: {literal}", "success_rate", m["appendix_b_success_rate"], "1", source="App. B"),
    ]


def main(argv=None) -> int:
    arguments = parser("reach", __doc__)
    arguments.add_argument("--targets", type=int, default=100, help="number of random targets")
    arguments.add_argument(
        "--target", type=float, nargs=3, action="append", metavar=("X", "Y", "Z"),
        help="reach for this point instead, m (x forward, y left, z up); may be repeated",
    )  # fmt: skip
    args = arguments.parse_args(argv)
    if args.targets < 1:
        raise UserError(f"--targets: {args.targets} is not a positive number")
    session = Session.open(args.run, args.limb)
    inputs = session.chosen_inputs(args.inputs)
    targets = (
        given_targets(args.target)
        if args.target
        else random_targets(session, args.targets, args.seed)
    )
    spec = {"demo": "reach", "inputs": inputs, "targets": len(targets), "limb": args.limb}
    card = RunCard(args.out / "run_card.json", spec, args.seed) if args.out else nullcontext()
    with card:
        errors, metrics, recorder = measure(session, inputs, targets)
        columns = recorder.columns()
        columns |= {"targets": targets, "target_time": np.arange(1, errors[inputs].shape[1] + 1) * DEFAULT_STEP}
        for name, values in errors.items():
            columns[f"errors_{name}"] = values.astype(np.float32)
            columns[f"success_{name}"] = (settled_error(values) < SUCCESS_RADIUS).astype(np.uint8)
        attrs = {"limb": args.limb, "seed": args.seed, "step_seconds": DEFAULT_STEP}
        finish(args, "reach", columns, attrs, metrics, rows_of(inputs, metrics), card)
    return 0


if __name__ == "__main__":
    sys.exit(cli.run(main))
