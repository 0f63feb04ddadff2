"""Synthesize one shard of voluntary training pairs, [dp, a] -> da_v (Nakada 2018, Eq. 3)."""

from __future__ import annotations

import argparse
import sys
import time
from pathlib import Path

import numpy as np

from anthro import cli
from anthro.body import Body
from anthro.body.simulator import DEFAULT_STEP
from anthro.errors import UserError
from anthro.files import digest, read_json, write_shard
from anthro.motor.balance import Balance
from anthro.motor.controller import NeuromuscularController
from anthro.motor.limb import Limb, limb_plan
from anthro.motor.network import FeedForward
from anthro.motor.others import Company, Others
from anthro.motor.postures import Postures, Scatter
from anthro.motor.rollouts import Episodes, Regimen
from anthro.motor.targets import Targets
from anthro.motor.teacher import Gains, Teacher
from anthro.progress import progress
from anthro.registry import INPUTS
from anthro.streams import stream

COLUMNS = ("offset", "drive", "strain", "voluntary")


class Source:
    """Labelled pairs (offset, drive, strain, label) of one data set without end, from rollouts and single states.

    Parameters
    ----------
    spec : the data set's merged spec.
    students : controllers that move the limb in rollouts; empty, the teacher does.
    """

    def __init__(self, spec: dict, limb: Limb, students: list[NeuromuscularController], rng: np.random.Generator):
        self.limb, self._share, self._rng = limb, spec["posture_share"], rng
        company = spec.get("others") and Company(**spec["others"])
        balance = spec.get("support") and Balance(spec["support"])
        self.targets = [
            Targets(Teacher(limb, DEFAULT_STEP, Gains(**spec["teacher"])), spec["rollout"]["target_share"], rng)
            for _ in range(2)
        ]
        others = [Others(limb, company, rng) for _ in range(2)]
        self.rollouts = Episodes(self.targets[0], others[0], balance, students, regimen(spec["rollout"]), rng)
        teacher = self.targets[1].teacher
        self.states = Postures(teacher, self.targets[1], others[1], scatter(spec["postures"]), rng)

    def __iter__(self):
        rollouts, states = iter(self.rollouts), iter(self.states)
        while True:
            pair = next(states if self._rng.random() < self._share else rollouts)
            yield pair
            if self.limb.plan.side == "both":
                yield self._mirrored(*pair)

    def _mirrored(self, offset, drive, strain, label):
        """The pair of the mirrored body, which is as good: left and right are twins."""
        twins = self.limb.twins
        return offset * self.limb.sense.mirror, drive[twins], strain[twins], label[twins]

    def report(self) -> dict:
        """How many targets were drawn, how many of them the muscles cannot hold, and how many episodes fell."""
        drawn, refused = (sum(getattr(t, name) for t in self.targets) for name in ("drawn", "refused"))
        return {"targets_drawn": drawn, "targets_refused": refused, "falls": self.rollouts.falls}


def synthesize(spec: dict, limb: Limb, round_number: int, shard: int, students: list[NeuromuscularController]):
    """Columns of one shard, float32, and the source's report.

    Columns are offset (n, width) in m or rad; drive, strain, voluntary (n, muscles).
    """
    rng = stream(spec["seed"], f"{limb.name}_voluntary.round{round_number}", shard)
    count = spec["pairs"]
    widths = (limb.width, limb.size, limb.size, limb.size)
    columns = [np.empty((count, width), np.float32) for width in widths]
    source = Source(spec, limb, students, rng)
    for row, pair in progress(zip(range(count), source, strict=False), count, "pairs"):
        for column, value in zip(columns, pair, strict=True):
            column[row] = value
    return dict(zip(COLUMNS, columns, strict=True)), source.report()


def regimen(rollout: dict) -> Regimen:
    """The spec's ``rollout`` as a :class:`Regimen`."""
    return Regimen(**{**rollout, "drive_noise": tuple(rollout["drive_noise"])})


def scatter(postures: dict) -> Scatter:
    """The spec's ``postures`` as a :class:`Scatter`."""
    return Scatter(**{k: tuple(v) if isinstance(v, list) else v for k, v in postures.items()})


def load_students(limb: Limb, weights: list[Path], reflex: Path | None):
    """The controllers of the round before, one a file; the input variant follows from its width."""
    if not weights:
        return []
    if reflex is None:
        raise UserError("--students needs --reflex: the reflex acts beside every student")
    students = []
    for path in weights:
        wide = FeedForward.load(path).n_in > limb.width + limb.size
        students.append(NeuromuscularController.load(limb, path, reflex, INPUTS[wide]))
    return students


def main(argv=None) -> int:
    parser = argparse.ArgumentParser(prog="anthro.motor.synthesize", description=__doc__)
    parser.add_argument("--spec", type=Path, required=True, help="merged spec of the data set, JSON")
    parser.add_argument("--body", type=Path, required=True, help="folder of the built body")
    parser.add_argument("--round", type=int, default=0, help="round of data aggregation")
    parser.add_argument("--shard", type=int, required=True, help="number of this shard")
    parser.add_argument("--students", type=Path, nargs="*", default=[], help="voluntary weights")
    parser.add_argument("--reflex", type=Path, help="reflex weights beside the students")
    parser.add_argument("--out", type=Path, required=True, help="shard to write, HDF5")
    args = parser.parse_args(argv)
    spec = read_json(args.spec)
    limb = Limb(limb_plan(spec["limb"]), Body.load(args.body))
    students = load_students(limb, args.students, args.reflex)
    started = time.perf_counter()
    columns, report = synthesize(spec, limb, args.round, args.shard, students)
    seconds = time.perf_counter() - started
    write_shard(args.out, columns, {"spec_digest": digest(spec), "round": args.round, **report})
    print(f"{args.out}: {spec['pairs']} pairs, {1e3 * seconds / spec['pairs']:.3f} ms a pair, {report}")
    return 0


if __name__ == "__main__":
    sys.exit(cli.run(main))
