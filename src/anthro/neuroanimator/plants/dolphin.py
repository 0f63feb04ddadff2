"""The dolphin: point masses, springs, dampers and six muscles in water, integrated semi-implicitly.

Each step solves ``(M + dt C + dt^2 K) v' = M v + dt f(x)``, where f are the springs' and the water's forces and C and K
hold each damper and spring along its own direction (semi-implicit Euler of Tu & Terzopoulos 1994, which the paper
uses). The matrix is banded, as masses are numbered from head to tail, and factored by Cholesky's method within the
band. Water pushes on each face against its motion outward, ``-A max(0, n.v) n`` times `WATER`.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from anthro.neuroanimator.frames import rotation
from anthro.neuroanimator.plants import dolphin_shape as shape
from anthro.neuroanimator.plants.plant import STEP, Group, Plant, TypicalControl

STIFFNESS = 3000.0  # N/m
MUSCLE_STIFFNESS = 9000.0  # N/m, of the springs that muscles contract
DAMPING = 150.0  # N s/m
CONTRACTION = 0.3  # share of its length that a muscle loses at most
WATER = 600.0  # N s/m^3, resistance of an area that moves outward
BAND = 23  # entries left of the diagonal: seven masses of three coordinates, and two
NODES = 23
AXES = "xyz"


@njit(cache=True, fastmath=True)
def spring_forces(x, v, contraction, pairs, owner, rest, stiffness, damping, force):
    """Add the springs' and dampers' forces (23, 3) N at positions and velocities (23, 3)."""
    for s in range(len(pairs)):
        i, j = pairs[s, 0], pairs[s, 1]
        dx, dy, dz = x[j, 0] - x[i, 0], x[j, 1] - x[i, 1], x[j, 2] - x[i, 2]
        length = np.sqrt(dx * dx + dy * dy + dz * dz)
        dx, dy, dz = dx / length, dy / length, dz / length
        speed = dx * (v[j, 0] - v[i, 0]) + dy * (v[j, 1] - v[i, 1]) + dz * (v[j, 2] - v[i, 2])
        natural = rest[s] if owner[s] < 0 else rest[s] * (1.0 - contraction[owner[s]])
        pull = stiffness[s] * (length - natural) + damping * speed
        force[i, 0] += pull * dx
        force[i, 1] += pull * dy
        force[i, 2] += pull * dz
        force[j, 0] -= pull * dx
        force[j, 1] -= pull * dy
        force[j, 2] -= pull * dz


@njit(cache=True, fastmath=True)
def water_forces(x, v, faces, water, force):
    """Add the water's forces (23, 3) N on the faces."""
    for t in range(len(faces)):
        i, j, k = faces[t, 0], faces[t, 1], faces[t, 2]
        ax, ay, az = x[j, 0] - x[i, 0], x[j, 1] - x[i, 1], x[j, 2] - x[i, 2]
        bx, by, bz = x[k, 0] - x[i, 0], x[k, 1] - x[i, 1], x[k, 2] - x[i, 2]
        nx, ny, nz = ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
        twice = np.sqrt(nx * nx + ny * ny + nz * nz)
        nx, ny, nz = nx / twice, ny / twice, nz / twice
        outward = (
            nx * (v[i, 0] + v[j, 0] + v[k, 0]) + ny * (v[i, 1] + v[j, 1] + v[k, 1]) + nz * (v[i, 2] + v[j, 2] + v[k, 2])
        ) / 3.0
        if outward > 0.0:
            share = -water * (twice / 2.0) * outward / 3.0
            for corner in (i, j, k):
                force[corner, 0] += share * nx
                force[corner, 1] += share * ny
                force[corner, 2] += share * nz


@njit(cache=True, fastmath=True)
def _assemble(x, mass, pairs, stiffness, damping, dt, lower):
    """Fill the lower triangle, within its band, of ``M + dt C + dt^2 K`` (69, 69)."""
    for i in range(len(lower)):
        for j in range(max(0, i - BAND), i):
            lower[i, j] = 0.0
        lower[i, i] = mass[i // 3]
    direction = np.empty(3)
    for s in range(len(pairs)):
        i, j = 3 * pairs[s, 0], 3 * pairs[s, 1]
        square = 0.0
        for a in range(3):
            direction[a] = x[pairs[s, 1], a] - x[pairs[s, 0], a]
            square += direction[a] * direction[a]
        weight = dt * (damping + dt * stiffness[s]) / square
        for a in range(3):
            for b in range(3):
                value = weight * direction[a] * direction[b]
                lower[j + a, i + b] -= value
                if b <= a:
                    lower[i + a, i + b] += value
                    lower[j + a, j + b] += value


@njit(cache=True, fastmath=True)
def _solve(lower, right):
    """Factor a banded matrix in place (Cholesky, column by column) and solve for ``right`` (69,) in place."""
    count = len(right)
    column = np.empty(BAND)
    for j in range(count):
        below = min(BAND, count - 1 - j)
        inverse = 1.0 / np.sqrt(lower[j, j])
        right[j] *= inverse
        lower[j, j] = inverse  # the diagonal is only ever divided by
        for m in range(below):
            column[m] = lower[j + 1 + m, j] * inverse
            lower[j + 1 + m, j] = column[m]
            right[j + 1 + m] -= column[m] * right[j]
        for i in range(below):
            row, factor = lower[j + 1 + i, j + 1 : j + 2 + i], column[i]
            for m in range(len(row)):
                row[m] -= factor * column[m]
    for i in range(count - 1, -1, -1):
        right[i] *= lower[i, i]
        for k in range(max(0, i - BAND), i):
            right[k] -= lower[i, k] * right[i]


@njit(cache=True)
def _advance(x, v, control, steps, dt, mass, pairs, owner, rest, stiffness, damping, contraction, faces, water):
    """Advance positions and velocities (23, 3) in place."""
    lower, force = np.empty((3 * NODES, 3 * NODES)), np.empty((NODES, 3))
    shortening = contraction * np.minimum(np.maximum(control, 0.0), 1.0)
    for _ in range(steps):
        force[:] = 0.0
        spring_forces(x, v, shortening, pairs, owner, rest, stiffness, damping, force)
        water_forces(x, v, faces, water, force)
        _assemble(x, mass, pairs, stiffness, damping, dt, lower)
        right = force.reshape(-1)
        right *= dt
        _solve(lower, right)
        for i in range(NODES):
            for a in range(3):
                v[i, a] += force[i, a]
                x[i, a] += dt * v[i, a]


class _Swimming(TypicalControl):
    """Muscles in waves from head to tail, a ventral one when its dorsal one rests; or steps of random height."""

    def __init__(self, generator: np.random.Generator, low, high):
        lag = generator.uniform(0.0, 1.5)
        along = lag * np.arange(3.0)
        super().__init__(generator, low, high, np.concatenate([along, along + np.pi]))
        if self._wave:
            self._amplitude[:] = self._amplitude.max()


class Dolphin(Plant):
    """Positions of the 23 masses, then their velocities; control: activation of dorsal, then ventral muscles.

    Parameters
    ----------
    damping : float
        Of each spring's damper, N s/m.
    water : float
        Resistance of the water, N s/m^3.
    """

    name = "dolphin"
    state = (
        Group("position", tuple(f"mass {n} {a}" for n in range(NODES) for a in AXES), "m"),
        Group("velocity", tuple(f"mass {n} velocity {a}" for n in range(NODES) for a in AXES), "m/s"),
    )
    control = (Group("activation", tuple(f"{s} muscle {n}" for s in ("dorsal", "ventral") for n in (1, 2, 3)), "1"),)
    low, high = np.zeros(6), np.ones(6)
    frame = "body"

    def __init__(self, damping: float = DAMPING, water: float = WATER):
        self.points, self.mass, self.faces = shape.points(), shape.masses(), shape.faces()
        self.pairs, self.owner, self.segments = shape.springs(), shape.muscles(), shape.segments()
        self.lengths = np.linalg.norm(np.diff(self.points[self.pairs], axis=1)[:, 0], axis=1)
        self.stiffness = np.where(self.owner < 0, STIFFNESS, MUSCLE_STIFFNESS)
        self.damping, self.water = damping, water

    @property
    def rest(self) -> np.ndarray:
        """At rest, its nose towards +x."""
        return np.concatenate([self.points.ravel(), np.zeros(3 * NODES)])

    def advance(self, state: np.ndarray, control: np.ndarray, force: np.ndarray, steps: int) -> np.ndarray:
        """See `Plant.advance`."""
        x, v = np.array(state, float).reshape(2, NODES, 3)
        body = self.mass, self.pairs, self.owner, self.lengths, self.stiffness, self.damping
        _advance(x, v, np.ascontiguousarray(control), int(steps), STEP, *body, CONTRACTION, self.faces, self.water)
        return np.concatenate([x.ravel(), v.ravel()])

    def energy(self, state: np.ndarray) -> float:
        """Kinetic energy and that of the springs with muscles at rest, J."""
        x, v = np.reshape(state, (2, NODES, 3))
        stretch = np.linalg.norm(x[self.pairs[:, 1]] - x[self.pairs[:, 0]], axis=1) - self.lengths
        return float(0.5 * (self.mass @ np.square(v)).sum() + 0.5 * self.stiffness @ np.square(stretch))

    def start(self, generator: np.random.Generator) -> np.ndarray:
        """Gliding at random, undeformed, its nose in any direction."""
        quaternion = generator.normal(size=4)
        turn = np.empty((3, 3))
        rotation(quaternion / np.linalg.norm(quaternion), turn)
        velocity = turn @ [generator.uniform(0.0, 1.0), 0.0, generator.uniform(-0.1, 0.1)]
        return np.concatenate([(self.points @ turn.T).ravel(), np.tile(velocity, NODES)])

    def typical(self, generator: np.random.Generator) -> TypicalControl:
        """Coordinated muscle actions that swim."""
        return _Swimming(generator, self.low, self.high)
