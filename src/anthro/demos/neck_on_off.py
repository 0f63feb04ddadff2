"""The neck's controller on, off, on (Nakada 2018, Sec. 8.1, Fig. 20): the head droops, is lifted, looks around.

All other limbs of the seated body are kept at rest by their own controllers.
"""

from __future__ import annotations

import sys

import numpy as np

from anthro import cli
from anthro.demos.session import Recorder, Session, advance, finish, parser, settled
from anthro.demos.staying import staying
from anthro.demos.task import SEATED, card_of, rows_of
from anthro.motor.senses import angles, direction
from anthro.motor.system import MotorSystem
from anthro.registry import SEATED as LIMBS

NECK = "neck_seated"
MOVES = {"left": (30.0, 0.0), "right": (-30.0, 0.0), "up": (0.0, 15.0), "down": (0.0, -20.0)}  # degrees
ON_SECONDS, OFF_SECONDS, LIFT_SECONDS, MOVE_SECONDS = 2.0, 3.0, 2.0, 1.5
LEAST_DROOP, ALLOWED_ERROR = 10.0, 2.0  # degrees


class Watcher:
    """Records a rollout and, beside it, azimuth and elevation of where the head points."""

    def __init__(self, recorder: Recorder, limb):
        self.recorder, self.limb, self.directions = recorder, limb, []

    def take(self, activation, targets: dict, controller_on: bool = True) -> None:
        """One control step."""
        self.recorder.take(activation, targets, controller_on)
        self.directions.append(angles(self.limb.feature(self.recorder.simulator.data)))


def sequence(session: Session, system: MotorSystem) -> tuple[dict, Watcher]:
    """Hold the head, let it go, lift it, look around: what that came to, and the rollout."""
    limb, simulator = session.limb(NECK), session.begin(system)
    kept = staying(session, simulator, but=(NECK,))
    watcher, ahead = Watcher(Recorder(simulator, [limb]), limb), direction(0.0, 0.0)

    def go(target, seconds: float, off=()) -> float:
        """Error in degrees that is left at the end."""
        distance = advance(simulator, system, kept | {NECK: target}, seconds, watcher, off)
        return float(np.rad2deg(settled(distance[NECK])))

    metrics = {"error_before_deg": go(ahead, ON_SECONDS), "droop_deg": go(ahead, OFF_SECONDS, off=(NECK,))}
    system.policies[NECK].reset(simulator)
    metrics["error_lifted_again_deg"] = go(ahead, LIFT_SECONDS)
    for name, where in MOVES.items():
        metrics[f"error_{name}_deg"] = go(direction(*np.deg2rad(where)), MOVE_SECONDS)
    metrics["error_back_deg"] = go(ahead, MOVE_SECONDS)
    return metrics, watcher


def main(argv=None) -> int:
    args = parser("neck_on_off", __doc__, limb=None).parse_args(argv)
    session = Session.open(args.run, SEATED)
    inputs = session.chosen_inputs(NECK, args.inputs)
    with card_of(args, "neck_on_off", inputs=inputs) as card:
        metrics, watcher = sequence(session, session.system(list(LIMBS), args.inputs))
        bars = {name: (ALLOWED_ERROR, "max") for name in metrics if name.startswith("error")}
        bars["droop_deg"] = LEAST_DROOP, "min"
        metrics |= {"inputs": inputs, "limb": NECK}
        rows = rows_of(metrics, f"Fig. 20, neck on, off, on, {inputs} inputs", "nakada2018", "Sec. 8.1", bars)
        columns = watcher.recorder.columns() | {"direction": np.array(watcher.directions)}
        finish(args, "neck_on_off", columns, watcher.recorder.attrs(args.seed, "stool"), metrics, rows, card)
    return 0


if __name__ == "__main__":
    sys.exit(cli.run(main))
