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
from anthro.motor.controller import INPUTS, NeuromuscularController
from anthro.motor.network import FeedForward
from anthro.motor.postures import Postures, Scatter
from anthro.motor.rollouts import Episodes, Regimen, random_pose
from anthro.motor.teacher import Gains, Teacher
from anthro.progress import progress
from anthro.streams import stream

COLUMNS = ("offset", "drive", "strain", "voluntary")


def labelled_pairs(
    spec: dict, body: Body, students: list[NeuromuscularController], rng: np.random.Generator
):
    """Yield pairs (offset, drive, strain, label) for ever, from rollouts and single states."""
    teachers = [Teacher(body, DEFAULT_STEP, Gains(**spec["teacher"])) for _ in range(2)]
    rollouts = Episodes(body, teachers[0], students, regimen(spec["rollout"]), rng)

    def pose():
        return random_pose(body, spec["rollout"]["target_share"], rng)

    states = Postures(body, teachers[1], pose, scatter(spec["postures"]), rng)
    return mixed(rollouts, states, spec["posture_share"], rng)


def synthesize(
    spec: dict, body: Body, round_number: int, shard: int, students: list[NeuromuscularController]
) -> dict[str, np.ndarray]:
    """Columns of one shard: offset (n, 3) m; drive, strain, voluntary (n, muscles); float32."""
    rng = stream(spec["seed"], f"{spec['limb']}_voluntary.round{round_number}", shard)
    count = spec["pairs"]
    widths = (3, body.muscle_count, body.muscle_count, body.muscle_count)
    columns = [np.empty((count, width), np.float32) for width in widths]
    pairs = zip(labelled_pairs(spec, body, students, rng), range(count), strict=False)
    for pair, row in progress(pairs, count, "pairs"):
        for column, value in zip(columns, pair, strict=True):
            column[row] = value
    return dict(zip(COLUMNS, columns, strict=True))


def mixed(rollouts, states, state_share: float, rng: np.random.Generator):
    """Draw each pair from ``states`` with probability ``state_share``, else from ``rollouts``."""
    rollouts, states = iter(rollouts), iter(states)
    while True:
        yield next(states if rng.random() < state_share else rollouts)


def regimen(rollout: dict) -> Regimen:
    """The spec's ``rollout`` as a :class:`Regimen`."""
    return Regimen(**{**rollout, "drive_noise": tuple(rollout["drive_noise"])})


def scatter(postures: dict) -> Scatter:
    """The spec's ``postures`` as a :class:`Scatter`."""
    return Scatter(**{k: tuple(v) if isinstance(v, list) else v for k, v in postures.items()})


def load_students(weights: list[Path], reflex: Path | None, muscles: int):
    """The controllers of the round before, one a file; the input variant follows from its width."""
    if not weights:
        return []
    if reflex is None:
        raise UserError("--students needs --reflex: the reflex acts beside every student")
    students = []
    for path in weights:
        wide = FeedForward.load(path).n_in > 3 + muscles
        students.append(NeuromuscularController.load(path, reflex, muscles, INPUTS[wide]))
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
    spec, body = read_json(args.spec), Body.load(args.body)
    students = load_students(args.students, args.reflex, body.muscle_count)
    started = time.perf_counter()
    columns = synthesize(spec, body, args.round, args.shard, students)
    seconds = time.perf_counter() - started
    write_shard(args.out, columns, {"spec_digest": digest(spec), "round": args.round})
    print(f"{args.out}: {spec['pairs']} pairs, {1e3 * seconds / spec['pairs']:.3f} ms a pair")
    return 0


if __name__ == "__main__":
    sys.exit(cli.run(main))
