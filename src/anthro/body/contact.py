"""What a body stands and sits on: level surfaces met by spheres on the bones.

The normal force is a one-sided spring and damper (:mod:`anthro.body.stops`). Friction is Coulomb's, made regular
below a creep speed: F = -mu N v / max(|v|, v_creep). It enters the step as a damping mu N / max(|v|, v_creep), which
takes energy out at any step length. |v| is that at the step's start, or its end where a sphere picks up speed.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit

from anthro.body.model import Body
from anthro.body.paths import velocities_above
from anthro.errors import UserError

SPEED_UP = 1.1  # share by which a sphere may speed up in a step before its friction is shared out anew


@dataclass(frozen=True)
class Seat:
    """A level rectangle to sit on: the height of its top, its centre (x, y), half its sides; m."""

    height: float
    centre: tuple[float, float] = (0.0, 0.0)
    half_size: tuple[float, float] = (0.2, 0.2)


@dataclass(frozen=True)
class World:
    """What surrounds the body.

    Attributes
    ----------
    ground : whether there is ground at z = 0.
    seat : what to sit on, None for nothing. It has no sides: only spheres above its rectangle meet it.
    stiffness : N/m of one sphere; 75 kg on six of them sink by 2.5 mm.  damping : N s/m.
    friction : Coulomb's coefficient.
    creep_speed : m/s, below which friction grows in proportion to speed.

    Raises
    ------
    UserError
        A number is not positive.
    """

    ground: bool = True
    seat: Seat | None = None
    stiffness: float = 5e4
    damping: float = 1e3
    friction: float = 0.8
    creep_speed: float = 0.005

    def __post_init__(self):
        for name in ("stiffness", "damping", "friction", "creep_speed"):
            if not getattr(self, name) > 0.0:
                raise UserError(f"{name} of a world must be positive, got {getattr(self, name)}")


class Touch:
    """The contact spheres of a body in a world: where they are, and how they move.

    Attributes
    ----------
    overlap : (k,) m, -inf where a sphere has nothing below it that it can meet.
    columns : for each sphere the velocities that move it.
    slope : (3, nnz) slopes of the sphere's position in them, row x, y, z, spheres one behind the other.
    drift : (k, 2) horizontal velocity in m/s.  speed : (k,) the drift's size by which friction is shared out, m/s.
    """

    def __init__(self, body: Body, world: World):
        contacts, model = body.contacts, body.model
        self.world = world
        self.columns = [velocities_above(model, model.site_bodyid[site]) for site in contacts.sites]
        self.start = np.cumsum([0] + [len(row) for row in self.columns])
        self.column = np.concatenate([*self.columns, np.empty(0)]).astype(np.int64)
        self.slope = np.zeros((3, len(self.column)))
        self.overlap = np.full(len(contacts), -np.inf)
        self.drift, self._drift_after = np.zeros((2, len(contacts), 2))
        self.speed = np.zeros(len(contacts))
        self._sites, self._radius = contacts.sites, contacts.radius
        self._roots = model.body_rootid[model.site_bodyid[contacts.sites]]
        seat = world.seat or Seat(0.0)
        self._seat = np.array([seat.height, *seat.centre, *seat.half_size], float)
        self._ground = np.array([world.ground and "ground" in met for met in contacts.surfaces], bool)
        self._seated = np.array([world.seat is not None and "seat" in met for met in contacts.surfaces], bool)

    def refresh_positions(self, data) -> None:
        """Overlaps and slopes from MuJoCo's site positions and joint axes."""
        points, origins = data.site_xpos, data.subtree_com
        _overlaps(points, self._sites, self._radius, self._ground, self._seated, self._seat, self.overlap)
        _slopes(points, self._sites, origins, self._roots, data.cdof, self.start, self.column, self.slope)

    def refresh_velocities(self, v) -> None:
        """Drift of the spheres at velocities ``v`` (nv,)."""
        _drift(self.start, self.column, self.slope, v, self.drift)
        self.speed = np.maximum(np.hypot(*self.drift.T), self.world.creep_speed)

    def friction(self, load) -> np.ndarray:
        """Friction (k, 2) N in the present state under normal forces ``load`` (k,) N."""
        return -self._resistance(load)[:, None] * self.drift

    def _resistance(self, load) -> np.ndarray:
        """Damping (k,) N s/m that stands for friction."""
        return self.world.friction * np.maximum(load, 0.0) / self.speed

    def add(self, lower, force, h: float, load, active) -> None:
        """Put the friction of the ``active`` contacts under ``load`` (k,) N into the step's system."""
        resistance = self._resistance(load)
        _add_friction(lower, force, self.start, self.column, self.slope, self.drift, h, resistance, active)

    def correct(self, velocity, active) -> bool:
        """Compare with the step's end velocity (nv,); True when an active contact picks up speed."""
        _drift(self.start, self.column, self.slope, velocity, self._drift_after)
        after = np.hypot(*self._drift_after.T)
        faster = active & (after > SPEED_UP * self.speed)
        self.speed[faster] = after[faster]
        return bool(faster.any())


@njit(cache=True)
def _overlaps(points, sites, radius, ground, seated, seat, overlap):
    for i in range(overlap.shape[0]):
        x, y, z = points[sites[i]]
        lowest, overlap[i] = z - radius[i], -np.inf
        if ground[i]:
            overlap[i] = -lowest
        if seated[i] and abs(x - seat[1]) <= seat[3] and abs(y - seat[2]) <= seat[4]:
            overlap[i] = max(overlap[i], seat[0] - lowest)


@njit(cache=True)
def _slopes(points, sites, origins, roots, axes, start, column, slope):
    """Point Jacobians from MuJoCo's joint axes, which refer to the centre of mass of the whole tree."""
    for i in range(sites.shape[0]):
        x, y, z = points[sites[i]] - origins[roots[i]]
        for k in range(start[i], start[i + 1]):
            axis = axes[column[k]]
            slope[0, k] = axis[3] + axis[1] * z - axis[2] * y
            slope[1, k] = axis[4] + axis[2] * x - axis[0] * z
            slope[2, k] = axis[5] + axis[0] * y - axis[1] * x


@njit(cache=True)
def _drift(start, column, slope, v, drift):
    for i in range(drift.shape[0]):
        for row in range(2):
            total = 0.0
            for k in range(start[i], start[i + 1]):
                total += slope[row, k] * v[column[k]]
            drift[i, row] = total


@njit(cache=True)
def _add_friction(lower, force, start, column, slope, drift, h, resistance, active):
    for i in range(drift.shape[0]):
        if active[i]:
            for a in range(start[i], start[i + 1]):
                x, y = resistance[i] * slope[0, a], resistance[i] * slope[1, a]
                force[column[a]] -= x * drift[i, 0] + y * drift[i, 1]
                for b in range(start[i], a + 1):
                    lower[column[a], column[b]] += h * (x * slope[0, b] + y * slope[1, b])
