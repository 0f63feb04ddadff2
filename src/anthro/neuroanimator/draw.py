"""Pictures of the plants: each is drawn in one colour into matplotlib axes, from a state in its own variables."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.colors import to_rgb
from matplotlib.patches import Circle, Polygon

from anthro.neuroanimator.frames import rotation
from anthro.neuroanimator.plants import lander, truck
from anthro.neuroanimator.plants.dolphin import NODES, Dolphin
from anthro.neuroanimator.plants.pendulum import Pendulum, points_of

PLANT, EMULATOR, GOAL, INK = "#5B6C7D", "#8E44AD", "#2E9E4F", "#404040"  # the emulator is purple, the goal green
LIGHT = np.array([0.3, -0.5, 0.8]) / np.linalg.norm([0.3, -0.5, 0.8])
DARKEST = 0.45  # share of its colour that a face turned away from the light keeps


@dataclass(frozen=True)
class View:
    """A parallel projection from the direction of an azimuth and an elevation (rad)."""

    azimuth: float
    elevation: float

    def project(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return places on the picture (..., 2), right and up, and depth (...,), nearer being larger."""
        c, s = np.cos(self.azimuth), np.sin(self.azimuth)
        e, f = np.cos(self.elevation), np.sin(self.elevation)
        right, toward, up = np.array([-s, c, 0.0]), np.array([e * c, e * s, f]), np.array([-f * c, -f * s, e])
        return np.stack([points @ right, points @ up], axis=-1), points @ toward


ASLANT = View(-1.2, 0.25)
BESIDE = View(-1.35, 0.3)
GROUND = ((-14, -60), (-14, 60), (14, 60), (14, -60))  # m towards the eye and to the right: the strip that is drawn


def pendulum(axes: Axes, plant: Pendulum, state: np.ndarray, colour: str, alpha: float = 1.0) -> None:
    """Links and joints, seen from the side."""
    points = points_of(state)
    axes.plot(*points.T, color=colour, alpha=alpha, linewidth=5, solid_capstyle="round", zorder=3)
    for point in points[:-1]:
        axes.add_patch(Circle(point, 0.07, color=INK, alpha=alpha, zorder=4, linewidth=0))


def _box(x: float, y: float, heading: float, length: float, width: float) -> np.ndarray:
    corners = 0.5 * np.array([[length, width], [-length, width], [-length, -width], [length, -width]])
    c, s = np.cos(heading), np.sin(heading)
    return corners @ np.array([[c, s], [-s, c]]) + [x, y]


def drive(axes: Axes, plant, state: np.ndarray, colour: str, alpha: float = 1.0, steer: float = 0.0) -> None:
    """The truck from above: bed, cab, wheels."""
    x, y, heading = state[:3]
    ahead, left = np.array([np.cos(heading), np.sin(heading)]), np.array([-np.sin(heading), np.cos(heading)])
    for axle, angle in ((truck.REAR, 0.0), (truck.FRONT, steer)):
        for side in (-0.85, 0.85):
            place = np.array([x, y]) + axle * ahead + side * left
            axes.add_patch(Polygon(_box(*place, heading + angle, 0.8, 0.28), color=INK, alpha=alpha, linewidth=0))
    axes.add_patch(Polygon(_box(x, y, heading, *truck.SIZE), color=colour, alpha=alpha, linewidth=0))
    cab = np.array([x, y]) + 1.3 * ahead
    axes.add_patch(Polygon(_box(*cab, heading, 1.1, 1.5), color="white", alpha=0.7 * alpha, linewidth=0))


def _solid(axes: Axes, points: np.ndarray, faces, colour: str, alpha: float, view: View) -> None:
    """Convex faces, the farther first, shaded by where they are turned."""
    places, depth = view.project(points)
    order = sorted(faces, key=lambda face: depth[list(face)].mean())
    shades = []
    for face in order:
        a, b, c = (points[face[k]] for k in range(3))
        normal = np.cross(b - a, c - a)
        lit = 0.5 + 0.5 * float(normal @ LIGHT) / max(1e-12, float(np.linalg.norm(normal)))
        shades.append((*(np.array(to_rgb(colour)) * (DARKEST + (1 - DARKEST) * lit)), alpha))
    axes.add_collection(
        PolyCollection([places[list(face)] for face in order], facecolors=shades, linewidths=0, zorder=3)
    )


def land(axes: Axes, plant, state: np.ndarray, colour: str, alpha: float = 1.0, rocket: float = 0.0) -> None:
    """The lander: body, four legs, and the flame of its rocket."""
    turn, half, top, bottom = np.empty((3, 3)), lander.SIDE / 2, 1.2, -0.8
    rotation(state[3:7] / np.linalg.norm(state[3:7]), turn)
    ring = half * np.array([[np.cos(a), np.sin(a)] for a in np.pi / 8 + np.pi / 4 * np.arange(8)])
    body = np.array([[*p, z] for z, size in ((bottom, 1.0), (0.4, 1.0), (top, 0.5)) for p in size * ring])
    faces = [
        (8 * k + i, 8 * k + (i + 1) % 8, 8 * k + 8 + (i + 1) % 8, 8 * k + 8 + i) for k in range(2) for i in range(8)
    ]
    faces += [tuple(range(16, 24)), tuple(range(7, -1, -1))]
    lines = [
        ([x, y, bottom], [2.1 * x, 2.1 * y, -lander.HEIGHT])
        for x, y in 0.8 * half * np.array([[1, 1], [-1, 1], [-1, -1], [1, -1]])
    ]
    flame = ([0, 0, bottom], [0, 0, bottom - 2.0 * rocket])
    for ends, width, paint in [*((line, 1.6, INK) for line in lines), (flame, 4.0 * rocket, "#E69F00")]:
        places, _ = ASLANT.project(np.array(ends, float) @ turn.T + state[:3])
        axes.plot(*places.T, color=paint, alpha=alpha, linewidth=width, solid_capstyle="round", zorder=2)
    _solid(axes, body @ turn.T + state[:3], faces, colour, alpha, ASLANT)


def swim(axes: Axes, plant: Dolphin, state: np.ndarray, colour: str, alpha: float = 1.0) -> None:
    """The dolphin's skin, seen aslant from the side."""
    points = np.reshape(state[: 3 * NODES], (NODES, 3))
    _solid(axes, points, [tuple(face) for face in plant.faces], colour, alpha, BESIDE)


def scene(axes: Axes, task: str, states: np.ndarray, wide: float) -> None:
    """Set limits that show all states (n, n_state) of a task in axes ``wide`` times as wide as high, and the ground."""
    if task == "pendulum":
        places = points_of(states).reshape(-1, 2)
        low, high = places.min(axis=0) - 0.3, places.max(axis=0) + 0.3
    elif task == "truck":
        low, high = states[:, :2].min(axis=0) - 3.0, states[:, :2].max(axis=0) + 3.0
    elif task == "lander":
        places, _ = ASLANT.project(states[:, :3])
        low, high = places.min(axis=0) - 4.0, places.max(axis=0) + 3.0
    else:
        places, _ = BESIDE.project(states[:, : 3 * NODES].reshape(-1, 3))
        low, high = places.min(axis=0) - 0.3, places.max(axis=0) + 0.3
    middle, size = (low + high) / 2, high - low
    height = max(size[1], size[0] / wide)
    axes.set_xlim(middle[0] - wide * height / 2, middle[0] + wide * height / 2)
    axes.set_ylim(middle[1] - height / 2, middle[1] + height / 2)
    axes.set_aspect("equal")
    axes.set_axis_off()
    if task == "lander":
        c, s = np.cos(ASLANT.azimuth), np.sin(ASLANT.azimuth)
        corners = [[c * near - s * side, s * near + c * side, 0.0] for near, side in GROUND]
        axes.add_patch(Polygon(ASLANT.project(np.array(corners))[0], color="#DDDDDD", linewidth=0, zorder=0))


DRAWN = {"pendulum": pendulum, "truck": drive, "lander": land, "dolphin": swim}
