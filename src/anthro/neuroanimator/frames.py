"""Compiled changes between world and local coordinates of one state, and their derivatives backwards.

A frame says what the dynamics are invariant under (Grzeszczuk 1998, Sec. 3.2):

* ``fixed``: nothing; the state is its own local state (a pendulum that hangs from a hinge).
* ``planar``: place and heading on the ground (6 variables: place, heading, velocity, yaw rate).
* ``heading``: place and turning about the vertical, as gravity tells up from down (13 variables: place, quaternion,
  velocity, spin in the body). The heading is the quaternion's twist about z.
* ``body``: place and every rotation, seen from one of several bodies (13 variables each: all places, all quaternions,
  all velocities, all spins in the world); the body `ROOT` is the frame.

A local state is the difference from the local state at rest, so that groups of variables have means near zero.
"""

from __future__ import annotations

import numpy as np
from numba import njit

FRAMES = {"fixed": 0, "planar": 1, "heading": 2, "body": 3}
ROOT = 2  # body segment of the dolphin that is its frame


@njit(cache=True)
def rotation(q, out):
    """Matrix (3, 3) of a unit quaternion."""
    w, x, y, z = q[0], q[1], q[2], q[3]
    out[0, 0], out[0, 1], out[0, 2] = 1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)
    out[1, 0], out[1, 1], out[1, 2] = 2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)
    out[2, 0], out[2, 1], out[2, 2] = 2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)


@njit(cache=True)
def _rotation_back(q, g, out):
    """Add to ``out`` (4,) the derivative by the quaternion, given that ``g`` (3, 3) by its matrix."""
    w, x, y, z = q[0], q[1], q[2], q[3]
    out[0] += 2 * (-z * g[0, 1] + y * g[0, 2] + z * g[1, 0] - x * g[1, 2] - y * g[2, 0] + x * g[2, 1])
    out[1] += 2 * (y * (g[0, 1] + g[1, 0]) + z * (g[0, 2] + g[2, 0]) - 2 * x * (g[1, 1] + g[2, 2]))
    out[1] += 2 * w * (g[2, 1] - g[1, 2])
    out[2] += 2 * (x * (g[0, 1] + g[1, 0]) + z * (g[1, 2] + g[2, 1]) - 2 * y * (g[0, 0] + g[2, 2]))
    out[2] += 2 * w * (g[0, 2] - g[2, 0])
    out[3] += 2 * (x * (g[0, 2] + g[2, 0]) + y * (g[1, 2] + g[2, 1]) - 2 * z * (g[0, 0] + g[1, 1]))
    out[3] += 2 * w * (g[1, 0] - g[0, 1])


@njit(cache=True)
def product(p, q, sign, out):
    """``p q`` (4,), or ``conjugate(p) q`` where ``sign`` is -1."""
    a, b, c, d = p[0], sign * p[1], sign * p[2], sign * p[3]
    out[0] = a * q[0] - b * q[1] - c * q[2] - d * q[3]
    out[1] = a * q[1] + b * q[0] + c * q[3] - d * q[2]
    out[2] = a * q[2] - b * q[3] + c * q[0] + d * q[1]
    out[3] = a * q[3] + b * q[2] - c * q[1] + d * q[0]


@njit(cache=True)
def _product_back(p, q, sign, g, by_p, by_q):
    """Add the derivatives of `product` by both factors, given ``g`` by the product."""
    a, b, c, d = p[0], sign * p[1], sign * p[2], sign * p[3]
    by_p[0] += g[0] * q[0] + g[1] * q[1] + g[2] * q[2] + g[3] * q[3]
    by_p[1] += sign * (-g[0] * q[1] + g[1] * q[0] - g[2] * q[3] + g[3] * q[2])
    by_p[2] += sign * (-g[0] * q[2] + g[1] * q[3] + g[2] * q[0] - g[3] * q[1])
    by_p[3] += sign * (-g[0] * q[3] - g[1] * q[2] + g[2] * q[1] + g[3] * q[0])
    by_q[0] += g[0] * a + g[1] * b + g[2] * c + g[3] * d
    by_q[1] += -g[0] * b + g[1] * a + g[2] * d - g[3] * c
    by_q[2] += -g[0] * c - g[1] * d + g[2] * a + g[3] * b
    by_q[3] += -g[0] * d + g[1] * c - g[2] * b + g[3] * a


@njit(cache=True)
def _turn(c, s, a, out, i, j):
    """Rotate the pair (i, j) of ``a`` into ``out``."""
    out[i], out[j] = c * a[i] - s * a[j], s * a[i] + c * a[j]


@njit(cache=True)
def _turned(c, s, a, g, i, j):
    """Derivative by the angle of `_turn`, given ``g`` by its result."""
    return g[i] * (-s * a[i] - c * a[j]) + g[j] * (c * a[i] - s * a[j])


@njit(cache=True)
def _half(s):
    """Cosine and sine of half the heading of a ``heading`` state, and the length of its twist."""
    length = np.sqrt(s[3] * s[3] + s[6] * s[6])
    return s[3] / length, s[6] / length, length


@njit(cache=True)
def localise(kind, s, rest, out):
    """Write a state (n,) in local coordinates, less its value at rest."""
    n = len(s)
    if kind == 0:
        out[:n] = s
    elif kind == 1:
        c, d = np.cos(s[2]), np.sin(s[2])
        out[0] = out[1] = out[2] = 0.0
        _turn(c, -d, s, out, 3, 4)
        out[5] = s[5]
    elif kind == 2:
        c, d, length = _half(s)
        out[0] = out[1] = out[2] = 0.0
        out[3], out[6] = length, 0.0
        _turn(c, -d, s, out, 4, 5)
        _turn(c * c - d * d, -2 * c * d, s, out, 7, 8)
        out[9:13] = s[9:13]
    else:
        _body_local(s, out)
    out[:n] -= rest


@njit(cache=True)
def _body_local(s, out):
    count = len(s) // 13
    quaternions, velocities, spins = 3 * count, 7 * count, 10 * count
    root = s[quaternions + 4 * ROOT : quaternions + 4 * ROOT + 4]
    matrix = np.empty((3, 3))
    rotation(root, matrix)
    for j in range(count):
        for a in range(3):
            place = velocity = spin = 0.0
            for b in range(3):
                place += matrix[b, a] * (s[3 * j + b] - s[3 * ROOT + b])
                velocity += matrix[b, a] * s[velocities + 3 * j + b]
                spin += matrix[b, a] * s[spins + 3 * j + b]
            out[3 * j + a], out[velocities + 3 * j + a], out[spins + 3 * j + a] = place, velocity, spin
        first = quaternions + 4 * j
        product(root, s[first : first + 4], -1.0, out[first : first + 4])


@njit(cache=True)
def localise_back(kind, s, g, out):
    """Add to ``out`` (n,) the derivative by the state, given ``g`` (n,) by its local coordinates."""
    n = len(s)
    if kind == 0:
        out += g[:n]
    elif kind == 1:
        c, d = np.cos(s[2]), np.sin(s[2])
        out[2] -= _turned(c, -d, s, g, 3, 4)
        out[3] += c * g[3] - d * g[4]
        out[4] += d * g[3] + c * g[4]
        out[5] += g[5]
    elif kind == 2:
        c, d, length = _half(s)
        whole, wholes = c * c - d * d, 2 * c * d
        angle = -_turned(c, -d, s, g, 4, 5) - 2 * _turned(whole, -wholes, s, g, 7, 8)
        out[3] += c * g[3] - d * angle / length
        out[6] += d * g[3] + c * angle / length
        out[4] += c * g[4] - d * g[5]
        out[5] += d * g[4] + c * g[5]
        out[7] += whole * g[7] - wholes * g[8]
        out[8] += wholes * g[7] + whole * g[8]
        out[9:13] += g[9:13]
    else:
        _body_local_back(s, g, out)


@njit(cache=True)
def _body_local_back(s, g, out):
    count = len(s) // 13
    quaternions, velocities, spins = 3 * count, 7 * count, 10 * count
    first = quaternions + 4 * ROOT
    root, by_root = s[first : first + 4], np.zeros(4)
    matrix, by_matrix = np.empty((3, 3)), np.zeros((3, 3))
    rotation(root, matrix)
    for j in range(count):
        for a in range(3):
            for b in range(3):
                place = g[3 * j + a] * matrix[b, a]
                out[3 * j + b] += place
                out[3 * ROOT + b] -= place
                out[velocities + 3 * j + b] += g[velocities + 3 * j + a] * matrix[b, a]
                out[spins + 3 * j + b] += g[spins + 3 * j + a] * matrix[b, a]
                by_matrix[b, a] += g[3 * j + a] * (s[3 * j + b] - s[3 * ROOT + b])
                by_matrix[b, a] += g[velocities + 3 * j + a] * s[velocities + 3 * j + b]
                by_matrix[b, a] += g[spins + 3 * j + a] * s[spins + 3 * j + b]
        k = quaternions + 4 * j
        _product_back(root, s[k : k + 4], -1.0, g[k : k + 4], by_root, out[k : k + 4])
    _rotation_back(root, by_matrix, by_root)
    out[first : first + 4] += by_root


@njit(cache=True)
def turn_out(kind, s, y, out):
    """Write a local change ``y`` (n,) of state ``s`` in world coordinates."""
    n = len(s)
    out[:] = y[:n]
    if kind == 1:
        c, d = np.cos(s[2]), np.sin(s[2])
        _turn(c, d, y, out, 0, 1)
        _turn(c, d, y, out, 3, 4)
    elif kind == 2:
        c, d, _ = _half(s)
        whole, wholes = c * c - d * d, 2 * c * d
        _turn(whole, wholes, y, out, 0, 1)
        _turn(c, d, y, out, 3, 6)
        _turn(c, d, y, out, 4, 5)
        _turn(whole, wholes, y, out, 7, 8)
    elif kind == 3:
        _body_turn(s, y, 1.0, out)


@njit(cache=True)
def turn_in(kind, s, change, out):
    """Write a world change (n,) of state ``s`` in local coordinates: the inverse of `turn_out`."""
    out[:] = change
    if kind == 1:
        c, d = np.cos(s[2]), np.sin(s[2])
        _turn(c, -d, change, out, 0, 1)
        _turn(c, -d, change, out, 3, 4)
    elif kind == 2:
        c, d, _ = _half(s)
        whole, wholes = c * c - d * d, 2 * c * d
        _turn(whole, -wholes, change, out, 0, 1)
        _turn(c, -d, change, out, 3, 6)
        _turn(c, -d, change, out, 4, 5)
        _turn(whole, -wholes, change, out, 7, 8)
    elif kind == 3:
        _body_turn(s, change, -1.0, out)


@njit(cache=True)
def _body_turn(s, y, sign, out):
    count = len(s) // 13
    quaternions = 3 * count
    root = s[quaternions + 4 * ROOT : quaternions + 4 * ROOT + 4]
    matrix = np.empty((3, 3))
    rotation(root, matrix)
    if sign < 0:
        matrix = matrix.T.copy()
    for k in range(len(s) // 3):
        first = 3 * k if k < count else 4 * count + 3 * k  # quaternions stand between places and velocities
        if first >= len(s):
            break
        for a in range(3):
            out[first + a] = matrix[a, 0] * y[first] + matrix[a, 1] * y[first + 1] + matrix[a, 2] * y[first + 2]
    for j in range(count):
        k = quaternions + 4 * j
        product(root, y[k : k + 4], sign, out[k : k + 4])


@njit(cache=True)
def turn_out_back(kind, s, y, g, by_state, by_change):
    """Add derivatives by state and by local change, given ``g`` (n,) by the world change."""
    n = len(s)
    if kind == 0:
        by_change[:n] += g
    elif kind == 1:
        c, d = np.cos(s[2]), np.sin(s[2])
        for i in (0, 3):
            by_state[2] += _turned(c, d, y, g, i, i + 1)
            by_change[i] += c * g[i] + d * g[i + 1]
            by_change[i + 1] += -d * g[i] + c * g[i + 1]
        by_change[2] += g[2]
        by_change[5] += g[5]
    elif kind == 2:
        c, d, length = _half(s)
        whole, wholes = c * c - d * d, 2 * c * d
        angle = 2 * (_turned(whole, wholes, y, g, 0, 1) + _turned(whole, wholes, y, g, 7, 8))
        angle += _turned(c, d, y, g, 3, 6) + _turned(c, d, y, g, 4, 5)
        by_state[3] -= d * angle / length
        by_state[6] += c * angle / length
        for i in (0, 7):
            by_change[i] += whole * g[i] + wholes * g[i + 1]
            by_change[i + 1] += -wholes * g[i] + whole * g[i + 1]
        for i, j in ((3, 6), (4, 5)):
            by_change[i] += c * g[i] + d * g[j]
            by_change[j] += -d * g[i] + c * g[j]
        by_change[2] += g[2]
        by_change[9:13] += g[9:13]
    else:
        _body_turn_back(s, y, g, by_state, by_change)


@njit(cache=True)
def _body_turn_back(s, y, g, by_state, by_change):
    count = len(s) // 13
    quaternions = 3 * count
    first = quaternions + 4 * ROOT
    root, by_root = s[first : first + 4], np.zeros(4)
    matrix, by_matrix = np.empty((3, 3)), np.zeros((3, 3))
    rotation(root, matrix)
    for block in range(3 * count):
        k = 3 * block if block < count else 4 * count + 3 * block
        for a in range(3):
            for b in range(3):
                by_change[k + b] += g[k + a] * matrix[a, b]
                by_matrix[a, b] += g[k + a] * y[k + b]
    for j in range(count):
        k = quaternions + 4 * j
        _product_back(root, y[k : k + 4], 1.0, g[k : k + 4], by_root, by_change[k : k + 4])
    _rotation_back(root, by_matrix, by_root)
    by_state[first : first + 4] += by_root


@njit(cache=True)
def _quaternions(kind, n):
    """First index and number of a state's quaternions."""
    if kind == 2:
        return 3, 1
    if kind == 3:
        return 3 * (n // 13), n // 13
    return 0, 0


@njit(cache=True)
def settle(kind, s):
    """Give a state's quaternions unit length, in place."""
    first, count = _quaternions(kind, len(s))
    for j in range(count):
        q = s[first + 4 * j : first + 4 * j + 4]
        q /= np.sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3])


@njit(cache=True)
def settle_back(kind, s, g):
    """Turn ``g`` (n,), the derivative by the settled state, into that by ``s``, the state before, in place."""
    first, count = _quaternions(kind, len(s))
    for j in range(count):
        q, h = s[first + 4 * j : first + 4 * j + 4], g[first + 4 * j : first + 4 * j + 4]
        square = q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]
        along = (q[0] * h[0] + q[1] * h[1] + q[2] * h[2] + q[3] * h[3]) / square
        length = np.sqrt(square)
        for a in range(4):
            h[a] = (h[a] - q[a] * along) / length
