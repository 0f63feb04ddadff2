"""Keep the round of data aggregation whose voluntary network does its limb's task best.

What a round ends in jumps about: more data, labelled where the last networks went, may lead to a worse controller.
Aggregation therefore returns the best of its policies on validation (Ross et al. 2011, Algorithm 3.1). Each round's
network moves the limb, the reflex beside it, to validation targets, which neither the training nor the demos see.
"""

from __future__ import annotations

import json
import shutil
import sys
from pathlib import Path

from anthro import cli
from anthro.demos.attempt import Staged, attempt
from anthro.demos.choose import rank
from anthro.demos.criterion import task_of
from anthro.demos.session import Session
from anthro.demos.task import arguments, opened
from anthro.errors import UserError
from anthro.files import atomic, write_json


def tried(session: Session, name: str, inputs: str, weights: Path, targets: list, seed: int) -> dict:
    """How well a limb's network of one round does on targets: success rate and errors, as its task's metrics."""
    limb = session.limb(name)
    task = task_of(limb)
    controller = session.controller(name, inputs, weights=weights)
    system = Staged(session.body, {name: controller}, session.others(name, seed, "select"))
    return task.summary(attempt(session.begin(system), system, limb, targets, weights.parent.name).distance)


def main(argv=None) -> int:
    parser = arguments("select", __doc__, "right_arm", 40)
    parser.add_argument("--rounds", type=Path, nargs="+", required=True, help="weights of each round, oldest first")
    args = parser.parse_args(argv)
    if not (args.inputs and args.out):
        raise UserError("--inputs and --out are needed: which variant is tried, and where the best goes")
    session = opened(args)
    limb = session.limb(args.limb)
    targets = session.targets(args.limb, args.targets, task_of(limb).share, args.seed, "select")
    found = [tried(session, args.limb, args.inputs, path, targets, args.seed) for path in args.rounds]
    best = min(range(len(found)), key=lambda number: (rank(found[number]), -number))
    with atomic(args.out / "weights.h5") as partial:
        shutil.copyfile(args.rounds[best], partial)
    selection = {"kept": best, "targets": args.targets, "rounds": found}
    write_json(args.out / "selection.json", selection)
    rates = ", ".join(f"{100 * metrics['success_rate']:.0f} %" for metrics in found)
    told = f"{args.limb}, {args.inputs} inputs: {rates} of {args.targets} targets; round {best} is kept"
    print(json.dumps(selection, indent=1, sort_keys=True) if args.json else told)
    return 0


if __name__ == "__main__":
    sys.exit(cli.run(main))
