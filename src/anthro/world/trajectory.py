"""When a finger is where: strokes in a plane made into a path over time."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.ndimage import gaussian_filter1d

from anthro.errors import UserError
from anthro.world.strokes import Stroke

CORNER = np.radians(35.0)  # a sharper turn is a corner, where the pen rests
STRAIGHT_RADIUS = 0.1  # m, far above it a bend counts as straight
SPACING = 5e-4  # m between the knots of a line
SMOOTHING = 3e-3  # m, standard deviation over which curvature is averaged
EASE_SECONDS = 0.2  # from rest to the law's speed
SHORTEST_MOVE = 0.3  # s, with the pen up
LIFT = 0.02  # m, of the pen between strokes


@dataclass(frozen=True)
class Plane:
    """A drawing plane in a frame (the world's, a chair's).

    Parameters
    ----------
    origin : array (3,)
        Where the plane's (0, 0) lies, m.
    right, up : array (3,)
        Directions of the drawing's x and y as its reader sees them; made of length one, and ``up`` perpendicular.

    Raises
    ------
    UserError
        Not three finite numbers each, or the two directions parallel.
    """

    origin: np.ndarray
    right: np.ndarray
    up: np.ndarray

    def __post_init__(self):
        for name in ("origin", "right", "up"):
            vector = np.array(getattr(self, name), float)
            if vector.shape != (3,) or not np.isfinite(vector).all():
                raise UserError(f"plane: {name} must be three finite numbers, got {np.array(vector).tolist()}")
            object.__setattr__(self, name, vector)
        if np.linalg.norm(np.cross(self.right, self.up)) <= 1e-6 * np.linalg.norm(self.right) * np.linalg.norm(self.up):
            raise UserError("plane: right and up must be two directions that are not parallel")
        right = self.right / np.linalg.norm(self.right)
        up = self.up - (self.up @ right) * right
        object.__setattr__(self, "right", right)
        object.__setattr__(self, "up", up / np.linalg.norm(up))

    @property
    def axes(self) -> np.ndarray:
        """Directions (3, 3) of the plane's x, y and z, as rows; z points at the reader."""
        return np.stack([self.right, self.up, np.cross(self.right, self.up)])

    def place(self, points) -> np.ndarray:
        """Points (..., 3) m of the plane, in the frame."""
        return self.origin + np.asarray(points, float) @ self.axes

    def locate(self, points) -> np.ndarray:
        """Points (..., 3) m of the frame, in the plane."""
        return (np.asarray(points, float) - self.origin) @ self.axes.T


class Trajectory:
    """A finger's given path: strokes with the pen down, moves between them with the pen up.

    With the pen down, speed follows the two-thirds power law, v = K (R / (1 + a R))^(1/3), in the form that also
    holds where the path is straight (Lacquaniti, Terzuolo and Viviani, Acta Psychologica 54, 1983; Viviani and
    Stucchi, J. Exp. Psychol. Hum. Percept. Perform. 18, 1992): R is the radius of curvature, 1/a `STRAIGHT_RADIUS`,
    and K such that a straight line is drawn at ``speed``. The pen starts from rest and comes to rest at the ends of
    a stroke and at its corners, over `EASE_SECONDS`. Between strokes it moves on a straight minimum-jerk path (Flash
    and Hogan, J. Neurosci. 5, 1985), lifted towards the reader by a bump that is smooth to the acceleration.

    Parameters
    ----------
    strokes : sequence of Stroke
    plane : Plane
    speed : float
        Along a straight line and, on average, between strokes, m/s; less in bends, and in moves under 0.3 s.
    lift : float
        Height of the pen half way between strokes, m.
    pause : float
        Seconds that the pen, still up, waits where a stroke begins after a move: a finger lags behind.

    Raises
    ------
    UserError
        No strokes, a speed that is not positive, a negative lift or pause.
    """

    def __init__(self, strokes: Sequence[Stroke], plane: Plane, speed: float, lift: float = LIFT, pause: float = 0.0):
        if not strokes:
            raise UserError("trajectory: no strokes")
        if not (np.isfinite(speed) and speed > 0):
            raise UserError(f"speed: {speed} m/s is not a positive number")
        if not (np.isfinite(lift) and lift >= 0):
            raise UserError(f"lift: {lift} m is negative")
        if not (np.isfinite(pause) and pause >= 0):
            raise UserError(f"pause: {pause} s is negative")
        self.plane = plane
        self._pieces: list[_Line | _Move] = []
        for stroke in strokes:
            lines = [_Line(points, speed) for points in _between_corners(stroke.points)]
            if self._pieces:
                self._pieces.append(_Move(self._pieces[-1].end, lines[0].start, speed, lift, pause))
            self._pieces += lines
        self._starts = np.concatenate([[0.0], np.cumsum([piece.duration for piece in self._pieces])])

    @property
    def duration(self) -> float:
        """Seconds from the first stroke's start to the last one's end."""
        return float(self._starts[-1])

    def position(self, t) -> np.ndarray:
        """Position (3,) or (n, 3) m in the plane's frame at time ``t``, scalar or (n,), s.

        Before 0 and after `duration` it stays where it begins and ends.
        """
        return self.plane.place(self.reference(t))

    def reference(self, t) -> np.ndarray:
        """Position as `position`, but in the plane: x to the right, y up, z off the plane."""
        t = np.asarray(t, float)
        times = np.atleast_1d(t)
        which = self._which(times)
        result = np.empty((len(times), 3))
        for index in np.unique(which):
            here = which == index
            result[here] = self._pieces[index].at(times[here] - self._starts[index])
        return result.reshape(*t.shape, 3)

    def pen_down(self, t) -> np.ndarray:
        """Whether the pen is down at time ``t``, scalar or (n,), s; up before 0 and after `duration`."""
        t = np.asarray(t, float)
        down = np.array([isinstance(piece, _Line) for piece in self._pieces])
        return down[self._which(t)] & (t >= 0) & (t <= self.duration)

    def _which(self, t: np.ndarray) -> np.ndarray:
        return np.clip(np.searchsorted(self._starts, t, side="right") - 1, 0, len(self._pieces) - 1)


class _Line:
    """A line without corners, drawn from rest to rest."""

    def __init__(self, points: np.ndarray, speed: float):
        along = _along(points)
        knots = np.linspace(0.0, along[-1], max(8, 1 + int(np.ceil(along[-1] / SPACING))))
        line = np.stack([np.interp(knots, along, values) for values in points.T], axis=1)
        slowness = 1.0 / (speed * (1.0 + STRAIGHT_RADIUS * _curvature(line)) ** (-1 / 3))
        steps = np.diff(knots) * (slowness[1:] + slowness[:-1]) / 2
        law = np.concatenate([[0.0], np.cumsum(steps)])
        self._path = CubicSpline(law, line)
        self._law = law[-1]  # s that it would take without rests
        self._rate = min(1.0, self._law / EASE_SECONDS)  # of a short line, the highest share of the law's speed
        self.duration = self._law / self._rate + EASE_SECONDS
        self.start, self.end = line[0], line[-1]

    def at(self, t: np.ndarray) -> np.ndarray:
        """Positions (n, 3) m in the plane at times (n,) s."""
        flat = self._path(np.clip(self._eased(t), 0.0, self._law))
        return np.column_stack([flat, np.zeros(len(flat))])

    def _eased(self, t: np.ndarray) -> np.ndarray:
        """Time of the law at times (n,): its rate rises as the smoothstep, stays, and falls likewise."""

        def ramp(x):
            x = np.clip(x, 0.0, 1.0)
            return x**3 - x**4 / 2

        left = self.duration - t
        middle = np.clip(t, EASE_SECONDS, self.duration - EASE_SECONDS) - EASE_SECONDS
        return self._rate * (EASE_SECONDS * (ramp(t / EASE_SECONDS) + 0.5 - ramp(left / EASE_SECONDS)) + middle)


class _Move:
    """From one stroke's end to the next one's start, the pen up, and a pause there."""

    def __init__(self, start: np.ndarray, end: np.ndarray, speed: float, lift: float, pause: float):
        self.start, self.end, self._lift = start, end, lift
        farthest = max(float(np.linalg.norm(end - start)), 2 * lift)
        self._moving = max(farthest / speed, SHORTEST_MOVE)
        self.duration = self._moving + pause

    def at(self, t: np.ndarray) -> np.ndarray:
        """Positions (n, 3) m in the plane at times (n,) s."""
        x = np.clip(t / self._moving, 0.0, 1.0)[:, None]
        flat = self.start + (10 * x**3 - 15 * x**4 + 6 * x**5) * (self.end - self.start)
        return np.hstack([flat, self._lift * 64 * (x * (1 - x)) ** 3])


def _between_corners(points: np.ndarray) -> list[np.ndarray]:
    """The lines (k, 2) into which a stroke's corners cut it."""
    steps = np.diff(points, axis=0)
    lengths = np.linalg.norm(steps, axis=1)
    moved = lengths > 1e-9 * lengths.sum()
    points, steps = points[np.concatenate([[True], moved])], steps[moved]
    cuts = 1 + np.flatnonzero(np.abs(_turns(steps)) > CORNER)
    edges = [0, *cuts, len(points) - 1]
    return [points[low : high + 1] for low, high in zip(edges[:-1], edges[1:], strict=True)]


def _turns(steps: np.ndarray) -> np.ndarray:
    """Angles (k - 1,) rad between successive steps (k, 2)."""
    before, after = steps[:-1], steps[1:]
    cross = before[:, 0] * after[:, 1] - before[:, 1] * after[:, 0]
    return np.arctan2(cross, (before * after).sum(axis=1))


def _along(points: np.ndarray) -> np.ndarray:
    """Lengths (k,) m along a line up to each of its points (k, d)."""
    return np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])


def _curvature(line: np.ndarray) -> np.ndarray:
    """Curvature (k,) 1/m, averaged over about ``SMOOTHING``, of points (k, 2) at equal distances."""
    steps = np.diff(line, axis=0)
    spacing = np.linalg.norm(steps, axis=1).mean()
    turns = _turns(steps)
    turns = np.abs(gaussian_filter1d(turns, min(SMOOTHING / spacing, len(turns)), mode="nearest"))
    return np.concatenate([turns[:1], turns, turns[-1:]]) / spacing
