"""Every joint of the right side and the midline at both ends of its range and in neutral."""

import sys
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import matplotlib.pyplot as plt
import mujoco
import numpy as np

from anthro import cli, figures
from anthro.body import Body
from anthro.render.camera import Camera
from anthro.render.mesh import Mesh, join, linear_rgb, move, resample, tube
from anthro.render.parts import Part
from anthro.render.raytrace import Studio, render
from anthro.render.scene import BONE_COLOUR, geom_mesh, mesh_geoms, muscle_paths

MOVING_COLOUR, MUSCLE_COLOUR, INK = "#3F86C4", "#B03A30", "#20262C"
PIXELS, HEAD, FOOT, GAP, ACROSS = 100, 16, 14, 10, 4  # a joint is three pictures; four joints a row
DPI = 100
# The camera stands on this side of a hinge's axis, no steeper than this above it.
SIDE, STEEPEST_DEG = np.array([0.5, -1.0, 0.4]), 50.0
LEAST_STRETCH = 5e-4  # m, of a right muscle that is drawn with a joint
WHITE = linear_rgb("#FFFFFF")


class Sweeper:
    """Pictures of one joint after the other.

    Parameters
    ----------
    body : Body
    """

    def __init__(self, body: Body) -> None:
        self.body, self.model = body, body.model
        self._data = mujoco.MjData(body.model)
        self._meshes, self._exposure = {}, {}
        for geom in mesh_geoms(self.model):
            bone = int(self.model.geom_bodyid[geom])
            self._meshes[bone] = (geom, geom_mesh(self.model, geom, BONE_COLOUR))
            self._exposure[bone] = Part(self._meshes[bone][1]).bake(16).exposure

    def sweep(self, name: str, angles: Sequence[float]) -> list[np.ndarray]:
        """Pictures (PIXELS, PIXELS, 3) uint8 of the joint at each of the angles, rad, all else in neutral."""
        joint = self.model.joint(name)
        bone = int(joint.bodyid[0])
        moving, still = self._below(bone, 1), self._above(bone)
        framed = {*moving, int(self.model.body_parentid[bone])}
        stretched = self._stretched(int(joint.qposadr[0]), angles)
        scenes, points = [], []
        for angle in angles:
            self._place(int(joint.qposadr[0]), angle)
            posed = {b: self._posed(b, MOVING_COLOUR if b in moving else BONE_COLOUR) for b in [*moving, *still]}
            points += [posed[b].vertices for b in framed if b in posed]
            scenes.append((posed, self._tendons(stretched)))
        self._place(int(joint.qposadr[0]), 0.0)
        camera = self._camera(self._data.xaxis[joint.id], np.concatenate(points))
        reach = np.ptp(np.concatenate(points), axis=0).max()
        return [self._picture(posed, tendons, camera, reach) for posed, tendons in scenes]

    def _place(self, address: int, angle: float) -> None:
        data = self._data
        data.qpos[:] = self.model.qpos0
        data.qpos[address] = angle
        mujoco.mj_kinematics(self.model, data)
        mujoco.mj_comPos(self.model, data)
        mujoco.mj_tendon(self.model, data)

    def _below(self, bone: int, joints: int) -> list[int]:
        """The bone and those that hang on it with at most so many joints between."""
        found = [bone]
        for child in np.flatnonzero(self.model.body_parentid == bone):
            left = joints - (self.model.body_jntnum[child] > 0)
            if left >= 0:
                found += self._below(int(child), left)
        return [b for b in found if b in self._meshes]

    def _above(self, bone: int) -> list[int]:
        """The next two bones towards the root, and those of its side that move with the next one."""
        parents = self.model.body_parentid
        parent = int(parents[bone])
        side = self.model.body(bone).name[-2:]
        near = [b for b in self._below(parent, 0) if b != parent and self.model.body(b).name.endswith(side)]
        return [b for b in dict.fromkeys([parent, *near, int(parents[parent])]) if b in self._meshes]

    def _stretched(self, address: int, angles: Sequence[float]) -> np.ndarray:
        lengths = []
        for angle in angles:
            self._place(address, angle)
            lengths.append(self._data.ten_length[: self.body.muscle_count].copy())
        right = np.array([not name.endswith("_l") for name in self.body.muscle_names], bool)
        return np.flatnonzero(right & (np.ptp(lengths, axis=0) > LEAST_STRETCH))

    def _posed(self, bone: int, colour: str) -> Mesh:
        geom, mesh = self._meshes[bone]
        placed = move(mesh, self._data.geom_xmat[geom].reshape(3, 3), self._data.geom_xpos[geom])
        return replace(placed, colours=np.broadcast_to(linear_rgb(colour), placed.colours.shape))

    def _tendons(self, muscles: np.ndarray) -> list[np.ndarray]:
        paths = muscle_paths(self.model, self._data)
        return [paths[i] for i in muscles]

    def _camera(self, axis: np.ndarray, points: np.ndarray) -> Camera:
        axis = axis * (1.0 if axis @ SIDE > 0 else -1.0)
        azimuth = np.rad2deg(np.arctan2(axis[1], axis[0])) if np.hypot(*axis[:2]) > 0.2 else -35.0
        elevation = np.clip(np.rad2deg(np.arcsin(np.clip(axis[2], -1, 1))), -STEEPEST_DEG, STEEPEST_DEG)
        return Camera.framing(points, azimuth, elevation, PIXELS, PIXELS, fov_deg=14.0, margin=0.04)

    def _picture(self, posed: dict[int, Mesh], tendons: list[np.ndarray], camera: Camera, reach: float) -> np.ndarray:
        thin, colour = 0.006 * reach, linear_rgb(MUSCLE_COLOUR)
        paths = [resample(path, 0.02) for path in tendons]
        tubes = [tube(path, np.full(len(path), thin), colour, sides=5) for path in paths]
        part = Part(replace(join([*posed.values(), *tubes]), gloss=0.0))
        baked = np.concatenate([self._exposure[bone] for bone in posed])
        part.exposure[: len(baked)] = baked
        right, up, forward = camera.axes
        key = -forward - 0.6 * right + 0.8 * up
        studio = Studio(key, key=0.6, sky=0.62, backdrop_top=WHITE, backdrop_horizon=WHITE)
        return render([part], camera, studio, samples=2)


def swept_joints(body: Body) -> list[tuple[str, np.ndarray]]:
    """Names and three angles (3,), rad, of the joints that have no twin on the right."""
    return [
        (name, np.array([low, np.clip(0.0, low, high), high]))
        for name, (low, high) in zip(body.dof_names, body.q_range, strict=True)
        if not name.endswith("_l")
    ]


def draw(run: Path) -> plt.Figure:
    """Draw the sheet of a run's whole body."""
    body = Body.load(Path(run) / "body" / "zhou2021")
    sweeper, joints = Sweeper(body), swept_joints(body)
    rows = -(-len(joints) // ACROSS)
    cell = np.array([HEAD + PIXELS + FOOT + GAP, 3 * PIXELS + GAP])
    sheet = np.full((*(cell * [rows, ACROSS] + GAP), 3), 255, np.uint8)
    tall, wide = sheet.shape[:2]
    plt.rcParams["savefig.dpi"] = DPI
    figure = plt.figure(figsize=(wide / DPI, tall / DPI), layout="none")
    for index, (name, angles) in enumerate(joints):
        top, left = GAP + cell * np.divmod(index, ACROSS)
        for column, image in enumerate(sweeper.sweep(name, angles)):
            x = left + column * PIXELS
            sheet[top + HEAD : top + HEAD + PIXELS, x : x + PIXELS] = image
            told = f"{np.rad2deg(angles[column]):.4g}°"
            below = 1 - (top + HEAD + PIXELS + FOOT / 2) / tall
            figure.text((x + PIXELS / 2) / wide, below, told, ha="center", va="center", size=7, color=INK)
        figure.text(left / wide, 1 - (top + HEAD / 2) / tall, name, va="center", size=8, weight="bold", color=INK)
    axes = figure.add_axes([0, 0, 1, 1], zorder=-1)
    axes.imshow(sheet, interpolation="none")
    axes.set_axis_off()
    return figure


def main(argv: Sequence[str] | None = None) -> None:
    """Run the command line."""
    figures.command(draw, argv, __doc__)


if __name__ == "__main__":
    sys.exit(cli.run(main))
