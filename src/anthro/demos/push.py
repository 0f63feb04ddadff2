"""Push the hand with 20 N for 0.1 s while it holds a target, and measure how soon it is back."""

from __future__ import annotations

import sys
from contextlib import nullcontext

import numpy as np

from anthro import cli
from anthro.body.simulator import DEFAULT_STEP
from anthro.demos.reach import random_targets
from anthro.demos.session import Recorder, Session, advance, finish, parser, row
from anthro.errors import UserError
from anthro.progress import progress
from anthro.runcard import RunCard
from anthro.streams import stream

FORCE = 20.0  # N
PUSH_SECONDS = 0.1
WATCH_SECONDS = 2.0
RETURNED = 0.01  # m from where the hand was before the push
ALLOWED_SECONDS = 1.0


def recovery_time(displacement: np.ndarray) -> float:
    """Seconds after which displacements (steps,) m stay below 1 cm; inf when they do not."""
    away = np.flatnonzero(displacement > RETURNED)
    if len(away) == 0:
        return 0.0
    return float("inf") if away[-1] == len(displacement) - 1 else (away[-1] + 1) * DEFAULT_STEP


def push_once(simulator, policy, target, direction, recorder) -> tuple[float, float]:
    """Recovery time in s after the push's end, and the largest displacement in m."""
    advance(simulator, policy, target, WATCH_SECONDS, recorder)
    before, first = simulator.hand_position, len(recorder.rows)
    simulator.push(FORCE * direction)
    advance(simulator, policy, target, PUSH_SECONDS, recorder)
    simulator.push((0.0, 0.0, 0.0))
    advance(simulator, policy, target, WATCH_SECONDS, recorder)
    hand = np.array([record[3] for record in recorder.rows[first:]])
    displacement = np.linalg.norm(hand - before, axis=1)
    pushed = round(PUSH_SECONDS / DEFAULT_STEP)
    return recovery_time(displacement[pushed:]), float(displacement.max())


def measure(session: Session, inputs: str, targets: np.ndarray, seed: int):
    """Recovery over the targets, each pushed in a random direction, and the rollout."""
    simulator, policy = session.simulator(), session.controller(inputs)
    recorder, rng = Recorder(simulator), stream(seed, f"demos.push.{session.limb}")
    policy.reset(simulator)
    times, peaks = [], []
    for target in progress(targets, len(targets), "pushes"):
        direction = rng.normal(size=3)
        direction /= np.linalg.norm(direction)
        seconds, peak = push_once(simulator, policy, target, direction, recorder)
        times.append(seconds)
        peaks.append(peak)
    median = float(np.median(times))
    metrics = {
        "inputs": inputs,
        "pushes": len(targets),
        "recovered_within_1_s": float(np.mean(np.array(times) <= ALLOWED_SECONDS)),
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
            row(item, "median_recovery_s", metrics["median_recovery_s"], "s"),
            row(item, "median_peak_displacement_m", metrics["median_peak_displacement_m"], "m"),
        ]
        attrs = {"limb": args.limb, "seed": args.seed, "step_seconds": DEFAULT_STEP}
        finish(args, "push", recorder.columns(), attrs, metrics, rows, card)
    return 0


if __name__ == "__main__":
    sys.exit(cli.run(main))
