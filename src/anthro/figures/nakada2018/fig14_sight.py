"""Fig. 14: rays of the photoreceptors through the pinhole into the scene, and what each retina receives."""

import sys
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import matplotlib.pyplot as plt
import mujoco
import numpy as np

from anthro import cli, figures
from anthro.body import Body
from anthro.eyes.eye import RADIUS
from anthro.eyes.flesh import limb_bones
from anthro.eyes.layout import Layout
from anthro.eyes.scene import SKIN, Scene, sole_height
from anthro.eyes.sight import Eyes
from anthro.figures.retina import percept
from anthro.render.camera import Camera
from anthro.render.mesh import linear_rgb, tubes
from anthro.render.parts import FAR, Ball, Part
from anthro.render.raytrace import Studio, intersect, render
from anthro.render.scene import bones

SEED = 7  # the usual one of a run
SIZE = (640, 640)  # pixels of the scene
RAY_COLOUR, RAY_RADIUS = "#2E6FD0", 0.0018
EVERY = 29  # of the rays, one is drawn
LONGEST = 1.2  # m, of a ray that meets nothing
SLICE_DEG = 2.0  # of the section through the eye: rays that leave the level by less are drawn
BALLS = ((0.06, "#FFFFFF", (0.62, 0.22, -0.12)), (0.055, "#D02020", (0.60, -0.22, -0.22)))  # m, from the head
BEHIND = ("#A9B5C1", "#C6CDD4", "#BEC4CA")  # backdrop above and at the horizon, and floor, of (b)
LIT = np.array([0.9, -0.55, 1.1])  # to the light of (b), which is not that of the scene


def draw(run: Path) -> plt.Figure:
    """Draw a run's seated body and what it sees, one ball foveated."""
    body = Body.load(Path(run) / "body" / "nakada2018")
    data = mujoco.MjData(body.model)
    data.qpos[:] = body.q_rest
    mujoco.mj_kinematics(body.model, data)
    balls = [Ball(radius, colour) for radius, colour, _ in BALLS]
    scene = Scene(body.model, balls, floor=sole_height(body), stool=True)
    eyes = Eyes(body, scene, seed=SEED)
    for ball, (_, _, place) in zip(balls, BALLS, strict=True):
        ball.place(eyes.head(data)[1] + place)
    eyes.reset(eyes.aim(data, balls[1].centre))
    seen = eyes.see(data)
    figure = plt.figure(figsize=(7.0, 7.0))
    grid = figure.add_gridspec(2, 4, height_ratios=[1.05, 1.0])
    section(figure.add_subplot(grid[0, :2]), eyes.layouts[0])
    picture = figure.add_subplot(grid[0, 2:])
    picture.imshow(body_picture(body, data, eyes))
    picture.set_axis_off()
    picture.set_title("(b) Rays of both eyes")
    panels = zip((grid[1, :2], grid[1, 2:]), eyes.layouts, seen, ("left", "right"), "cd", strict=True)
    for place, retina, vector, side, letter in panels:
        percept(figure.add_subplot(place), retina, vector, f"({letter}) On the {side} retina")
    return figure


def section(axes: plt.Axes, receptors: Layout) -> None:
    """Draw a level section of an eye that looks to the right: receptors and their rays; mm."""
    level = receptors.directions[np.abs(receptors.directions[:, 2]) < np.sin(np.deg2rad(SLICE_DEG))]
    level = level[np.argsort(level[:, 1])][::3]
    pupil = 1e3 * np.array([RADIUS, 0.0])
    ways = level[:, :2] / np.linalg.norm(level[:, :2], axis=1, keepdims=True)
    places = pupil - 2e3 * RADIUS * ways[:, :1] * ways
    ends = pupil + 26 * ways
    for place, end in zip(places, ends, strict=True):
        axes.plot(*np.stack([place, end], axis=1), color=RAY_COLOUR, linewidth=0.25, alpha=0.8)
    turn = np.linspace(0, 2 * np.pi, 200)
    axes.plot(1e3 * RADIUS * np.cos(turn), 1e3 * RADIUS * np.sin(turn), color="#404040", linewidth=0.8)
    axes.scatter(*places.T, s=4, c="black", linewidths=0, zorder=3)
    axes.scatter(*pupil, s=14, c="#D55E00", linewidths=0, zorder=4)
    axes.annotate("pinhole", pupil, (14.5, -21), fontsize=7.5, arrowprops={"arrowstyle": "-", "linewidth": 0.5})
    axes.set(aspect="equal", xlim=(-15, 39), ylim=(-27, 27), xlabel="mm")
    axes.set_title("(a) Section of the left eye")


def body_picture(body: Body, data: mujoco.MjData, eyes: Eyes) -> np.ndarray:
    """A picture (height, width, 3) uint8 of the seated body, its scene and some rays of its eyes."""
    scene, limbs = eyes.scene, limb_bones(body.model, tuple(SKIN))
    trunk = [
        Part(mesh, data.xmat[bone].reshape(3, 3), data.xpos[bone]).bake()
        for bone, mesh in bones(body.model).items()
        if bone not in limbs
    ]
    origins, directions = eyes.rays(data)
    distance = intersect(scene.parts, origins, directions).distance
    floor = np.where(
        directions[:, 2] < 0, (scene.studio.floor - origins[:, 2]) / np.minimum(directions[:, 2], -1e-9), FAR
    )
    reach = np.minimum(np.minimum(distance, floor), LONGEST)[::EVERY, None]
    paths = np.stack([origins[::EVERY], origins[::EVERY] + reach * directions[::EVERY]], axis=1)
    colours = np.broadcast_to(linear_rgb(RAY_COLOUR), (len(paths), 3))
    lines = tubes(paths, np.full(paths.shape[:2], RAY_RADIUS), colours, sides=5)
    shown = [*scene.parts, *trunk, Part(replace(lines, glow=np.full(len(lines.faces), 0.6)))]
    meshes = [
        part.mesh.vertices @ part.rotation.T + part.position
        for part in (*trunk, *scene.parts)
        if isinstance(part, Part)
    ]
    points = np.concatenate([*meshes, paths[:, 1] * [1, 0.75, 1]])
    camera = Camera.framing(points, -62.0, 10.0, *SIZE, margin=0.02)
    top, horizon, floor = (linear_rgb(colour) for colour in BEHIND)
    studio = Studio(
        LIT, floor=scene.studio.floor, backdrop_top=top, backdrop_horizon=horizon, floor_colour=floor, key_rays=2
    )
    return render(shown, camera, studio)


def main(argv: Sequence[str] | None = None) -> None:
    """Run the command line."""
    figures.command(draw, argv, __doc__)


if __name__ == "__main__":
    sys.exit(cli.run(main))
