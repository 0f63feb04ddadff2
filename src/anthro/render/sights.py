"""Eyes, the lines of their gaze, balls and slopes of a rollout that recorded them."""

from __future__ import annotations

import json
from dataclasses import replace

import mujoco
import numpy as np

from anthro.eyes.eye import RADIUS, SIDES, Eye
from anthro.eyes.vision import BALL_RADIUS, RED
from anthro.render.mesh import Mesh, linear_rgb, move, tubes
from anthro.render.parts import Ball, Part
from anthro.render.rollout import Rollout
from anthro.render.solids import box
from anthro.world.surfaces import Slope

SCLERA, IRIS, GAZE_COLOUR, SLOPE_COLOUR = "#FFFFFF", "#2B3A55", "#D0021B", "#9CB4C4"
IRIS_RADIUS, IRIS_FORWARD = 0.0068, 0.0068  # m: what stands out of the eye's ball is 11 mm wide
GAZE_RADIUS = 0.004  # m
GAZE_LENGTH = 1.0  # m, where there is no ball
SLOPE_THICKNESS, SLOPE_EDGE = 0.024, 0.006  # m
NEAR = 1.5  # m from the root bone: a ball's course within it is framed


class Sights:
    """What a rollout's body looks with and at.

    Parameters
    ----------
    rollout : Rollout
        Its columns ``eyes`` (T, 2, 2), rad, and ``ball`` (T, n, 3), m, are drawn where they are there, and so are the
        balls' ``ball_radius``, m, and ``ball_colour``, and ``slopes``, of its attributes.
    """

    def __init__(self, rollout: Rollout) -> None:
        attrs = rollout.attrs
        self._sees = "eyes" in rollout.others
        self._site = rollout.body.effector("head") if self._sees else -1
        self._path = np.asarray(rollout.others.get("ball", np.empty((len(rollout.time), 0, 3))), float)
        radius, colour = float(attrs.get("ball_radius", BALL_RADIUS)), str(attrs.get("ball_colour", RED))
        self._balls = [Ball(radius, colour) for _ in range(self._path.shape[1])]
        self.slopes = [Slope(**told) for told in json.loads(attrs.get("slopes", "[]"))]
        self._slopes = [Part(slope_mesh(slope)) for slope in self.slopes]
        self._eyes = [Ball(RADIUS, SCLERA) for _ in SIDES], [Ball(IRIS_RADIUS, IRIS) for _ in SIDES]

    @property
    def has_balls(self) -> bool:
        """Whether balls are shown; they are the targets then."""
        return bool(self._balls)

    def parts(self, now: Rollout, data: mujoco.MjData) -> list[Part | Ball]:
        """What is seen of them at a rollout's only instant, the body as in `data`; valid until the next call."""
        there = now.others["ball"][0] if self._balls else np.empty((0, 3))
        shown = np.isfinite(there).all(axis=1)
        balls = [ball.place(place) for ball, place, seen in zip(self._balls, there, shown, strict=True) if seen]
        return [*self._slopes, *balls, *(self._looks(now.others["eyes"][0], there[shown], data) if self._sees else [])]

    def outline(self, root: np.ndarray, floor: float) -> np.ndarray:
        """Points (k, 3), m, that a picture holds: slopes, and balls above the floor, over them or near the root bone.

        Balls fall through a floor that their demo does not have.
        """
        path = self._path[np.isfinite(self._path).all(axis=2)]
        path = path[path[:, 2] > floor]
        held = np.linalg.norm(path - root, axis=1) < NEAR
        corners = [part.mesh.vertices.astype(float) for part in self._slopes]
        if corners:
            slopes = np.concatenate(corners)
            low, high = slopes.min(axis=0)[:2], slopes.max(axis=0)[:2]
            held |= ((path[:, :2] >= low) & (path[:, :2] <= high)).all(axis=1)
        return np.concatenate([*corners, path[held]])

    def _looks(self, angles: np.ndarray, balls: np.ndarray, data: mujoco.MjData) -> list[Part | Ball]:
        """Both eyes at angles (2, 2), rad, and lines of gaze as long as the way to the nearest of balls (n, 3), m."""
        rotation, position = data.site_xmat[self._site].reshape(3, 3), data.site_xpos[self._site]
        starts, ways = np.empty((2, 3)), np.empty((2, 3))
        for index, (side, pair) in enumerate(zip(SIDES, angles, strict=True)):
            eye = Eye(side)
            starts[index], ways[index] = position + rotation @ eye.centre, rotation @ eye.rotation(pair)[:, 0]
            for ball, forward in zip((found[index] for found in self._eyes), (0.0, IRIS_FORWARD), strict=True):
                ball.place(starts[index] + forward * ways[index])
        away = np.linalg.norm(balls - starts.mean(axis=0), axis=1)
        ends = starts + (away.min() if len(away) else GAZE_LENGTH) * ways
        paths = np.stack([starts + RADIUS * ways, ends], axis=1)
        lines = tubes(paths, np.full((2, 2), GAZE_RADIUS), np.tile(linear_rgb(GAZE_COLOUR), (2, 1)), sides=6)
        return [*self._eyes[0], *self._eyes[1], Part(replace(lines, glow=np.full(len(lines.faces), 0.7)))]


def slope_mesh(slope: Slope) -> Mesh:
    """A board whose upper face is the slope, m, in the world."""
    along, across = slope.half_size
    size = (2 * along, 2 * across, SLOPE_THICKNESS)
    board = box((0.0, 0.0, -SLOPE_THICKNESS / 2), size, SLOPE_EDGE, SLOPE_COLOUR)
    return move(board, slope.axes.T, np.asarray(slope.centre, float))
