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
from anthro.body.rows import layout, velocities_above
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
    columns : for each sphere the velocities that move it.
    slope : (3, nnz) slopes of the sphere's position in them, row x, y, z, spheres one behind the other.
    drift : (k, 2) horizontal velocity in m/s.  speed : (k,) the drift's size by which friction is shared out, m/s.
    """

    def __init__(self, body: Body, world: World):
        contacts, model = body.contacts, body.model
        self.world = world
        self.columns = [velocities_above(model, model.site_bodyid[site]) for site in contacts.sites]
        self.start, self.column = layout(self.columns)
        self.slope = np.zeros((3, len(self.column)))
        self.drift = np.zeros((len(contacts), 2))
        self.speed, self._resistance, self._added = np.zeros((3, len(contacts)))
        seat = world.seat or Seat(0.0)
        self._places = (
            contacts.sites,
            contacts.radius,
            np.array([world.ground and "ground" in met for met in contacts.surfaces], bool),
            np.array([world.seat is not None and "seat" in met for met in contacts.surfaces], bool),
            np.array([seat.height, *seat.centre, *seat.half_size], float),
            model.body_rootid[model.site_bodyid[contacts.sites]],
        )
        self._rows = self.start, self.column, self.slope

    def refresh_positions(self, data, overlap, normal) -> None:
        """Slopes from MuJoCo's site positions and joint axes.

        Writes the spheres' overlaps (k,) m, -inf where one has nothing below it that it can meet, and their slopes
        ``normal`` (nnz,).
        """
        _refresh_positions(data.site_xpos, data.subtree_com, data.cdof, *self._places, *self._rows, overlap, normal)

    def refresh_velocities(self, v) -> None:
        """Drift of the spheres at velocities ``v`` (nv,)."""
        _refresh_velocities(*self._rows, v, self.world.creep_speed, self.drift, self.speed)

    def friction(self, load) -> np.ndarray:
        """Friction (k, 2) N in the present state under normal forces ``load`` (k,) N."""
        resistance = self.world.friction * np.maximum(load, 0.0) / self.speed
        return -resistance[:, None] * self.drift

    def add(self, lower, force, h: float, load, active) -> None:
        """Put the friction of the ``active`` contacts under ``load`` (k,) N into the step's system."""
        _resist(load, active, self.world.friction, self.speed, self._added)
        _add_friction(lower, force, *self._rows, self.drift, h, self._added)

    def list_changes(self, changes, count: int, h: float, load, active) -> int:
        """List what changed in friction since :meth:`add` (:class:`anthro.body.system.Changes`); the new count."""
        _resist(load, active, self.world.friction, self.speed, self._resistance)
        return _list_changes(*changes, count, *self._rows, self.drift, h, self._resistance, self._added)

    def correct(self, velocity, active) -> bool:
        """Compare with the step's end velocity (nv,); True when an active contact picks up speed."""
        return _correct(*self._rows, velocity, active, self.speed)


@njit(cache=True)
def _refresh_positions(
    points, centres, axes, sites, radius, ground, seated, seat, roots, start, column, slope, overlap, normal
):
    """Point Jacobians from MuJoCo's joint axes, which refer to the centre of mass of the whole tree."""
    for i in range(sites.shape[0]):
        point, centre = points[sites[i]], centres[roots[i]]
        lowest, overlap[i] = point[2] - radius[i], -np.inf
        if ground[i]:
            overlap[i] = -lowest
        if seated[i] and abs(point[0] - seat[1]) <= seat[3] and abs(point[1] - seat[2]) <= seat[4]:
            overlap[i] = max(overlap[i], seat[0] - lowest)
        x, y, z = point[0] - centre[0], point[1] - centre[1], point[2] - centre[2]
        for k in range(start[i], start[i + 1]):
            axis = axes[column[k]]
            slope[0, k] = axis[3] + axis[1] * z - axis[2] * y
            slope[1, k] = axis[4] + axis[2] * x - axis[0] * z
            slope[2, k] = axis[5] + axis[0] * y - axis[1] * x
            normal[k] = -slope[2, k]


@njit(cache=True)
def _drift(start, column, slope, i, v):
    """Horizontal velocity (x, y) of sphere ``i`` at velocities ``v``."""
    x, y = 0.0, 0.0
    for k in range(start[i], start[i + 1]):
        x += slope[0, k] * v[column[k]]
        y += slope[1, k] * v[column[k]]
    return x, y


@njit(cache=True)
def _refresh_velocities(start, column, slope, v, creep_speed, drift, speed):
    for i in range(drift.shape[0]):
        x, y = _drift(start, column, slope, i, v)
        drift[i, 0], drift[i, 1] = x, y
        speed[i] = max(np.hypot(x, y), creep_speed)


@njit(cache=True, error_model="numpy")
def _resist(load, active, friction, speed, resistance):
    """Damping (k,) N s/m that stands for friction."""
    for i in range(load.shape[0]):
        resistance[i] = friction * max(load[i], 0.0) / speed[i] if active[i] else 0.0


@njit(cache=True)
def _add_friction(lower, force, start, column, slope, drift, h, resistance):
    for i in range(resistance.shape[0]):
        if resistance[i] != 0.0:
            for a in range(start[i], start[i + 1]):
                x, y = resistance[i] * slope[0, a], resistance[i] * slope[1, a]
                force[column[a]] -= x * drift[i, 0] + y * drift[i, 1]
                for b in range(start[i], a + 1):
                    lower[column[a], column[b]] += h * (x * slope[0, b] + y * slope[1, b])


@njit(cache=True)
def _list_changes(rows, weights, pushes, count, start, column, slope, drift, h, resistance, added):
    for i in range(resistance.shape[0]):
        more = resistance[i] - added[i]
        if more != 0.0:
            for side in range(2):
                rows[count] = 0.0
                for k in range(start[i], start[i + 1]):
                    rows[count, column[k]] = slope[side, k]
                weights[count], pushes[count] = h * more, -more * drift[i, side]
                count += 1
    return count


@njit(cache=True)
def _correct(start, column, slope, velocity, active, speed):
    faster = False
    for i in range(speed.shape[0]):
        if active[i]:
            x, y = _drift(start, column, slope, i, velocity)
            after = np.hypot(x, y)
            if after > SPEED_UP * speed[i]:
                speed[i], faster = after, True
    return faster
