"""How fast two eyes see, on one core: with parts that are only placed anew, and with one scene rebuilt a frame.

``python -m anthro.eyes.benchmark --run results/laptop --json --out DIR``

Both take turns on the same frames: a seated body that moves its limbs a little, and two balls that fly by before it,
with arms, legs and balls in view. Time is processor time, which is clock time for one thread on an idle core, and is
disturbed less by other work on the machine.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from collections.abc import Callable, Sequence
from contextlib import nullcontext
from dataclasses import dataclass
from pathlib import Path

import mujoco
import numpy as np

from anthro import cli
from anthro.body import Body
from anthro.body.benchmark import one_core
from anthro.errors import UserError
from anthro.eyes.scene import Scene, sole_height
from anthro.eyes.sight import Eyes, nerve
from anthro.files import write_json
from anthro.progress import progress
from anthro.render.mesh import join, move, sphere
from anthro.render.parts import Ball, Part
from anthro.render.raytrace import intersect, shade
from anthro.runcard import RunCard
from anthro.streams import stream

BODY = "nakada2018"
BAR = 5e-3  # s a frame of both eyes
BALLS = ((0.05, "#FFFFFF"), (0.06, "#D02020"))  # radii, m, and colours
PATHS = np.array([[0.55, 0.15, 0.35], [0.75, -0.2, 0.15]])  # m, of the balls' middles from the head, which is above
LOOK = np.deg2rad(-35.0)  # phi: down at hands and knees
SWING = 0.15  # rad, greatest change of a joint
WARM = 5  # frames


@dataclass
class World:
    """One body, two balls and the eyes that look at them."""

    body: Body
    eyes: Eyes
    data: mujoco.MjData
    balls: list[Ball]

    @classmethod
    def of(cls, body: Body, seed: int) -> World:
        """The world before its first frame."""
        balls = [Ball(*ball) for ball in BALLS]
        scene = Scene(body.model, balls, floor=sole_height(body), stool=True)
        eyes = Eyes(body, scene, seed=seed)
        eyes.reset(np.array([[0.0, LOOK], [0.0, LOOK]]))
        return cls(body, eyes, mujoco.MjData(body.model), balls)

    def move(self, frame: int, rng: np.random.Generator) -> None:
        """Pose the body and place the balls for a frame."""
        joints = slice(self.body.model.nq - self.body.dof_count, None)
        self.data.qpos[:] = self.body.q_rest
        self.data.qpos[joints] += rng.uniform(-SWING, SWING, self.body.dof_count)
        low, high = self.body.q_range.T
        self.data.qpos[joints] = np.clip(self.data.qpos[joints], low, high)
        mujoco.mj_kinematics(self.body.model, self.data)
        _, head = self.eyes.head(self.data)
        for ball, place in zip(self.balls, PATHS, strict=True):
            ball.place(head + place * [1, 1, -1] + 0.05 * np.sin(0.1 * frame + place))

    def rebuilt(self) -> np.ndarray:
        """The optic nerve vectors by one scene of all surfaces, built for this frame alone."""
        scene = self.eyes.scene.place(self.data)
        meshes = [move(p.mesh, p.rotation, p.position) for p in scene.parts if isinstance(p, Part)]
        meshes += [sphere(ball.centre, *told) for ball, told in zip(self.balls, BALLS, strict=True)]
        colours = shade([Part(join(meshes))], scene.studio, *self.eyes.rays(self.data))
        return nerve(colours.reshape(2, -1, 3))

    def in_view(self) -> dict[str, int]:
        """Receptors of both eyes that see arms, legs and balls."""
        scene = self.eyes.scene.place(self.data)
        part = intersect(scene.parts, *self.eyes.rays(self.data)).part
        counts = {"balls": np.isin(part, np.arange(len(scene.parts))[-len(self.balls) :]).sum()}
        for name, bones in (("arms", ("humerus", "ulna", "radius", "lunate")), ("legs", ("femur", "tibia", "patella"))):
            rows = [k for k, bone in enumerate(scene.limb_names) if bone.startswith(bones)]
            counts[name] = np.isin(part, rows).sum()
        return {name: int(count) for name, count in counts.items()}


def seconds_of(call: Callable[[], object]) -> float:
    """Processor time of a call, s."""
    started = time.process_time()
    call()
    return time.process_time() - started


def measure(body: Body, frames: int, seed: int) -> dict:
    """Seconds a frame of both ways, rays a second, and what was in view in the frame with the least of it."""
    world, rng = World.of(body, seed), stream(seed, "eyes.benchmark")
    ways = {"placed": lambda: world.eyes.see(world.data), "rebuilt": world.rebuilt}
    times: dict[str, list[float]] = {way: [] for way in ways}
    views = []
    for frame in progress(range(-WARM, frames), frames + WARM, "frames"):
        world.move(frame, rng)
        for way, call in ways.items():
            spent = seconds_of(call)
            if frame >= 0:
                times[way].append(spent)
        views.append(world.in_view())
    rays = len(world.eyes.rays(world.data)[0])
    found = {f"{way}_frame_s": float(np.median(spent)) for way, spent in times.items()}
    found["placed_frame_95_s"] = float(np.percentile(times["placed"], 95))
    found |= {f"{way}_rays_per_s": rays / found[f"{way}_frame_s"] for way in ways}
    found["placed_over_rebuilt"] = found["placed_rays_per_s"] / found["rebuilt_rays_per_s"]
    found |= {"rays": rays, "frames": frames, "triangles": world.eyes.scene.triangles}
    return found | {f"least_receptors_on_{name}": min(view[name] for view in views) for name in views[0]}


def rows_of(found: dict) -> list[dict]:
    """Scorecard rows: a frame against its bar, rays a second against those with a rebuilt scene."""
    told = {
        "placed_frame_s": ("s", BAR, "max"),
        "placed_frame_95_s": ("s", BAR, "max"),
        "rebuilt_frame_s": ("s", None, "info"),
        "placed_rays_per_s": ("1/s", None, "info"),
        "rebuilt_rays_per_s": ("1/s", None, "info"),
        "placed_over_rebuilt": ("1", 1.0, "min"),
    }
    return [
        {
            "paper": "nakada2018",
            "item": "both eyes, one core",
            "metric": metric,
            "value": found[metric],
            "unit": unit,
            "target": target,
            "sense": sense,
            "source": "project",
        }
        for metric, (unit, target, sense) in told.items()
    ]


def main(argv: Sequence[str] | None = None) -> int:
    """Measure, print and write rows, metrics and run card."""
    parser = argparse.ArgumentParser(prog="anthro.eyes.benchmark", description=__doc__.partition("\n")[0])
    parser.add_argument("--run", type=Path, required=True, help="folder of the run, results/<run>")
    parser.add_argument("--frames", type=int, default=100, help="frames (default 100)")
    parser.add_argument("--seed", type=int, default=7, help="seed of receptors and postures (default 7)")
    parser.add_argument("--json", action="store_true", help="print the metrics as JSON")
    parser.add_argument("--out", type=Path, help="folder for metrics, rows and run card")
    args = parser.parse_args(argv)
    if args.frames < 1:
        raise UserError(f"--frames: {args.frames} is not a positive number")
    body = Body.load(args.run / "body" / BODY)
    spec = {"benchmark": "eyes", "body": BODY, "frames": args.frames}
    with RunCard(args.out / "run_card.json", spec, args.seed) if args.out else nullcontext() as card:
        found = measure(body, args.frames, args.seed)
        if args.out:
            write_json(args.out / "metrics.json", found)
            write_json(args.out / "rows.json", rows_of(found))
            card.note(metrics=found)
    if args.json:
        print(json.dumps(found, indent=1, sort_keys=True))
    else:
        print("\n".join(f"{name} = {value:g}" for name, value in found.items()))
    return 0


if __name__ == "__main__":
    one_core("anthro.eyes.benchmark")
    sys.exit(cli.run(main))
