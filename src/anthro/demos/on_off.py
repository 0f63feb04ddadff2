"""Controller on, off, on (Nakada 2018, Sec. 8.1, Fig. 21): the arm falls and is lifted again."""

from __future__ import annotations

import sys
from contextlib import nullcontext

import numpy as np

from anthro import cli
from anthro.body.simulator import DEFAULT_STEP
from anthro.demos.reach import time_to_radius
from anthro.demos.session import SUCCESS_RADIUS, Recorder, Session, advance, finish, parser, row
from anthro.motor.kinematics import InverseKinematics
from anthro.runcard import RunCard

RAISED_DEG = (70.0, 25.0, 0.0, 70.0, 0.0, 0.0, 0.0)
FORWARD_DEG = (45.0, 30.0, 15.0, 95.0, -20.0, 0.0, 10.0)
OFF_SECONDS = 3.0


def fall(simulator, target, seconds: float, recorder: Recorder) -> None:
    """Let the arm go: every activation zero."""
    silent = np.zeros(simulator.body.muscle_count)
    for _ in range(round(seconds / simulator.step_seconds)):
        recorder.take(silent, target, controller_on=False)
        simulator.step(silent)


def measure(session: Session, inputs: str) -> tuple[dict, Recorder]:
    """Run the sequence; the rollout and what it came to."""
    hand = InverseKinematics(session.body).hand
    raised, forward = hand(np.deg2rad(RAISED_DEG)), hand(np.deg2rad(FORWARD_DEG))
    simulator, policy = session.simulator(), session.controller(inputs)
    recorder = Recorder(simulator)
    policy.reset(simulator)
    first = advance(simulator, policy, raised, 3.0, recorder)
    height_on = simulator.hand_position[2]
    fall(simulator, raised, OFF_SECONDS, recorder)
    height_off = simulator.hand_position[2]
    policy.reset(simulator)
    again = advance(simulator, policy, raised, 3.0, recorder)
    moved = advance(simulator, policy, forward, 3.0, recorder)
    metrics = {
        "inputs": inputs,
        "hand_height_on_m": float(height_on),
        "hand_height_off_m": float(height_off),
        "error_before_m": float(first[-50:].mean()),
        "error_lifted_again_m": float(again[-50:].mean()),
        "error_moved_m": float(moved[-50:].mean()),
        "seconds_to_lift_again": time_to_radius(again),
    }
    return metrics, recorder


def main(argv=None) -> int:
    args = parser("on_off", __doc__).parse_args(argv)
    session = Session.open(args.run, args.limb)
    inputs = session.chosen_inputs(args.inputs)
    spec = {"demo": "on_off", "inputs": inputs, "limb": args.limb}
    card = RunCard(args.out / "run_card.json", spec, args.seed) if args.out else nullcontext()
    with card:
        metrics, recorder = measure(session, inputs)
        item = f"Fig. 21, controller on, off, on, {inputs} inputs"
        fallen = metrics["hand_height_on_m"] - metrics["hand_height_off_m"]
        lifted = metrics["error_lifted_again_m"]
        rows = [
            row(item, "fall_m", fallen, "m", 0.2, "min", "Sec. 8.1"),
            row(item, "error_lifted_again_m", lifted, "m", SUCCESS_RADIUS, "max", "Sec. 8.1"),
        ]
        attrs = {"limb": args.limb, "seed": args.seed, "step_seconds": DEFAULT_STEP}
        finish(args, "on_off", recorder.columns(), attrs, metrics, rows, card)
    return 0


if __name__ == "__main__":
    sys.exit(cli.run(main))
