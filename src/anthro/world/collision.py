"""When flying balls first meet capsules and rectangles: conservative advancement, so that no speed lets one through.

A ball is a sphere in free fall. A capsule's line moves evenly over the interval looked at; a rectangle stands still.
Their gap shrinks no faster than the sum of the largest speeds, so a ball may fly for gap over that sum before it is
looked at again (Mirtich, Impulse-based Dynamic Simulation of Rigid Body Systems, PhD thesis, Berkeley 1996).
"""

from __future__ import annotations

import numpy as np
from numba import njit

TOUCH = 1e-5  # m, a gap that counts as none
STRIDE = 1e-4  # m, the least that a ball in contact moves before it is looked at again
NONE = -1


@njit(cache=True)
def fly(position, velocity, clock, gravity, until):
    """Move one ball (3,) in free fall from its clock to the time ``until``, exactly."""
    step = until - clock
    for axis in range(3):
        position[axis] += step * (velocity[axis] + 0.5 * step * gravity[axis])
        velocity[axis] += step * gravity[axis]


@njit(cache=True)
def nearest(point, back, shape, ends, speeds, centres, axes, halves, near, motion):
    """Write the nearest point (3,) of a shape's line or rectangle, and its velocity (3,); its share along the line.

    Shapes are numbered capsules first. ``ends`` are those of the interval's end, ``back`` s later.
    """
    if shape < ends.shape[0]:
        along, square = 0.0, 0.0
        for axis in range(3):
            first = ends[shape, 0, axis] - back * speeds[shape, 0, axis]
            edge = ends[shape, 1, axis] - back * speeds[shape, 1, axis] - first
            along += (point[axis] - first) * edge
            square += edge * edge
        share = min(max(along / square, 0.0), 1.0) if square > 0.0 else 0.0
        for axis in range(3):
            motion[axis] = (1.0 - share) * speeds[shape, 0, axis] + share * speeds[shape, 1, axis]
            near[axis] = (1.0 - share) * ends[shape, 0, axis] + share * ends[shape, 1, axis] - back * motion[axis]
        return share
    k = shape - ends.shape[0]
    near[:], motion[:] = centres[k], 0.0
    for side in range(2):
        place = 0.0
        for axis in range(3):
            place += (point[axis] - centres[k, axis]) * axes[k, side, axis]
        place = min(max(place, -halves[k, side]), halves[k, side])
        for axis in range(3):
            near[axis] += place * axes[k, side, axis]
    return 0.0


@njit(cache=True)
def contact(point, velocity, near, motion, normal):
    """Write the direction (3,) from the nearest point to a ball's centre; their distance and the speed of approach."""
    distance = 0.0
    for axis in range(3):
        normal[axis] = point[axis] - near[axis]
        distance += normal[axis] ** 2
    distance = np.sqrt(distance)
    if distance > 0.0:
        for axis in range(3):
            normal[axis] /= distance
    else:
        normal[2] = 1.0
    approach = 0.0
    for axis in range(3):
        approach += (motion[axis] - velocity[axis]) * normal[axis]
    return distance, approach


@njit(cache=True)
def _speed(v, w, gravity, step):
    """Largest speed of v - w + gravity t for t from 0 to ``step``, or more: a norm is convex."""
    start, end = 0.0, 0.0
    for axis in range(3):
        start += (v[axis] - w[axis]) ** 2
        end += (v[axis] - w[axis] + step * gravity[axis]) ** 2
    return np.sqrt(max(start, end))


@njit(cache=True)
def first_meeting(
    position, velocity, clock, radius, playing, gravity, seconds, ends, speeds, thickness, centres, axes, halves
):
    """The first time that a ball meets a shape that it approaches.

    Parameters
    ----------
    position, velocity : (n, 3) of the balls at their own ``clock`` (n,).  radius, playing : (n,).
    seconds : the interval's end, counted as the clocks are.
    ends, speeds, thickness : (k, 2, 3), (k, 2, 3), (k,) of the capsules at the interval's end.
    centres, axes, halves : (s, 3), (s, 3, 3), (s, 2) of the rectangles.

    Returns
    -------
    tuple
        Ball, shape and time; the ball is `NONE` where no one meets any.
    """
    found, what, when = NONE, NONE, seconds
    point, speed, near, motion, normal = (np.zeros(3), np.zeros(3), np.zeros(3), np.zeros(3), np.zeros(3))
    for ball in range(radius.shape[0]):
        if not playing[ball]:
            continue
        for shape in range(ends.shape[0] + centres.shape[0]):
            margin, still = radius[ball], np.zeros(3)
            left = seconds - clock[ball]
            if shape < ends.shape[0]:
                margin += thickness[shape]
                bound = max(
                    _speed(velocity[ball], speeds[shape, 0], gravity, left),
                    _speed(velocity[ball], speeds[shape, 1], gravity, left),
                )
            else:
                bound = _speed(velocity[ball], still, gravity, left)
            bound = max(bound, 1e-9)
            time = clock[ball]
            while time < when:
                point[:], speed[:] = position[ball], velocity[ball]
                fly(point, speed, clock[ball], gravity, time)
                nearest(point, seconds - time, shape, ends, speeds, centres, axes, halves, near, motion)
                distance, approach = contact(point, speed, near, motion, normal)
                gap = distance - margin
                if gap <= TOUCH and approach > 0.0:
                    found, what, when = ball, shape, time
                    break
                time += max(gap, TOUCH if approach > 0.0 else STRIDE) / bound
    return found, what, when
