"""Hold targets for ten seconds each and measure how far the hand drifts."""

from __future__ import annotations

import sys

import numpy as np

from anthro import cli
from anthro.demos.criterion import task_of
from anthro.demos.session import Recorder, Session, advance, finish
from anthro.demos.task import arguments, card_of, opened, rows_of, title
from anthro.errors import UserError
from anthro.motor.system import MotorSystem
from anthro.progress import progress

APPROACH_SECONDS = 2.0
HOLD_SECONDS = 10.0
ALLOWED_DRIFT = 0.01  # m


def points(session: Session, name: str, count: int, seed: int, demo: str) -> list[np.ndarray]:
    """Held-out points (3,) m for an arm's or a leg's effector; UserError for another limb."""
    task = task_of(session.limb(name))
    if task.name != "reach":
        raise UserError(f"{demo}: the task of {name} is {task.name}; an arm or a leg is wanted")
    return session.targets(name, count, task.share, seed, demo)


def drift(path: np.ndarray) -> float:
    """Largest distance in m from the first of positions (n, 3) m."""
    return float(np.linalg.norm(path - path[0], axis=1).max())


def holds(session: Session, system: MotorSystem, name: str, targets) -> tuple[dict, Recorder]:
    """Drifts over the targets, and the rollout."""
    simulator = session.begin(system)
    recorder, drifts, errors = Recorder(simulator, [session.limb(name)]), [], []
    for target in progress(targets, len(targets), "holds"):
        advance(simulator, system, {name: target}, APPROACH_SECONDS, recorder)
        first = len(recorder.rows)
        distance = advance(simulator, system, {name: target}, HOLD_SECONDS, recorder)
        drifts.append(drift(np.array([row[3][0] for row in recorder.rows[first:]])))
        errors.append(float(distance[name].mean()))
    metrics = {
        "median_drift_m": float(np.median(drifts)),
        "max_drift_m": float(np.max(drifts)),
        "share_under_1_cm": float(np.mean(np.array(drifts) < ALLOWED_DRIFT)),
        "median_error_m": float(np.median(errors)),
    }
    return metrics, recorder


def main(argv=None) -> int:
    args = arguments("hold", __doc__, "right_arm", 10).parse_args(argv)
    session = opened(args)
    targets = points(session, args.limb, args.targets, args.seed, "hold")
    inputs = session.chosen_inputs(args.limb, args.inputs)
    with card_of(args, "hold", limb=args.limb, inputs=inputs, targets=args.targets) as card:
        metrics, recorder = holds(session, session.system([args.limb], args.inputs), args.limb, targets)
        metrics |= {"inputs": inputs, "limb": args.limb, "targets": args.targets}
        bars = {"median_drift_m": (ALLOWED_DRIFT, "max"), "max_drift_m": (ALLOWED_DRIFT, "max")}
        item = f"{title(args.limb, 'hold')}, 10 s, {inputs} inputs"
        rows = rows_of(metrics, item, "nakada2018", "Sec. 8.1", bars)
        finish(args, "hold", recorder.columns(), recorder.attrs(args.seed), metrics, rows, card)
    return 0


if __name__ == "__main__":
    sys.exit(cli.run(main))
