"""An arm's controller on, off, on (Nakada 2018, Sec. 8.1, Fig. 21): the arm falls, is lifted again and moves forward.

All other limbs of the seated body are kept at rest by their own controllers.
"""

from __future__ import annotations

import sys

import numpy as np

from anthro import cli
from anthro.demos.criterion import time_to_radius
from anthro.demos.session import SUCCESS_RADIUS, Recorder, Session, advance, finish, parser, settled
from anthro.demos.staying import staying
from anthro.demos.task import SEATED, card_of, rows_of
from anthro.errors import UserError
from anthro.motor.kinematics import InverseKinematics
from anthro.motor.system import MotorSystem
from anthro.registry import SEATED as LIMBS

RAISED_DEG = (70.0, 25.0, 0.0, 70.0, 0.0, 0.0, 0.0)  # shoulder, elbow, forearm, wrist
FORWARD_DEG = (45.0, 30.0, 15.0, 95.0, -20.0, 0.0, 10.0)
ON_SECONDS, OFF_SECONDS = 3.0, 3.0
LEAST_FALL = 0.2  # m


def sequence(session: Session, system: MotorSystem, name: str) -> tuple[dict, Recorder]:
    """Raise the arm, let it go, lift it again, move it forward: what that came to, and the rollout."""
    limb = session.limb(name)
    hand = InverseKinematics(limb).feature
    raised, forward = hand(np.deg2rad(RAISED_DEG)), hand(np.deg2rad(FORWARD_DEG))
    simulator = session.begin(system)
    recorder, kept = Recorder(simulator, [limb]), staying(session, simulator, but=(name,))

    def go(target, seconds: float, off=()) -> tuple[np.ndarray, float]:
        """Distances (steps,) m from a target, and the height in m at which the hand ends."""
        distance = advance(simulator, system, kept | {name: target}, seconds, recorder, off)
        return distance[name], float(simulator.data.site_xpos[limb.site, 2])

    before, height_on = go(raised, ON_SECONDS)
    _, height_off = go(raised, OFF_SECONDS, off=(name,))
    system.policies[name].reset(simulator)
    again, _ = go(raised, ON_SECONDS)
    moved, _ = go(forward, ON_SECONDS)
    metrics = {
        "hand_height_on_m": height_on,
        "hand_height_off_m": height_off,
        "fall_m": height_on - height_off,
        "error_before_m": settled(before),
        "error_lifted_again_m": settled(again),
        "error_moved_m": settled(moved),
        "time_to_lift_again_s": time_to_radius(again),
    }
    return metrics, recorder


def main(argv=None) -> int:
    args = parser("on_off", __doc__, limb="left_arm").parse_args(argv)
    if not args.limb.endswith("arm"):
        raise UserError(f"--limb {args.limb}: this demo is of an arm, right_arm or left_arm")
    session = Session.open(args.run, SEATED)
    inputs = session.chosen_inputs(args.limb, args.inputs)
    with card_of(args, "on_off", limb=args.limb, inputs=inputs) as card:
        metrics, recorder = sequence(session, session.system(list(LIMBS), args.inputs), args.limb)
        metrics |= {"inputs": inputs, "limb": args.limb}
        bars = {
            "fall_m": (LEAST_FALL, "min"),
            "error_lifted_again_m": (SUCCESS_RADIUS, "max"),
            "error_moved_m": (SUCCESS_RADIUS, "max"),
        }
        item = f"Fig. 21, {args.limb.replace('_', ' ')} on, off, on, {inputs} inputs"
        rows = rows_of(metrics, item, "nakada2018", "Sec. 8.1", bars)
        finish(args, "on_off", recorder.columns(), recorder.attrs(args.seed, "stool"), metrics, rows, card)
    return 0


if __name__ == "__main__":
    sys.exit(cli.run(main))
