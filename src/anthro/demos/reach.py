"""Reach for targets, one after the other, by the networks alone; the teacher beside them.

Targets are what hand or foot reaches in poses drawn uniformly from the middle 70 % of each joint's range, each begun
where the last one ended. A target is a success when the mean distance over the last 0.25 s of its 1.5 s is under 3 cm.
Arms and legs sit on the seated body, whose other limbs are limp meanwhile: its torso is welded, so that the limb does
not feel them.
"""

from __future__ import annotations

import sys

import numpy as np

from anthro import cli
from anthro.demos.session import Session
from anthro.demos.task import arguments, perform
from anthro.errors import UserError
from anthro.motor.kinematics import InverseKinematics

UNREACHABLE = 0.01  # m, between a target and the nearest pose's hand


def given_targets(values) -> list[np.ndarray]:
    """Targets (3,) m from the command line; UserError when one is not finite."""
    for index, value in enumerate(values):
        if not np.isfinite(value).all():
            raise UserError(f"target {index + 1} is not finite: {value}")
    return [np.array(value) for value in values]


def unreachable(session: Session, limb: str, targets) -> dict:
    """Which targets no pose of the limb comes near."""
    solve = InverseKinematics(session.limb(limb)).solve
    return {"unreachable_targets": [i for i, target in enumerate(targets) if solve(target).error > UNREACHABLE]}


def main(argv=None) -> int:
    asked = arguments("reach", __doc__, "right_arm", 100)
    asked.add_argument(
        "--target", type=float, nargs=3, action="append", metavar=("X", "Y", "Z"),
        help="reach for this point instead, m (x forward, y left, z up); may be repeated",
    )  # fmt: skip
    args = asked.parse_args(argv)
    given = given_targets(args.target or [])
    return perform(args, "reach", given, lambda session, targets: unreachable(session, args.limb, targets))


if __name__ == "__main__":
    sys.exit(cli.run(main))
