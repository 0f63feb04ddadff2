"""Push the hand with 20 N for 0.1 s while it holds a target, and measure how soon it is back."""

from __future__ import annotations

import sys
from contextlib import nullcontext

import numpy as np

from anthro import cli
from anthro.body.simulator import DEFAULT_STEP
from anthro.demos.reach import random_targets
from anthro.demos.session import SUCCESS_RADIUS, Recorder, Session, advance, finish, parser, row
from anthro.errors import UserError
from anthro.progress import progress
from anthro.runcard import RunCard
from anthro.streams import stream

FORCE = 20.0  # N
PUSH_SECONDS = 0.1
WATCH_SECONDS = 2.0
RETURNED = 0.01  # m from where the hand was before the push
ALLOWED_SECONDS = 1.0


def recovery_time(displacement: np.ndarray, radius: float = RETURNED) -> float:
    """Seconds after which displacements (steps,) m stay below a radius in m; inf when they do not."""
    away = np.flatnonzero(displacement > radius)
    if len(away) == 0:
        return 0.0
    return float("inf") if away[-1] == len(displacement) - 1 else (away[-1] + 1) * DEFAULT_STEP


def push_once(simulator, policy, target, direction, recorder) -> tuple[float, float, float]:
    """Seconds from the push's end until the hand is back, and its largest displacement in m.

    Back is within 1 cm of where it was (first number), and within the success radius of the target
    (second).
    """
    advance(simulator, policy, target, WATCH_SECONDS, recorder)
    before, first = simulator.hand_position, len(recorder.rows)
    simulator.push(FORCE * direction)
    advance(simulator, policy, target, PUSH_SECONDS, recorder)
    simulator.push((0.0, 0.0, 0.0))
    advance(simulator, policy, target, WATCH_SECONDS, recorder)
    hand = np.array([record[3] for record in recorder.rows[first:]])
    displacement = np.linalg.norm(hand - before, axis=1)
    pushed = round(PUSH_SECONDS / DEFAULT_STEP)
    error = np.linalg.norm(hand - target, axis=1)
    on_target = recovery_time(error[pushed:], SUCCESS_RADIUS)
    return recovery_time(displacement[pushed:]), on_target, float(displacement.max())


def measure(session: Session, inputs: str, targets: np.ndarray, seed: int):
    """Recovery over the targets, each pushed in a random direction, and the rollout."""
    simulator, policy = session.simulator(), session.controller(inputs)
    recorder, rng = Recorder(simulator), stream(seed, f"demos.push.{session.limb}")
    policy.reset(simulator)
    results = []
    for target in progress(targets, len(targets), "pushes"):
        direction = rng.normal(size=3)
        direction /= np.linalg.norm(direction)
        results.append(push_once(simulator, policy, target, direction, recorder))
    times, on_target, peaks = np.array(results).T
    median = float(np.median(times))
    metrics = {
        "inputs": inputs,
        "pushes": len(targets),
        "recovered_within_1_s": float(np.mean(times <= ALLOWED_SECONDS)),
        "on_target_within_1_s": float(np.mean(on_target <= ALLOWED_SECONDS)),
        "median_recovery_s": median if np.isfinite(median) else None,
        "median_peak_displacement_m": float(np.median(peaks)),
    }
    return metrics, recorder


def main(argv=None) -> int:
    arguments = parser("push", __doc__)
    arguments.add_argument("--targets", type=int, default=20, help="pushes (default 20)")
    args = arguments.parse_args(argv)
    if args.targets < 1:
        raise UserError(f"--targets: {args.targets} is not a positive number")
    session = Session.open(args.run, args.limb)
    inputs = session.chosen_inputs(args.inputs)
    spec = {"demo": "push", "inputs": inputs, "targets": args.targets, "limb": args.limb}
    card = RunCard(args.out / "run_card.json", spec, args.seed) if args.out else nullcontext()
    with card:
        targets = random_targets(session, args.targets, args.seed)
        metrics, recorder = measure(session, inputs, targets, args.seed)
        item = f"right arm push, 20 N for 0.1 s, {inputs} inputs"
        within = metrics["recovered_within_1_s"]
        rows = [
            row(item, "recovered_within_1_s", within, "1", 1.0, "min", "Sec. 8.1"),
            row(item, "on_target_within_1_s", metrics["on_target_within_1_s"], "1", 1.0, "min", "Sec. 8.1"),
            row(item, "median_recovery_s", metrics["median_recovery_s"], "s"),
            row(item, "median_peak_displacement_m", metrics["median_peak_displacement_m"], "m"),
        ]
        attrs = {"limb": args.limb, "seed": args.seed, "step_seconds": DEFAULT_STEP}
        finish(args, "push", recorder.columns(), attrs, metrics, rows, card)
    return 0


if __name__ == "__main__":
    sys.exit(cli.run(main))
