"""The hierarchical state of the dolphin (Grzeszczuk 1998, Fig. 7): a frame for each body segment, and its masses in it.

A frame has its segment's centre of mass, orientation (x from its back to its front, y to its left), velocity and
angular velocity: 13 variables, 78 for six segments. Masses that two segments share are put at the mean of both.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from anthro.neuroanimator.frames import rotation
from anthro.neuroanimator.plants import dolphin_shape as shape
from anthro.neuroanimator.plants.dolphin import NODES, Dolphin
from anthro.neuroanimator.plants.plant import Group

COUNT = 6  # segments
FRAME = 13  # variables of a frame
LOCAL = 6  # variables of a mass in its segment
CENTRES = 6 * COUNT  # inputs of a local net that tell of the global motion
PLACE, ATTITUDE, VELOCITY, SPIN = 0, 3 * COUNT, 7 * COUNT, 10 * COUNT  # where each group of frames begins


@njit(cache=True, fastmath=True)
def _axes(x, along, across, out):
    """Orientation (3, 3), axes in columns, from the points that `along` and `across` weigh."""
    first, left = np.zeros(3), np.zeros(3)
    for i in range(NODES):
        for a in range(3):
            first[a] += along[i] * x[i, a]
            left[a] += across[i] * x[i, a]
    first /= np.sqrt(np.sum(first * first))
    left -= np.sum(left * first) * first
    left /= np.sqrt(np.sum(left * left))
    for a in range(3):
        out[a, 0], out[a, 1] = first[a], left[a]
        b, c = (a + 1) % 3, (a + 2) % 3
        out[a, 2] = first[b] * left[c] - first[c] * left[b]


@njit(cache=True)
def _quaternion(m, like, out):
    """Quaternion (4,) of a rotation matrix, of the sign that is nearer to ``like`` (4,)."""
    trace = m[0, 0] + m[1, 1] + m[2, 2]
    if trace > 0.0:
        s = 2.0 * np.sqrt(1.0 + trace)
        out[0], out[1], out[2] = s / 4.0, (m[2, 1] - m[1, 2]) / s, (m[0, 2] - m[2, 0]) / s
        out[3] = (m[1, 0] - m[0, 1]) / s
    else:
        a = 0 if m[0, 0] >= m[1, 1] and m[0, 0] >= m[2, 2] else 1 if m[1, 1] >= m[2, 2] else 2
        b, c = (a + 1) % 3, (a + 2) % 3
        s = 2.0 * np.sqrt(1.0 + m[a, a] - m[b, b] - m[c, c])
        out[0], out[1 + a] = (m[c, b] - m[b, c]) / s, s / 4.0
        out[1 + b], out[1 + c] = (m[b, a] + m[a, b]) / s, (m[c, a] + m[a, c]) / s
    if out[0] * like[0] + out[1] * like[1] + out[2] * like[2] + out[3] * like[3] < 0.0:
        for a in range(4):
            out[a] = -out[a]


@njit(cache=True)
def _spin(mass, r, w, count, out):
    """Angular velocity (3,) whose rotation has the angular momentum of masses at ``r`` moving with ``w``."""
    inertia, momentum = np.zeros((3, 3)), np.zeros(3)
    for i in range(count):
        square = r[i, 0] ** 2 + r[i, 1] ** 2 + r[i, 2] ** 2
        for a in range(3):
            b, c = (a + 1) % 3, (a + 2) % 3
            momentum[a] += mass[i] * (r[i, b] * w[i, c] - r[i, c] * w[i, b])
            inertia[a, a] += mass[i] * square
            for d in range(3):
                inertia[a, d] -= mass[i] * r[i, a] * r[i, d]
    for a in range(3):  # cofactors of the symmetric matrix
        b, c = (a + 1) % 3, (a + 2) % 3
        out[a] = 0.0
        for d in range(3):
            e, f = (d + 1) % 3, (d + 2) % 3
            out[a] += (inertia[b, e] * inertia[c, f] - inertia[b, f] * inertia[c, e]) * momentum[d]
    determinant = 0.0
    for d in range(3):
        e, f = (d + 1) % 3, (d + 2) % 3
        determinant += inertia[0, d] * (inertia[1, e] * inertia[2, f] - inertia[1, f] * inertia[2, e])
    out /= determinant


@njit(cache=True)
def split(state, like, mass, members, counts, along, across, rest, frame, local):
    """Write frames (78,) and local states (sum of 6 k,) of a dolphin's state (138,); ``like`` (78,) gives signs."""
    x, v = state[: 3 * NODES].reshape(NODES, 3), state[3 * NODES :].reshape(NODES, 3)
    matrix, omega = np.empty((3, 3)), np.empty(3)
    r, w, m = np.empty((8, 3)), np.empty((8, 3)), np.empty(8)
    place = 0
    for j in range(COUNT):
        count, total = counts[j], 0.0
        centre, speed = frame[PLACE + 3 * j : PLACE + 3 * j + 3], frame[VELOCITY + 3 * j : VELOCITY + 3 * j + 3]
        centre[:] = 0.0
        speed[:] = 0.0
        for k in range(count):
            i = members[j, k]
            m[k] = mass[i]
            total += mass[i]
            for a in range(3):
                centre[a] += mass[i] * x[i, a]
                speed[a] += mass[i] * v[i, a]
        centre /= total
        speed /= total
        for k in range(count):
            for a in range(3):
                r[k, a] = x[members[j, k], a] - centre[a]
                w[k, a] = v[members[j, k], a] - speed[a]
        _axes(x, along[j], across[j], matrix)
        quaternion = frame[ATTITUDE + 4 * j : ATTITUDE + 4 * j + 4]
        _quaternion(matrix, like[ATTITUDE + 4 * j : ATTITUDE + 4 * j + 4], quaternion)
        _spin(m, r, w, count, omega)
        frame[SPIN + 3 * j : SPIN + 3 * j + 3] = omega
        for k in range(count):
            for a in range(3):
                b, c = (a + 1) % 3, (a + 2) % 3
                w[k, a] -= omega[b] * r[k, c] - omega[c] * r[k, b]
            for a in range(3):
                local[place + 3 * k + a] = -rest[j, k, a]
                local[place + 3 * (count + k) + a] = 0.0
                for b in range(3):
                    local[place + 3 * k + a] += matrix[b, a] * r[k, b]
                    local[place + 3 * (count + k) + a] += matrix[b, a] * w[k, b]
        place += LOCAL * count


@njit(cache=True)
def assemble(frame, local, members, counts, rest, shared, state):
    """Write the dolphin's state (138,) of frames and local states: the inverse of `split`."""
    state[:] = 0.0
    x, v = state[: 3 * NODES].reshape(NODES, 3), state[3 * NODES :].reshape(NODES, 3)
    matrix, r = np.empty((3, 3)), np.empty(3)
    place = 0
    for j in range(COUNT):
        count, omega = counts[j], frame[SPIN + 3 * j : SPIN + 3 * j + 3]
        rotation(frame[ATTITUDE + 4 * j : ATTITUDE + 4 * j + 4], matrix)
        for k in range(count):
            i = members[j, k]
            for a in range(3):
                r[a] = 0.0
                for b in range(3):
                    r[a] += matrix[a, b] * (local[place + 3 * k + b] + rest[j, k, b])
            for a in range(3):
                b, c = (a + 1) % 3, (a + 2) % 3
                speed = frame[VELOCITY + 3 * j + a] + omega[b] * r[c] - omega[c] * r[b]
                for d in range(3):
                    speed += matrix[a, d] * local[place + 3 * (count + k) + d]
                x[i, a] += (frame[PLACE + 3 * j + a] + r[a]) / shared[i]
                v[i, a] += speed / shared[i]
        place += LOCAL * count


@njit(cache=True)
def centres(frame, j, rest, out):
    """Write where all segments' centres are and how they move, seen from segment ``j`` (36,), less rest (18,)."""
    matrix = np.empty((3, 3))
    rotation(frame[ATTITUDE + 4 * j : ATTITUDE + 4 * j + 4], matrix)
    for k in range(COUNT):
        for a in range(3):
            place, speed = -rest[3 * k + a], 0.0
            for b in range(3):
                place += matrix[b, a] * (frame[PLACE + 3 * k + b] - frame[PLACE + 3 * j + b])
                speed += matrix[b, a] * (frame[VELOCITY + 3 * k + b] - frame[VELOCITY + 3 * j + b])
            out[3 * k + a], out[3 * (COUNT + k) + a] = place, speed


@njit(cache=True)
def _split_all(states, likes, mass, members, counts, along, across, rest, frames, locals_):
    for i in range(len(states)):
        split(states[i], likes[i], mass, members, counts, along, across, rest, frames[i], locals_[i])


@njit(cache=True)
def _assemble_all(frames, locals_, members, counts, rest, shared, states):
    for i in range(len(frames)):
        assemble(frames[i], locals_[i], members, counts, rest, shared, states[i])


@njit(cache=True)
def _centres_all(frames, j, rest, out):
    for i in range(len(frames)):
        centres(frames[i], j, rest, out[i])


class Segments:
    """The operator between a dolphin's 138 variables and its hierarchical ones, invertible.

    Parameters
    ----------
    plant : Dolphin

    Attributes
    ----------
    counts : ndarray of int, (6,)
        Masses of each segment.
    rest : ndarray, (78,)
        The frames at rest.
    places : tuple of slice
        Where each segment's local state stands among all.
    """

    def __init__(self, plant: Dolphin):
        parts = plant.segments
        self.mass, self.counts = plant.mass, np.array([len(part) for part in parts])
        self.members = np.array([np.pad(part, (0, 8 - len(part))) for part in parts])
        self.shared = np.bincount(np.concatenate(parts), minlength=NODES).astype(float)
        self.along, self.across = np.zeros((2, COUNT, NODES))
        ends = [[0], *[range(shape.node(s, 0), shape.node(s, 0) + 4) for s in range(5)], [21, 22]]
        for j, part in enumerate(parts):
            for nodes, sign in ((ends[j], 1.0), (ends[j + 1], -1.0)):
                self.along[j, list(nodes)] = sign / len(nodes)
            self.across[j, part] = np.sign(plant.points[part, 1])
        self.shape = np.zeros((COUNT, 8, 3))
        stops = np.cumsum(LOCAL * self.counts)
        self.places = tuple(slice(b - a, b) for a, b in zip(LOCAL * self.counts, stops, strict=True))
        upright = np.zeros((1, FRAME * COUNT))
        upright[0, ATTITUDE:VELOCITY:4] = 1.0
        frames, local = self.split(plant.rest[None], upright)
        for j, (place, count) in enumerate(zip(self.places, self.counts, strict=True)):
            self.shape[j, :count] = local[0, place][: 3 * count].reshape(count, 3)
        self.rest = frames[0]
        self.spacing = np.array(
            [np.ravel(self.rest[:18].reshape(6, 3) - self.rest[3 * j : 3 * j + 3]) for j in range(6)]
        )

    @property
    def n_local(self) -> int:
        """Local variables of all segments."""
        return int(LOCAL * self.counts.sum())

    @property
    def groups(self) -> tuple[Group, ...]:
        """The frames' variables (78,)."""
        kinds = {"place": ("xyz", "m"), "attitude": ("wxyz", "1"), "velocity": ("xyz", "m/s"), "spin": ("xyz", "rad/s")}
        return tuple(
            Group(name, tuple(f"segment {j + 1} {name} {a}" for j in range(COUNT) for a in axes), unit)
            for name, (axes, unit) in kinds.items()
        )

    def split(self, states: np.ndarray, like: np.ndarray | None = None) -> tuple[np.ndarray, np.ndarray]:
        """Return frames (n, 78) and local states (n, n_local) of states (n, 138).

        The signs of quaternions are those of `like` (n, 78); without it those of the root at rest. All
        segments take the root's sign.
        """
        states = np.ascontiguousarray(states, float)
        frames, local = np.empty((len(states), FRAME * COUNT)), np.empty((len(states), self.n_local))
        likes = np.broadcast_to(self.rest, frames.shape) if like is None else np.ascontiguousarray(like, float)
        _split_all(states, likes, *self._layout(), frames, local)
        self._align(frames)
        return frames, local

    @staticmethod
    def _align(frames: np.ndarray) -> None:
        """Give all quaternions of a state the sign of the root's, in place."""
        quaternions = frames[:, ATTITUDE:VELOCITY].reshape(-1, COUNT, 4)
        against = np.einsum("nja,na->nj", quaternions, quaternions[:, 2]) < 0
        quaternions[against] *= -1.0

    def _layout(self):
        return self.mass, self.members, self.counts, self.along, self.across, self.shape

    def assemble(self, frames: np.ndarray, local: np.ndarray) -> np.ndarray:
        """Return states (n, 138) of frames (n, 78) and local states (n, n_local)."""
        states = np.empty((len(frames), 6 * NODES))
        frames, local = np.ascontiguousarray(frames, float), np.ascontiguousarray(local, float)
        _assemble_all(frames, local, self.members, self.counts, self.shape, self.shared, states)
        return states

    def local_inputs(self, frames: np.ndarray, local: np.ndarray, j: int) -> np.ndarray:
        """Return what the local net of segment `j` is told of the state, (n, 6 k + 36)."""
        out = np.empty((len(frames), CENTRES))
        _centres_all(np.ascontiguousarray(frames, float), j, self.spacing[j], out)
        return np.concatenate([local[:, self.places[j]], out], axis=1)
