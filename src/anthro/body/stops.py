"""One-sided springs: joint limits, cords and contacts, treated alike and fully implicitly.

A stop has an overlap o (how far the limit, the slack or the surface has been passed), the overlap's slope g in the
velocities, a stiffness k and a damping d. It pushes back with N = k o + d o', never sucks, and is put into the step
at the step's end, o + h o'. Which stops push is settled with the step: it is guessed from the present velocity and
corrected from the solution. So a stop that is met within a step cannot add energy.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from anthro.body.rows import add_row, add_square, dot, layout, rates

LIMIT_STIFFNESS = 2000.0  # N m/rad beyond the anatomical range
LIMIT_DAMPING = 10.0  # N m s/rad beyond the anatomical range
TOLERANCE = 1e-9  # overlaps in rad or m, forces in N or N m


class Stops:
    """A set of stops, in rows one behind the other (:mod:`anthro.body.rows`).

    Parameters
    ----------
    columns : for each stop the velocities that it depends on.
    stiffness, damping : (s,).
    step : s.

    Attributes
    ----------
    overlap : (s,) m or rad, -inf where there is nothing to meet.  value : slopes of the overlap.
    rate : (s,) o' at the present velocity.  active : (s,) whether it pushes in this step.
    load : (s,) the push expected at the step's end, N or N m.
    """

    def __init__(self, columns, stiffness, damping, step: float):
        count = len(columns)
        self.start, self.column = layout(columns)
        self.value = np.zeros(len(self.column))
        self.stiffness = np.array(stiffness, float)
        self.damping = np.array(damping, float)
        self.overlap = np.full(count, -np.inf)
        self.rate, self.load = np.zeros(count), np.zeros(count)
        self.active, self._added = np.zeros((2, count), bool)
        self._rows = self.start, self.column, self.value
        self._state = step, self.overlap, self.rate, self.stiffness, self.damping, self.load, self.active

    def __len__(self) -> int:
        return len(self.overlap)

    def part(self, stops: slice) -> tuple[np.ndarray, np.ndarray]:
        """Overlaps and slopes of some successive stops, views."""
        return self.overlap[stops], self.value[self.start[stops.start] : self.start[stops.stop]]

    def refresh_velocities(self, v) -> None:
        """Rates of overlap at velocities ``v`` (nv,)."""
        rates(*self._rows, v, self.rate)

    def force(self) -> np.ndarray:
        """Pushes (s,) in the present state, N or N m."""
        push = self.stiffness * self.overlap + self.damping * self.rate
        return np.where(self.overlap > 0.0, np.maximum(push, 0.0), 0.0)

    def energy(self) -> float:
        """Energy stored in the springs, J."""
        return float(0.5 * self.stiffness @ np.square(np.maximum(self.overlap, 0.0)))

    def guess(self) -> None:
        """Expect those to push that overlap at the end of a step at the present velocity."""
        _guess(*self._state)

    def add(self, lower, force) -> None:
        """Put the active stops into the step's system (:class:`anthro.body.system.System`)."""
        _add(lower, force, *self._rows, *self._state, self._added)

    def list_changes(self, changes, count: int) -> int:
        """List stops that were switched since :meth:`add` (:class:`anthro.body.system.Changes`); the new count."""
        return _list_changes(*changes, count, *self._rows, *self._state, self._added)

    def correct(self, velocity) -> bool:
        """Compare with the step's end velocity (nv,); True when a stop had to be switched."""
        return _correct(velocity, *self._rows, *self._state)


@njit(cache=True)
def limit_torque(q, v, low, high):
    """Torque of the limit springs (m,) N m at angles and velocities (m,): none inside the range."""
    torque = np.zeros_like(q)
    for j in range(q.shape[0]):
        over = max(q[j] - high[j], 0.0) + min(q[j] - low[j], 0.0)
        if over != 0.0:
            pull = -LIMIT_STIFFNESS * over - LIMIT_DAMPING * v[j]
            # a limit pushes back and never sucks
            torque[j] = min(pull, 0.0) if over > 0.0 else max(pull, 0.0)
    return torque


@njit(cache=True)
def meet_limits(q, low, high, overlap, slope):
    """Overlaps (m,) rad and slopes (m,) of joint limits, each joint's nearer one."""
    for j in range(q.shape[0]):
        upper = q[j] - high[j] > low[j] - q[j]
        overlap[j] = q[j] - high[j] if upper else low[j] - q[j]
        slope[j] = 1.0 if upper else -1.0


@njit(cache=True)
def meet_cords(length, low, high, start, value, chosen, overlap, slope):
    """Overlaps (c,) m and slopes of the cords ``chosen`` (c,) of all paths, each one's nearer bound."""
    k = 0
    for j in range(chosen.shape[0]):
        i = chosen[j]
        long = length[i] - high[j] > low[j] - length[i]
        overlap[j] = length[i] - high[j] if long else low[j] - length[i]
        for source in range(start[i], start[i + 1]):
            slope[k] = value[source] if long else -value[source]
            k += 1


@njit(cache=True)
def _guess(h, overlap, rate, stiffness, damping, load, active):
    for i in range(overlap.shape[0]):
        later = overlap[i] + h * rate[i]
        load[i] = stiffness[i] * later + damping[i] * rate[i]
        active[i] = later > 0.0 and load[i] > 0.0


@njit(cache=True)
def _terms(i, h, overlap, rate, stiffness, damping):
    """A stop's push at the end of a step at the present velocity, and its weight in the system."""
    push = stiffness[i] * (overlap[i] + h * rate[i]) + damping[i] * rate[i]
    return push, h * damping[i] + h * h * stiffness[i]


@njit(cache=True)
def _add(lower, force, start, column, value, h, overlap, rate, stiffness, damping, load, active, added):
    for i in range(overlap.shape[0]):
        added[i] = active[i]
        if active[i]:
            push, weight = _terms(i, h, overlap, rate, stiffness, damping)
            add_row(force, start, column, value, i, -push)
            add_square(lower, start, column, value, i, weight)


@njit(cache=True)
def _list_changes(
    slope, weights, pushes, count, start, column, value, h, overlap, rate, stiffness, damping, load, active, added
):
    for i in range(overlap.shape[0]):
        if active[i] != added[i]:
            sign = 1.0 if active[i] else -1.0
            push, weight = _terms(i, h, overlap, rate, stiffness, damping)
            slope[count] = 0.0
            add_row(slope[count], start, column, value, i, 1.0)
            weights[count], pushes[count] = sign * weight, -sign * push
            count += 1
    return count


@njit(cache=True)
def _correct(velocity, start, column, value, h, overlap, rate, stiffness, damping, load, active):
    switched = False
    for i in range(overlap.shape[0]):
        after = dot(start, column, value, i, velocity)
        later = overlap[i] + h * after
        load[i] = stiffness[i] * later + damping[i] * after
        if active[i] and load[i] < -TOLERANCE:
            active[i], switched = False, True
        elif not active[i] and later > TOLERANCE and load[i] > TOLERANCE:
            active[i], switched = True, True
    return switched
