"""The shortest way of a string around a sphere or a cylinder, compiled.

Cases and their choice are those of MuJoCo's ``mju_wrap``, so that a path measured here is the one that MuJoCo measures
and draws. A string that stays outside leaves along tangents of the circle in which the surface meets the string's
plane (sphere) or seen along its axis (cylinder, where it then climbs evenly). It passes on that side where the side
point is, and does not wrap where the straight line is free. A side point within the surface keeps the string inside:
it is then bent at one point, where it is reflected.
"""

from __future__ import annotations

import math

from numba import njit

_TINY = 1e-15
_ROUNDS, _TOLERANCE, _FIRST = 20, 1e-6, 1.0 - 1e-7  # of Newton's method for the point of reflection
FREE = (-1.0, 0.0, 0.0, 0.0, 0.0)  # the straight line is free


@njit(cache=True, forceinline=True)
def _unit(x, y):
    size = math.hypot(x, y)
    return (x / size, y / size) if size > _TINY else (1.0, 0.0)


@njit(cache=True, forceinline=True)
def _cross_each_other(ax, ay, bx, by, cx, cy, dx, dy):
    """Whether the segments from a to b and from c to d meet."""
    area = (dy - cy) * (bx - ax) - (dx - cx) * (by - ay)
    if abs(area) < _TINY:
        return False
    along = ((dx - cx) * (ay - cy) - (dy - cy) * (ax - cx)) / area
    across = ((bx - ax) * (ay - cy) - (by - ay) * (ax - cx)) / area
    return 0.0 <= along <= 1.0 and 0.0 <= across <= 1.0


@njit(cache=True, error_model="numpy", forceinline=True)
def _around(ax, ay, bx, by, sided, sx, sy, radius):
    """Around a circle from a to b, past the unit vector s if ``sided``: arc length and the two points of touch."""
    a2, b2, r2 = ax * ax + ay * ay, bx * bx + by * by, radius * radius
    dx, dy = bx - ax, by - ay
    d2 = dx * dx + dy * dy
    if a2 < r2 or b2 < r2 or radius < _TINY or d2 < _TINY:
        return FREE
    nearest = min(max(-(dx * ax + dy * ay) / d2, 0.0), 1.0)
    nx, ny = ax + nearest * dx, ay + nearest * dy
    if nx * nx + ny * ny > r2 and (not sided or sx * nx + sy * ny >= 0.0):
        return FREE
    a_leg, b_leg = math.sqrt(a2 - r2), math.sqrt(b2 - r2)
    best, way, crossed = 0.0, (0.0, 0.0, 0.0, 0.0), False
    turn = 0.0
    for sense in (1.0, -1.0):
        px, py = (ax * r2 + sense * radius * ay * a_leg) / a2, (ay * r2 - sense * radius * ax * a_leg) / a2
        qx, qy = (bx * r2 - sense * radius * by * b_leg) / b2, (by * r2 + sense * radius * bx * b_leg) / b2
        if sided:
            mx, my = _unit(px + qx, py + qy)
            good = mx * sx + my * sy
        else:
            good = -((px - qx) ** 2 + (py - qy) ** 2)
        cross = _cross_each_other(ax, ay, px, py, bx, by, qx, qy)
        if cross:
            good = -10000.0
        if turn == 0.0 or good >= best:
            best, way, crossed, turn = good, (px, py, qx, qy), cross, sense
    if crossed:
        return FREE
    px, py, qx, qy = way
    angle = math.atan2(turn * (py * qx - px * qy), px * qx + py * qy)
    if angle < 0.0:
        angle += 2.0 * math.pi
    return radius * angle, px, py, qx, qy


@njit(cache=True, forceinline=True)
def _miss(z, a, b, between):
    """By how much the angles at the point of reflection fail to add up; z is the sine of that of reflection."""
    return math.asin(a * z) + math.asin(b * z) - 2.0 * math.asin(z) + between


@njit(cache=True, error_model="numpy", forceinline=True)
def _sine_of_reflection(a, b, between):
    """Root of :func:`_miss` by Newton's method from above, where it is negative; -1 where there is none."""
    z = _FIRST
    miss = _miss(z, a, b, between)
    if miss > 0.0:  # the straight line all but touches the circle
        return z
    for _ in range(_ROUNDS):
        if abs(miss) <= _TOLERANCE:
            return z
        slope = a / math.sqrt(1.0 - z * z * a * a) + b / math.sqrt(1.0 - z * z * b * b) - 2.0 / math.sqrt(1.0 - z * z)
        if slope > -_TINY or miss > _TOLERANCE or miss / slope < 0.0:
            return -1.0
        z -= miss / slope
        miss = _miss(z, a, b, between)
    return z if abs(miss) <= _TOLERANCE else -1.0


@njit(cache=True, error_model="numpy", forceinline=True)
def _within(ax, ay, bx, by, radius):
    """From a to b by way of the circle's inside: arc length 0 and the point of reflection, twice."""
    a_size, b_size = math.hypot(ax, ay), math.hypot(bx, by)
    dx, dy = bx - ax, by - ay
    d2 = dx * dx + dy * dy
    if a_size <= radius or b_size <= radius or radius < _TINY:
        return FREE
    if d2 > _TINY:
        nearest = -(dx * ax + dy * ay) / d2
        if 0.0 < nearest < 1.0 and math.hypot(ax + nearest * dx, ay + nearest * dy) <= radius:
            return FREE
    cosine = (a_size * a_size + b_size * b_size - d2) / (2.0 * a_size * b_size)
    if cosine < -1.0 + _TINY:
        return FREE
    z = -1.0
    if cosine <= 1.0 - _TINY:
        z = _sine_of_reflection(radius / a_size, radius / b_size, math.acos(cosine))
    if z < 0.0:  # no such point: midway
        x, y = _unit(ax + bx, ay + by)
        return 0.0, radius * x, radius * y, radius * x, radius * y
    if ax * by - ay * bx > 0.0:
        x, y, angle = ax / a_size, ay / a_size, math.asin(z) - math.asin(radius / a_size * z)
    else:
        x, y, angle = bx / b_size, by / b_size, math.asin(z) - math.asin(radius / b_size * z)
    c, s = radius * math.cos(angle), radius * math.sin(angle)
    return 0.0, c * x - s * y, s * x + c * y, c * x - s * y, s * x + c * y


@njit(cache=True, forceinline=True)
def _into(point, centre, frame):
    """A point in the surface's frame."""
    x, y, z = point[0] - centre[0], point[1] - centre[1], point[2] - centre[2]
    return (
        frame[0] * x + frame[3] * y + frame[6] * z,
        frame[1] * x + frame[4] * y + frame[7] * z,
        frame[2] * x + frame[5] * y + frame[8] * z,
    )


@njit(cache=True, forceinline=True)
def _out_of(x, y, z, centre, frame):
    """A point of the surface's frame in the world."""
    return (
        centre[0] + frame[0] * x + frame[1] * y + frame[2] * z,
        centre[1] + frame[3] * x + frame[4] * y + frame[5] * z,
        centre[2] + frame[6] * x + frame[7] * y + frame[8] * z,
    )


@njit(cache=True, error_model="numpy", forceinline=True)
def _plane(a, b):
    """Two axes of the plane through the origin, a and b, the first along a."""
    size = math.sqrt(a[0] * a[0] + a[1] * a[1] + a[2] * a[2])
    ux, uy, uz = a[0] / size, a[1] / size, a[2] / size
    nx, ny, nz = a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]
    if math.sqrt(nx * nx + ny * ny + nz * nz) < _TINY:  # in line: any plane
        ox, oy, oz = 1.0, 1.0, 1.0
        if abs(uy) > abs(ux) and abs(uy) > abs(uz):
            oy = 0.0
        elif abs(uz) > abs(ux) and abs(uz) > abs(uy):
            oz = 0.0
        else:
            ox = 0.0
        nx, ny, nz = uy * oz - uz * oy, uz * ox - ux * oz, ux * oy - uy * ox
    vx, vy, vz = ny * uz - nz * uy, nz * ux - nx * uz, nx * uy - ny * ux
    size = math.sqrt(vx * vx + vy * vy + vz * vz)
    return (ux, uy, uz), (vx / size, vy / size, vz / size)


@njit(cache=True, forceinline=True)
def _dot(a, b):
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@njit(cache=True, error_model="numpy", forceinline=True)
def wrap(start, end, side, sided, centre, frame, radius, cylinder):
    """Way of a string from ``start`` to ``end`` over a surface.

    Parameters
    ----------
    start, end, side : (3,) points in the world, m; ``side`` counts if ``sided``.
    centre, frame : (3,) and (9,) of the surface; a cylinder's axis is the frame's third column.
    radius : m.  cylinder : whether it is one, without ends, and no sphere.

    Returns
    -------
    tuple
        Length on the surface in m, -1 where the string does not touch; the points (3,) where it comes and leaves.
    """
    a, b = _into(start, centre, frame), _into(end, centre, frame)
    nowhere = (-1.0, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
    if _dot(a, a) < _TINY * _TINY or _dot(b, b) < _TINY * _TINY:
        return nowhere
    u, v = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0)) if cylinder else _plane(a, b)
    ax, ay, bx, by = _dot(a, u), _dot(a, v), _dot(b, u), _dot(b, v)
    inside, sx, sy = False, 0.0, 0.0
    if sided:
        s = _into(side, centre, frame)
        inside = _dot(s, s) < radius * radius
        sx, sy = _unit(_dot(s, u), _dot(s, v))
    if inside:
        length, px, py, qx, qy = _within(ax, ay, bx, by, radius)
    else:
        length, px, py, qx, qy = _around(ax, ay, bx, by, sided, sx, sy, radius)
    if length < 0.0:
        return nowhere
    p = px * u[0] + py * v[0], px * u[1] + py * v[1], px * u[2] + py * v[2]
    q = qx * u[0] + qy * v[0], qx * u[1] + qy * v[1], qx * u[2] + qy * v[2]
    if cylinder:
        before, after = math.hypot(ax - px, ay - py), math.hypot(bx - qx, by - qy)
        climb = (b[2] - a[2]) / (before + length + after)
        p = p[0], p[1], a[2] + climb * before
        q = q[0], q[1], a[2] + climb * (before + length)
        length = math.hypot(length, q[2] - p[2])
    return length, _out_of(p[0], p[1], p[2], centre, frame), _out_of(q[0], q[1], q[2], centre, frame)
