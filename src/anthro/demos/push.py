"""Push the hand with 20 N for 0.1 s while it holds a target, and measure how soon it is back."""

from __future__ import annotations

import sys

import numpy as np

from anthro import cli
from anthro.body.simulator import DEFAULT_STEP
from anthro.demos.hold import points
from anthro.demos.session import SUCCESS_RADIUS, Recorder, Session, advance, finish, row
from anthro.demos.task import arguments, card_of, opened, title
from anthro.motor.system import MotorSystem
from anthro.progress import progress
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


def push_once(simulator, system: MotorSystem, limb, target, direction, recorder) -> tuple[float, float, float]:
    """Seconds from the push's end until the effector is back, and its largest displacement in m.

    Back is within 1 cm of where it was (first number), and within the success radius of the target
    (second).
    """
    targets = {limb.name: target}
    advance(simulator, system, targets, WATCH_SECONDS, recorder)
    before, first = simulator.data.site_xpos[limb.site].copy(), len(recorder.rows)
    simulator.push(FORCE * direction, limb.plan.effector)
    advance(simulator, system, targets, PUSH_SECONDS, recorder)
    simulator.push((0.0, 0.0, 0.0), limb.plan.effector)
    advance(simulator, system, targets, WATCH_SECONDS, recorder)
    path = np.array([row[3][0] for row in recorder.rows[first:]])
    displacement, error = (np.linalg.norm(path - point, axis=1) for point in (before, target))
    pushed = round(PUSH_SECONDS / DEFAULT_STEP)
    on_target = recovery_time(error[pushed:], SUCCESS_RADIUS)
    return recovery_time(displacement[pushed:]), on_target, float(displacement.max())


def pushes(session: Session, system: MotorSystem, name: str, targets, seed: int) -> tuple[dict, Recorder]:
    """Recovery over the targets, each pushed in a random direction, and the rollout."""
    limb, simulator = session.limb(name), session.begin(system)
    recorder, rng = Recorder(simulator, [limb]), stream(seed, f"demos.push.{name}.directions")
    results = []
    for target in progress(targets, len(targets), "pushes"):
        direction = rng.normal(size=3)
        direction /= np.linalg.norm(direction)
        results.append(push_once(simulator, system, limb, target, direction, recorder))
    times, on_target, peaks = np.array(results).T
    median = float(np.median(times))
    metrics = {
        "recovered_within_1_s": float(np.mean(times <= ALLOWED_SECONDS)),
        "on_target_within_1_s": float(np.mean(on_target <= ALLOWED_SECONDS)),
        "median_recovery_s": median if np.isfinite(median) else None,
        "median_peak_displacement_m": float(np.median(peaks)),
    }
    return metrics, recorder


def main(argv=None) -> int:
    args = arguments("push", __doc__, "right_arm", 20).parse_args(argv)
    session = opened(args)
    targets = points(session, args.limb, args.targets, args.seed, "push")
    inputs = session.chosen_inputs(args.limb, args.inputs)
    with card_of(args, "push", limb=args.limb, inputs=inputs, targets=args.targets) as card:
        metrics, recorder = pushes(session, session.system([args.limb], args.inputs), args.limb, targets, args.seed)
        metrics |= {"inputs": inputs, "limb": args.limb, "targets": args.targets}
        item = f"{title(args.limb, 'push')}, 20 N for 0.1 s, {inputs} inputs"
        rows = [
            row(item, "recovered_within_1_s", metrics["recovered_within_1_s"], "1", 1.0, "min", "Sec. 8.1"),
            row(item, "on_target_within_1_s", metrics["on_target_within_1_s"], "1", 1.0, "min", "Sec. 8.1"),
            row(item, "median_recovery_s", metrics["median_recovery_s"], "s"),
            row(item, "median_peak_displacement_m", metrics["median_peak_displacement_m"], "m"),
        ]
        finish(args, "push", recorder.columns(), recorder.attrs(args.seed), metrics, rows, card)
    return 0


if __name__ == "__main__":
    sys.exit(cli.run(main))
