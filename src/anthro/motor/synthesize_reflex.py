"""Synthesize one shard of reflex training pairs, [de, de'] -> da_r (Nakada 2018, Eq. 4 to 6).

The limb wanders between random poses: the threshold of the stretch reflex moves from one pose's to
the next, pushes strike the hand, and each control step gives one pair.
"""

from __future__ import annotations

import argparse
import sys
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from anthro import cli
from anthro.body import Body
from anthro.body.simulator import DEFAULT_STEP
from anthro.files import digest, read_json, write_shard
from anthro.motor.reflex import STRAIN_GAIN, accumulate, activation, reflex_adjustment
from anthro.motor.rollouts import random_pose
from anthro.motor.teacher import Gains, StaticPosture
from anthro.progress import progress
from anthro.streams import stream


@dataclass(frozen=True)
class Wander:
    """The keys of ``rollout`` in ``config/data/<limb>_reflex.yaml``."""

    pose_share: float
    travel_seconds: tuple[float, float]
    push_probability: float
    push_force: float
    push_seconds: float


def wander_regimen(rollout: dict) -> Wander:
    """The spec's ``rollout`` as a :class:`Wander`."""
    return Wander(**{**rollout, "travel_seconds": tuple(rollout["travel_seconds"])})


def wander(body: Body, regimen: Wander, gains: Gains, rng: np.random.Generator):
    """Yield (strain change, strain rate change), (n,) and (n,) 1/s, for ever."""
    simulator, statics = body.simulator(DEFAULT_STEP), StaticPosture(body, gains)
    pose = random_pose(body, regimen.pose_share, rng)
    drive, strain, _ = statics.drive(pose)
    drive, threshold = drive.copy(), drive - STRAIN_GAIN * strain
    simulator.reset(pose)
    while True:
        drive_there, strain_there, _ = statics.drive(random_pose(body, regimen.pose_share, rng))
        goal = drive_there - STRAIN_GAIN * strain_there
        steps = round(rng.uniform(*regimen.travel_seconds) / simulator.step_seconds)
        push = rng.normal(0.0, regimen.push_force, 3) * (rng.random() < regimen.push_probability)
        push_steps = round(regimen.push_seconds / simulator.step_seconds)
        for step in range(2 * steps):
            travel = (goal - threshold) / steps if step < steps else 0.0
            simulator.push(push if step < push_steps else (0.0, 0.0, 0.0))
            before, rate_before = simulator.strain, simulator.strain_rate
            simulator.step(activation(drive))
            change, rate_change = simulator.strain - before, simulator.strain_rate - rate_before
            drive = accumulate(drive, travel, reflex_adjustment(change, rate_change))
            yield change, rate_change
        threshold = goal


def synthesize(spec: dict, body: Body, shard: int) -> dict[str, np.ndarray]:
    """Columns of one shard: strain_change, strain_rate_change, reflex, each (n, muscles) float32."""
    rng = stream(spec["seed"], f"{spec['limb']}_reflex", shard)
    count, gains = spec["pairs"], Gains(**spec["teacher"])
    changes = np.empty((2, count, body.muscle_count))
    steps = zip(wander(body, wander_regimen(spec["rollout"]), gains, rng), range(count), strict=False)
    for (change, rate_change), row in progress(steps, count, "pairs"):
        changes[:, row] = change, rate_change
    columns = {
        "strain_change": changes[0],
        "strain_rate_change": changes[1],
        "reflex": reflex_adjustment(*changes),
    }
    return {name: values.astype(np.float32) for name, values in columns.items()}


def main(argv=None) -> int:
    parser = argparse.ArgumentParser(prog="anthro.motor.synthesize_reflex", description=__doc__)
    parser.add_argument("--spec", type=Path, required=True, help="merged spec of the data set, JSON")
    parser.add_argument("--body", type=Path, required=True, help="folder of the built body")
    parser.add_argument("--shard", type=int, required=True, help="number of this shard")
    parser.add_argument("--out", type=Path, required=True, help="shard to write, HDF5")
    args = parser.parse_args(argv)
    spec, body = read_json(args.spec), Body.load(args.body)
    started = time.perf_counter()
    columns = synthesize(spec, body, args.shard)
    seconds = time.perf_counter() - started
    write_shard(args.out, columns, {"spec_digest": digest(spec)})
    print(f"{args.out}: {spec['pairs']} pairs, {1e3 * seconds / spec['pairs']:.3f} ms a pair")
    return 0


if __name__ == "__main__":
    sys.exit(cli.run(main))
