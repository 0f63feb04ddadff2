"""Which rays may meet which parts, compiled: by the ball around each part, many rays at once, then by its box.

Numbers are single precision. Rays are columns (6, n): origins, m, and unit directions in the world; ``reach`` (n,) says
how far each of them still looks, m, and is 0 for one that looks no more. A ball (4,) is its centre and its radius, m.
"""

from __future__ import annotations

import numpy as np
from numba import njit

COMPILED = {"cache": True, "error_model": "numpy"}
SMALL = np.float32(1e-12)
TILE = 512  # rays that are tried at once: their columns fit the innermost cache
SLACK = np.float32(1e-6)  # share of a squared distance that rounding may take


@njit(**COMPILED)
def pass_ball(columns, reach, ball, begin, end, passing):
    """Tell in ``passing``, filled from the front, whether each of the rays `begin` to `end` may meet a ball.

    Without branches, so that it runs on several rays at once. The test errs only towards passing.

    Returns
    -------
    bool
        Whether any may.
    """
    a, b, c, radius = ball[0], ball[1], ball[2], ball[3]
    square = radius * radius
    ox, oy, oz = columns[0][begin:end], columns[1][begin:end], columns[2][begin:end]
    dx, dy, dz = columns[3][begin:end], columns[4][begin:end], columns[5][begin:end]
    looks = reach[begin:end]
    found = False
    for i in range(len(looks)):
        x, y, z = a - ox[i], b - oy[i], c - oz[i]
        ahead = x * dx[i] + y * dy[i] + z * dz[i]
        away = x * x + y * y + z * z
        near = (looks[i] > 0) & (ahead > -radius) & (ahead - radius < looks[i])
        passes = near & (away - ahead * ahead < square + SLACK * away) & ((ahead > 0) | (away < square))
        passing[i] = passes
        found |= passes
    return found


@njit(**COMPILED)
def reachable(columns, reach, balls):
    """Whether any ray may meet each of the balls (p, 4): (p,)."""
    found, passing = np.zeros(len(balls), np.bool_), np.empty(TILE, np.bool_)
    for begin in range(0, len(reach), TILE):
        end = min(begin + TILE, len(reach))
        for k in range(len(balls)):
            if not found[k]:
                found[k] = pass_ball(columns, reach, balls[k], begin, end, passing)
    return found


@njit(**COMPILED)
def gather(columns, reach, ball, rotation, position, low, high, chosen, starts, ways):
    """Rays that pass the ball and the box around a part, carried into the part's frame.

    Parameters
    ----------
    rotation, position : ndarray (3, 3), (3,)
        From the part's frame to the world.
    low, high : ndarray (3,)
        Corners of the box in the part's frame.
    chosen, starts, ways : ndarray (n,) int32, (n, 3), (n, 3)
        Filled from the front: index, origin and direction of each such ray.

    Returns
    -------
    int
        How many there are.
    """
    count = 0
    passing = np.empty(TILE, np.bool_)
    for begin in range(0, len(reach), TILE):
        end = min(begin + TILE, len(reach))
        if not pass_ball(columns, reach, ball, begin, end, passing):
            continue
        for i in range(begin, end):
            if not passing[i - begin]:
                continue
            near, far = np.float32(0.0), reach[i]
            for k in range(3):
                at, slope = np.float32(0.0), np.float32(0.0)
                for j in range(3):
                    at += (columns[j, i] - position[j]) * rotation[j, k]
                    slope += columns[3 + j, i] * rotation[j, k]
                starts[count, k], ways[count, k] = at, slope
                if abs(slope) < SMALL:
                    slope = SMALL
                enter, leave = (low[k] - at) / slope, (high[k] - at) / slope
                near, far = max(near, min(enter, leave)), min(far, max(enter, leave))
            if near <= far:
                chosen[count] = i
                count += 1
    return count
