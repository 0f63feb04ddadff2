"""Synthesize one shard of reflex training pairs, [de, de'] -> da_r (Nakada 2018, Eq. 4 to 6).

The limb wanders between random poses: the threshold of the stretch reflex moves from one pose's to
the next, pushes strike its effector, and each control step gives one pair.
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
from anthro.motor.limb import Limb, limb_plan
from anthro.motor.others import Company, Others
from anthro.motor.reflex import STRAIN_GAIN, accumulate, activation, reflex_adjustment
from anthro.motor.teacher import Gains, StaticPosture
from anthro.progress import progress
from anthro.streams import stream

COLUMNS = ("strain_change", "strain_rate_change", "reflex")


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


def wander(spec: dict, limb: Limb, rng: np.random.Generator):
    """Yield (strain change, strain rate change), (n,) and (n,) 1/s, for ever."""
    regimen, statics = wander_regimen(spec["rollout"]), StaticPosture(limb, Gains(**spec["teacher"]))
    others = Others(limb, spec.get("others") and Company(**spec["others"]), rng)
    simulator = limb.body.simulator(DEFAULT_STEP)

    def holding(elsewhere):
        """Drive, threshold and pose of a random posture of the limb."""
        q = limb.with_angles(elsewhere, limb.random_pose(regimen.pose_share, rng))
        drive, strain, _ = statics.drive(q)
        return drive, drive - STRAIN_GAIN * strain, q

    drive, threshold, q = holding(others.pose())
    simulator.reset(statics.place(q))
    others.begin(simulator)
    while True:
        _, goal, _ = holding(simulator.joint_angles)
        steps = round(rng.uniform(*regimen.travel_seconds) / simulator.step_seconds)
        push = rng.normal(0.0, regimen.push_force, 3) * (rng.random() < regimen.push_probability)
        push_steps = round(regimen.push_seconds / simulator.step_seconds)
        for step in range(2 * steps):
            travel = (goal - threshold) / steps if step < steps else 0.0
            simulator.push(push if step < push_steps else (0.0, 0.0, 0.0), limb.plan.effector)
            before, rate_before = limb.strains(simulator)
            simulator.step(limb.into(others.activation(simulator), activation(drive)))
            strain, rate = limb.strains(simulator)
            change, rate_change = strain - before, rate - rate_before
            drive = accumulate(drive, travel, reflex_adjustment(change, rate_change))
            yield change, rate_change
            if limb.plan.side == "both":
                yield change[limb.twins], rate_change[limb.twins]
        threshold = goal


def synthesize(spec: dict, limb: Limb, shard: int) -> dict[str, np.ndarray]:
    """Columns of one shard: strain_change, strain_rate_change, reflex, each (n, muscles) float32."""
    rng = stream(spec["seed"], f"{limb.name}_reflex", shard)
    count = spec["pairs"]
    columns = {name: np.empty((count, limb.size), np.float32) for name in COLUMNS}
    for row, pair in progress(zip(range(count), wander(spec, limb, rng), strict=False), count, "pairs"):
        for name, value in zip(COLUMNS, (*pair, reflex_adjustment(*pair)), strict=True):
            columns[name][row] = value
    return columns


def main(argv=None) -> int:
    parser = argparse.ArgumentParser(prog="anthro.motor.synthesize_reflex", description=__doc__)
    parser.add_argument("--spec", type=Path, required=True, help="merged spec of the data set, JSON")
    parser.add_argument("--body", type=Path, required=True, help="folder of the built body")
    parser.add_argument("--shard", type=int, required=True, help="number of this shard")
    parser.add_argument("--out", type=Path, required=True, help="shard to write, HDF5")
    args = parser.parse_args(argv)
    spec = read_json(args.spec)
    limb = Limb(limb_plan(spec["limb"]), Body.load(args.body))
    started = time.perf_counter()
    columns = synthesize(spec, limb, args.shard)
    seconds = time.perf_counter() - started
    write_shard(args.out, columns, {"spec_digest": digest(spec)})
    print(f"{args.out}: {spec['pairs']} pairs, {1e3 * seconds / spec['pairs']:.3f} ms a pair")
    return 0


if __name__ == "__main__":
    sys.exit(cli.run(main))
