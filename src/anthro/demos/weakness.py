"""Each limb's task with weak muscles, and with some muscles off; by the networks alone, which were not told.

A weak muscle is a thinner one: its greatest active force and its parallel elastic element shrink alike. A muscle that
is off receives no activation; its parallel element still pulls and its spindles still report. Zhou et al. 2021, Sec.
5.3 and Fig. 8, turn off 40 % of the core's muscles; of other limbs' a fifth is off.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass, replace

import numpy as np

from anthro import cli, registry
from anthro.body import Body
from anthro.demos.attempt import Staged, attempt
from anthro.demos.criterion import task_of
from anthro.demos.session import Session, finish
from anthro.demos.task import arguments, card_of, opened, rows_of, title
from anthro.motor.limb import Limb
from anthro.streams import stream

STRENGTHS = (1.0, 0.8, 0.6)
OFF_SHARE = {"core": 0.4}
USUAL_OFF_SHARE = 0.2


@dataclass(frozen=True)
class Condition:
    """One state of a limb's muscles: their strength, and those that are off (body indices)."""

    name: str
    strength: float = 1.0
    silent: tuple[int, ...] = ()

    def body(self, limb: Limb) -> Body:
        """The limb's body with its muscles of this strength."""
        force = limb.body.max_force.copy()
        force[limb.muscles] *= self.strength
        return replace(limb.body, max_force=force)


def conditions(limb: Limb, seed: int) -> list[Condition]:
    """Full, 80 % and 60 % strength, and a random share of the muscles off."""
    share = OFF_SHARE.get(limb.name, USUAL_OFF_SHARE)
    rng = stream(seed, f"demos.weakness.{limb.name}.off")
    off = np.sort(rng.choice(limb.muscles, round(share * limb.size), replace=False))
    weak = [Condition(f"strength_{round(100 * s)}", s) for s in STRENGTHS]
    return [*weak, Condition(f"off_{round(100 * share)}", silent=tuple(int(i) for i in off))]


def measure(session: Session, name: str, inputs: str, targets: list, seed: int) -> dict:
    """Metrics of the networks in every condition, on the same targets."""
    limb = session.limb(name)
    task = task_of(limb)
    metrics: dict = {"limb": name, "inputs": inputs, "targets": len(targets)}
    for condition in conditions(limb, seed):
        others = session.others(name, seed, task.name)
        system = Staged(session.body, {name: session.controller(name, inputs)}, others, condition.silent)
        simulator = session.begin(system, condition.body(limb).simulator())
        tried = attempt(simulator, system, limb, targets, condition.name)
        metrics |= task.summary(tried.distance, f"{condition.name}_")
    return metrics


def main(argv=None) -> int:
    args = arguments("weakness", __doc__, "right_arm", 20).parse_args(argv)
    session = opened(args)
    limb = session.limb(args.limb)
    task, inputs = task_of(limb), session.chosen_inputs(limb.name, args.inputs)
    spec = {"limb": limb.name, "body": session.body.name, "inputs": inputs, "targets": args.targets}
    with card_of(args, "weakness", **spec) as card:
        targets = session.targets(limb.name, args.targets, task.share, args.seed, "weakness")
        metrics = measure(session, limb.name, inputs, targets, args.seed)
        item = f"{title(limb.name, task.name)} with weak muscles, {inputs} inputs"
        rows = rows_of(metrics, item, registry.limb(limb.name).paper, "Sec. 5.3", {})
        finish(args, "weakness", {}, {}, metrics, rows, card)
    return 0


if __name__ == "__main__":
    sys.exit(cli.run(main))
