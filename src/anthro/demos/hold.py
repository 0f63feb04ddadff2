"""Hold a target for ten seconds and measure how far the hand drifts."""

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

APPROACH_SECONDS = 2.0
HOLD_SECONDS = 10.0
ALLOWED_DRIFT = 0.01  # m


def drift(recorder: Recorder, steps: int) -> float:
    """Largest distance in m of the hand from where it was when the hold began, last ``steps``."""
    hand = np.array([record[3] for record in recorder.rows[-steps:]])
    return float(np.linalg.norm(hand - hand[0], axis=1).max())


def measure(session: Session, inputs: str, targets: np.ndarray) -> tuple[dict, Recorder]:
    """Drifts over the targets and the rollout."""
    simulator, policy = session.simulator(), session.controller(inputs)
    recorder = Recorder(simulator)
    policy.reset(simulator)
    drifts, errors = [], []
    for target in progress(targets, len(targets), "holds"):
        advance(simulator, policy, target, APPROACH_SECONDS, recorder)
        distance = advance(simulator, policy, target, HOLD_SECONDS, recorder)
        drifts.append(drift(recorder, len(distance)))
        errors.append(float(distance.mean()))
    metrics = {
        "inputs": inputs,
        "targets": len(targets),
        "median_drift_m": float(np.median(drifts)),
        "max_drift_m": float(np.max(drifts)),
        "share_under_1_cm": float(np.mean(np.array(drifts) < ALLOWED_DRIFT)),
        "median_error_m": float(np.median(errors)),
    }
    return metrics, recorder


def main(argv=None) -> int:
    arguments = parser("hold", __doc__)
    arguments.add_argument("--targets", type=int, default=10, help="targets to hold (default 10)")
    args = arguments.parse_args(argv)
    if args.targets < 1:
        raise UserError(f"--targets: {args.targets} is not a positive number")
    session = Session.open(args.run, args.limb)
    inputs = session.chosen_inputs(args.inputs)
    spec = {"demo": "hold", "inputs": inputs, "targets": args.targets, "limb": args.limb}
    card = RunCard(args.out / "run_card.json", spec, args.seed) if args.out else nullcontext()
    with card:
        targets = random_targets(session, args.targets, args.seed)
        metrics, recorder = measure(session, inputs, targets)
        item, source = f"right arm hold, 10 s, {inputs} inputs", "Sec. 8.1"
        rows = [
            row(item, "median_drift_m", metrics["median_drift_m"], "m", ALLOWED_DRIFT, "max", source),
            row(item, "max_drift_m", metrics["max_drift_m"], "m", ALLOWED_DRIFT, "max", source),
        ]
        attrs = {"limb": args.limb, "seed": args.seed, "step_seconds": DEFAULT_STEP}
        finish(args, "hold", recorder.columns(), attrs, metrics, rows, card)
    return 0


if __name__ == "__main__":
    sys.exit(cli.run(main))
