"""A rollout on stage: its body, its targets, its ink, what it sits on and what it sees, at any time."""

from __future__ import annotations

import mujoco
import numpy as np
from scipy.spatial.transform import Rotation

from anthro.render.camera import Camera
from anthro.render.framing import ELEVATION_DEG, azimuth_deg, framed_bones, holds_targets
from anthro.render.mesh import Mesh, join, linear_rgb, outermost, resample, sphere, tube
from anthro.render.palette import limb_muscles, shades
from anthro.render.parts import Ball, Part
from anthro.render.props import pieces
from anthro.render.raytrace import Studio
from anthro.render.rollout import QUATERNION, Rollout
from anthro.render.scene import TARGET_COLOUR, belly_radii, bones, corners, muscle_paths, muscles, root_bone
from anthro.render.sights import Sights

TARGET_RADIUS, PEN_TARGET_RADIUS = 0.022, 0.009  # m; a large ball would hide the ink
INK_COLOUR, INK_RADIUS, INK_SPACING = "#1D3FB8", 0.0028, 0.004
KEY_ASIDE_DEG, KEY_HEIGHT = 15.0, 1.3  # of the key light: from the camera's azimuth, rise over run
SEEN = 40  # instants by which a rollout is framed


class Stage:
    """Everything that is drawn of one rollout.

    Parameters
    ----------
    rollout : Rollout
    """

    def __init__(self, rollout: Rollout) -> None:
        self.rollout, self.body = rollout, rollout.body
        # A private copy: a rollout may put the root bone elsewhere.
        self._model = self.body.movable().model
        self._data = mujoco.MjData(self._model)
        self._root = root_bone(self._model)
        self._bones = {index: Part(mesh).bake() for index, mesh in bones(self._model).items()}
        self._corners = corners(self._model)
        self._radii = belly_radii(self.body.max_force)
        self._led = np.any([limb_muscles(self.body, limb) for limb in rollout.limbs], axis=0)
        self._strokes = _strokes(rollout)
        self._sights = Sights(rollout)
        upright = self._upright()
        self._move(rollout.at(rollout.time[:1]))
        self._home = self._data.xpos[self._root].copy()
        self._floor = self._floor_height(upright)
        fitted = {self._model.body(bone).name: points for bone, points in upright.items()}
        below = self._floor - self._home[2]
        self._pieces = [piece for prop in rollout.props for piece in pieces(prop, fitted, below)]

    def parts(self, time: float) -> list[Part | Ball]:
        """What is seen at a time, s; valid until the next call."""
        now = self.rollout.at(np.array([time]))
        self._move(now)
        data, model = self._data, self._model
        mujoco.mj_comPos(model, data)
        mujoco.mj_tendon(model, data)
        for bone, part in self._bones.items():
            part.place(data.xmat[bone].reshape(3, 3), data.xpos[bone])
        for piece in self._pieces:
            piece.place(data.xmat[self._root].reshape(3, 3), data.xpos[self._root], self._home)
        drawn = [*self._bones.values(), *(piece.part for piece in self._pieces)]
        if self.body.muscle_count:
            paths = muscle_paths(model, data)[: self.body.muscle_count]
            colours, glow = shades(self.body.muscle_groups, now.activation[0], self._led)
            drawn.append(Part(muscles(paths, self._radii, colours, glow)))
        drawn += self._sights.parts(now, data)
        shown = now.target[0][np.isfinite(now.target[0]).all(axis=1)]
        if len(shown) and not self._sights.has_balls:
            radius = PEN_TARGET_RADIUS if self._strokes else TARGET_RADIUS
            drawn.append(Part(join([sphere(target, radius, TARGET_COLOUR) for target in shown])))
        ink = self._ink(time)
        return [*drawn, Part(ink)] if ink else drawn

    def shot(self, width: int, height: int, azimuth: float | None = None, key_rays: int = 1) -> tuple[Camera, Studio]:
        """Camera and light that keep the moving part of the whole rollout in a picture.

        Parameters
        ----------
        width, height : int
            Pixels.
        azimuth : float, optional
            Degrees, as in `anthro.render.camera.view_direction`; by what moves if it is left out.
        key_rays : int
            As in `Studio`.
        """
        rollout = self.rollout
        if azimuth is None:
            azimuth = azimuth_deg(rollout.limbs, bool(self._strokes))
        camera = Camera.framing(self._outline(), azimuth, ELEVATION_DEG, width, height)
        key = np.deg2rad(azimuth - np.copysign(KEY_ASIDE_DEG, azimuth))
        light = np.array([np.cos(key), np.sin(key), KEY_HEIGHT])
        return camera, Studio(light, floor=self._floor, key_rays=key_rays)

    def _move(self, now: Rollout) -> None:
        if now.base is not None:
            self._model.body_pos[self._root] = now.base[0, :3]
            self._model.body_quat[self._root] = now.base[0, QUATERNION]
        self._data.qpos[:] = now.qpos[0]
        mujoco.mj_kinematics(self._model, self._data)

    def _posed(self, bone: int) -> np.ndarray:
        """Outermost points (k, 3) of one bone as it lies, m."""
        return self._corners[bone] @ self._data.xmat[bone].reshape(3, 3).T + self._data.xpos[bone]

    def _upright(self) -> dict[int, np.ndarray]:
        """Outermost points of all bones at the first instant, m, from the root bone and in its frame."""
        self._move(self.rollout.at(self.rollout.time[:1]))
        rotation, position = self._data.xmat[self._root].reshape(3, 3), self._data.xpos[self._root]
        return {bone: (self._posed(bone) - position) @ rotation for bone in self._corners}

    def _floor_height(self, upright: dict[int, np.ndarray]) -> float:
        """Under the feet of who sits, under whom the floor bears, else a little below all that moves."""
        props = self.rollout.props
        if "stool" in props or "chair" in props:
            return float(self._home[2] + min(points[:, 2].min() for points in upright.values()))
        if "floor" in props:
            return float(min(self._posed(bone)[:, 2].min() for bone in self._corners))
        return float(self._seen(set(self._corners))[:, 2].min()) - 0.05

    def _seen(self, chosen: set[int]) -> np.ndarray:
        """Points (k, 3), m, around some bones over the whole rollout."""
        start, end = self.rollout.time[[0, -1]]
        now = self.rollout.at(np.linspace(start, end, SEEN))
        points = []
        for index in range(SEEN):
            self._move(now.at(now.time[[index]]))
            points += [self._posed(bone) for bone in chosen & self._corners.keys()]
        return np.concatenate(points)

    def _outline(self) -> np.ndarray:
        """Points (k, 3), m, that the picture holds."""
        limbs, target = self.rollout.limbs, self.rollout.target
        points = [
            self._seen(framed_bones(self._model, limbs, self.rollout.props)),
            *(points for _, points in self._strokes),
            self._sights.outline(self._home, self._floor),
        ]
        if "chair" in self.rollout.props:
            points += [outermost(piece.part.mesh.vertices) + self._home for piece in self._pieces]
        if holds_targets(limbs) and not self._sights.has_balls:
            around = TARGET_RADIUS * np.concatenate([np.eye(3), -np.eye(3)])
            there = np.unique(target[np.isfinite(target).all(axis=2)], axis=0)
            points.append((there[:, None] + around).reshape(-1, 3))
        return np.concatenate(points)

    def _ink(self, time: float) -> Mesh | None:
        """What the pen has drawn so far, as thin tubes; it moves with the root bone that a demo moves."""
        colour, drawn = linear_rgb(INK_COLOUR), []
        for times, points in self._strokes:
            path = self._carried(points, times, time)[: np.searchsorted(times, time, side="right")]
            path = path[np.linalg.norm(np.diff(path, axis=0, prepend=np.inf), axis=1) > 1e-6]
            if len(path) > 1:
                smooth = resample(path, INK_SPACING)
                drawn.append(tube(smooth, np.full(len(smooth), INK_RADIUS), colour, sides=6))
        return join(drawn) if drawn else None

    def _carried(self, points: np.ndarray, times: np.ndarray, time: float) -> np.ndarray:
        """Points (m, 3), m, that were on the base at times (m,), where they are at another time; s."""
        base = self.rollout.base
        if base is None:
            return points
        then, now = (base[np.clip(np.searchsorted(self.rollout.time, t), 0, len(base) - 1)] for t in (times, time))
        local = Rotation.from_quat(then[:, QUATERNION], scalar_first=True).inv().apply(points - then[:, :3])
        return now[:3] + Rotation.from_quat(now[QUATERNION], scalar_first=True).apply(local)


def _strokes(rollout: Rollout) -> list[tuple[np.ndarray, np.ndarray]]:
    """Times (m,), s, and points (m, 3), m, of each stretch in which the pen was down."""
    pen = rollout.others.get("pen")
    if pen is None:
        return []
    down = rollout.others.get("pen_down", np.ones(len(pen))) > 0.5
    down &= np.isfinite(pen).all(axis=1)
    edges = np.flatnonzero(np.diff(np.concatenate([[False], down, [False]])))
    return [(rollout.time[a:b], pen[a:b]) for a, b in edges.reshape(-1, 2)]
