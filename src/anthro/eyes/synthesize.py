"""Synthesize one shard of a vision DNN's training pairs by ray tracing the body's own world (Nakada 2018, Sec. 6.2).

A pair of both eyes is one row: bytes of the optic nerve vectors ``left``, ``right`` (n, 10800), and the labels in each
eye's own frame. For foveation, a ball at random places in the visual field: ``left_direction``, ``right_direction``
(n, 2) theta and phi, rad. For limb vision, a red ball that the trained foveation DNNs have foveated, while the limb is
somewhere on a random way to it: ``left_offset``, ``right_offset`` (n, 3) from the limb's effector to the ball, m.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

from anthro import cli
from anthro.body import Body
from anthro.errors import UserError
from anthro.eyes.eye import SIDES
from anthro.eyes.vision import RED, Vision, gaze_command, seen_from
from anthro.eyes.witness import COLOURS, Witness
from anthro.files import digest, read_json, write_shard
from anthro.motor.network import FeedForward
from anthro.motor.senses import direction
from anthro.progress import progress
from anthro.streams import stream

TRIES = 1000  # draws for one pair


class Foveation:
    """Draws scenes for the foveation DNNs.

    Parameters
    ----------
    witness : Witness
    spec : dict
        The data set's merged spec; keys as in ``config/data/eyes_foveation.yaml``.
    rng : numpy.random.Generator
    """

    label = "direction"

    def __init__(self, witness: Witness, spec: dict, rng: np.random.Generator):
        self.witness, self.spec, self.rng = witness, spec, rng

    def draw(self) -> np.ndarray | None:
        """Pose the body, its eyes and the ball: labels (2, 2), rad; None where the ball can hardly be seen."""
        witness, spec, rng = self.witness, self.spec, self.rng
        witness.show(COLOURS[rng.integers(len(COLOURS))])
        witness.pose(spec["posture_share"], rng)
        gaze = np.deg2rad(rng.uniform(*np.transpose(spec["gaze_deg"])))
        looked_at = _log_uniform(spec["distance"], rng) * direction(*gaze)
        angles = [eye.angles_to(looked_at) for eye in witness.eyes.eyes]
        witness.eyes.reset(angles + np.deg2rad(rng.normal(0.0, spec["gaze_spread_deg"], (2, 2))))
        aside = np.deg2rad(spec["field_deg"]) * rng.uniform(-1.0, 1.0, 2)
        if rng.random() < spec["near_share"]:
            aside *= rng.random() ** 3
        eye = witness.eyes.eyes[0]
        point = _log_uniform(spec["distance"], rng) * direction(*gaze_command(eye, gaze, aside))
        witness.ball.place(witness.in_world(point))
        if witness.on_ball().min() < spec["least_receptors"]:
            return None
        return np.array([seen_from(*pair, point) for pair in zip(witness.eyes.eyes, witness.eyes.angles, strict=True)])


class LimbVision:
    """Draws scenes for a limb's vision DNNs; parameters as of `Foveation`, and the eyes' trained DNNs."""

    label = "offset"

    def __init__(self, witness: Witness, spec: dict, rng: np.random.Generator, vision: Vision):
        self.witness, self.spec, self.rng, self.vision = witness, spec, rng, vision
        self.limb = witness.limbs[spec["limb"]]
        witness.show(RED)

    def draw(self) -> np.ndarray | None:
        """Pose body and ball, let the eyes foveate it: labels (2, 3), m; None where the ball can hardly be seen."""
        witness, spec, rng = self.witness, self.spec, self.rng
        end = self.limb.random_pose(spec["target_share"], rng)
        witness.pose(spec["posture_share"], rng, **{self.limb.name: end})
        target = witness.data.site_xpos[self.limb.site].copy()
        if rng.random() < spec["far_share"]:
            way = target - witness.in_world(np.zeros(3))
            target += way / np.linalg.norm(way) * _log_uniform(spec["further"], rng)
        aim = witness.eyes.aim(witness.data, target)
        if not witness.within(aim):
            return None
        start = self.limb.random_pose(spec["posture_share"], rng)
        if rng.random() < spec["rest_share"]:
            start = witness.body.q_rest[self.limb.driven]
        reaching = self.limb.near(end + rng.random() ** 2 * (start - end), spec["pose_spread"], rng)
        witness.put(self.limb.with_angles(witness.q, reaching))
        witness.ball.place(target)
        witness.eyes.reset(aim + np.deg2rad(rng.normal(0.0, spec["gaze_spread_deg"], (2, 2))))
        for _ in range(spec["looks"]):
            self._foveate()
        if witness.on_ball().min() < spec["least_receptors"]:
            return None
        rotation, _ = witness.eyes.head(witness.data)
        offset = (target - witness.data.site_xpos[self.limb.site]) @ rotation
        return np.array(
            [offset @ eye.rotation(pair) for eye, pair in zip(witness.eyes.eyes, witness.eyes.angles, strict=True)]
        )

    def _foveate(self) -> None:
        """Turn the eyes once to where their DNNs say that the ball is."""
        eyes, told = self.witness.eyes, self.vision.discrepancy(self.witness.look())
        eyes.reset([gaze_command(*each) for each in zip(eyes.eyes, eyes.angles, told, strict=True)])


def _log_uniform(bounds, rng: np.random.Generator) -> float:
    return float(np.exp(rng.uniform(*np.log(bounds))))


def synthesize(draw: Callable[[], np.ndarray | None], witness: Witness, label: str, count: int) -> tuple[dict, dict]:
    """Columns of one shard, and how many scenes were drawn.

    Raises
    ------
    UserError
        When hardly any scene shows the ball.
    """
    columns: dict[str, np.ndarray] = {}
    drawn = 0
    for row in progress(range(count), count, "pairs"):
        for _ in range(TRIES):
            drawn += 1
            if (labels := draw()) is not None:
                break
        else:
            raise UserError(f"the ball was not seen in any of {TRIES} scenes: see the data set's distances and angles")
        seen = witness.look()
        if not columns:
            columns = {side: np.empty((count, seen.shape[1]), np.uint8) for side in SIDES}
            columns |= {f"{side}_{label}": np.empty((count, labels.shape[1]), np.float32) for side in SIDES}
        for side, vector, value in zip(SIDES, seen, labels, strict=True):
            columns[side][row], columns[f"{side}_{label}"][row] = vector, value
    return columns, {"scenes_drawn": drawn}


def main(argv=None) -> int:
    """Write one shard."""
    parser = argparse.ArgumentParser(prog="anthro.eyes.synthesize", description=__doc__.partition("\n")[0])
    parser.add_argument("--spec", type=Path, required=True, help="merged spec of the data set, JSON")
    parser.add_argument("--body", type=Path, required=True, help="folder of the built body")
    parser.add_argument("--shard", type=int, required=True, help="number of this shard")
    parser.add_argument("--foveation", type=Path, nargs=2, help="weights of the left and right eye's foveation DNN")
    parser.add_argument("--out", type=Path, required=True, help="shard to write, HDF5")
    args = parser.parse_args(argv)
    spec = read_json(args.spec)
    witness = Witness(Body.load(args.body), spec["limbs"], spec["retina"], spec["seed"])
    rng = stream(spec["seed"], f"{spec['name']}.pairs", args.shard)
    if "limb" not in spec:
        source = Foveation(witness, spec, rng)
    elif args.foveation is None:
        raise UserError("--foveation: limb vision needs eyes that foveate")
    else:
        vision = Vision([FeedForward.load(path, outputs=2) for path in args.foveation])
        source = LimbVision(witness, spec, rng, vision)
    started = time.perf_counter()
    columns, report = synthesize(source.draw, witness, source.label, spec["pairs"])
    seconds = time.perf_counter() - started
    write_shard(args.out, columns, {"spec_digest": digest(spec), **report})
    print(f"{args.out}: {spec['pairs']} pairs, {1e3 * seconds / spec['pairs']:.3f} ms a pair, {report}")
    return 0


if __name__ == "__main__":
    sys.exit(cli.run(main))
