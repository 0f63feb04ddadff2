"""One-sided springs: joint limits, cords and contacts, treated alike and fully implicitly.

A stop has an overlap o (how far the limit, the slack or the surface has been passed), the overlap's slope g in the
velocities, a stiffness k and a damping d. It pushes back with N = k o + d o', never sucks, and is put into the step
at the step's end, o + h o'. Which stops push is settled with the step: it is guessed from the present velocity and
corrected from the solution. So a stop that is met within a step cannot add energy.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from anthro.body.paths import add_square, rates

LIMIT_STIFFNESS = 800.0  # N m/rad beyond the anatomical range
LIMIT_DAMPING = 4.0  # N m s/rad beyond the anatomical range
TOLERANCE = 1e-9  # overlaps in rad or m, forces in N or N m


class Stops:
    """A set of stops, in rows one behind the other as :class:`~anthro.body.paths.Paths`.

    Parameters
    ----------
    columns : for each stop the velocities that it depends on.
    stiffness, damping : (s,).

    Attributes
    ----------
    overlap : (s,) m or rad, -inf where there is nothing to meet.  value : slopes of the overlap.
    rate : (s,) o' at the present velocity.  active : (s,) whether it pushes in this step.
    load : (s,) the push expected at the step's end, N or N m.
    """

    def __init__(self, columns, stiffness, damping):
        count = len(columns)
        self.start = np.cumsum([0] + [len(row) for row in columns])
        self.column = np.concatenate([*columns, np.empty(0)]).astype(np.int64)
        self.value = np.zeros(len(self.column))
        self.stiffness = np.array(stiffness, float)
        self.damping = np.array(damping, float)
        self.overlap = np.full(count, -np.inf)
        self.rate, self.load = np.zeros(count), np.zeros(count)
        self.active = np.zeros(count, bool)

    def __len__(self) -> int:
        return len(self.overlap)

    def refresh(self, v) -> None:
        """Rates of overlap at velocities ``v`` (nv,)."""
        rates(self.start, self.column, self.value, v, self.rate)

    def force(self) -> np.ndarray:
        """Pushes (s,) in the present state, N or N m."""
        push = self.stiffness * self.overlap + self.damping * self.rate
        return np.where(self.overlap > 0.0, np.maximum(push, 0.0), 0.0)

    def energy(self) -> float:
        """Energy stored in the springs, J."""
        return float(0.5 * self.stiffness @ np.square(np.maximum(self.overlap, 0.0)))

    def guess(self, h: float) -> None:
        """Expect those to push that overlap at the end of a step at the present velocity."""
        _guess(h, self.overlap, self.rate, self.stiffness, self.damping, self.load, self.active)

    def add(self, lower, force, h: float) -> None:
        """Put the active stops into the step's system (see :func:`anthro.body.paths.add_springs`)."""
        _add(
            lower,
            force,
            self.start,
            self.column,
            self.value,
            self.overlap,
            self.rate,
            h,
            self.stiffness,
            self.damping,
            self.active,
        )

    def correct(self, velocity, h: float) -> bool:
        """Compare with the step's end velocity (nv,); True when a stop had to be switched."""
        return _correct(
            velocity,
            h,
            self.start,
            self.column,
            self.value,
            self.overlap,
            self.stiffness,
            self.damping,
            self.load,
            self.active,
        )


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
def _guess(h, overlap, rate, stiffness, damping, load, active):
    for i in range(overlap.shape[0]):
        later = overlap[i] + h * rate[i]
        load[i] = stiffness[i] * later + damping[i] * rate[i]
        active[i] = later > 0.0 and load[i] > 0.0


@njit(cache=True)
def _add(lower, force, start, column, value, overlap, rate, h, stiffness, damping, active):
    for i in range(overlap.shape[0]):
        if active[i]:
            push = stiffness[i] * (overlap[i] + h * rate[i]) + damping[i] * rate[i]
            for k in range(start[i], start[i + 1]):
                force[column[k]] -= push * value[k]
            weight = h * damping[i] + h * h * stiffness[i]
            add_square(lower, column, value, start[i], start[i + 1], weight)


@njit(cache=True)
def _correct(velocity, h, start, column, value, overlap, stiffness, damping, load, active):
    switched = False
    for i in range(overlap.shape[0]):
        rate = 0.0
        for k in range(start[i], start[i + 1]):
            rate += value[k] * velocity[column[k]]
        later = overlap[i] + h * rate
        load[i] = stiffness[i] * later + damping[i] * rate
        if active[i] and load[i] < -TOLERANCE:
            active[i], switched = False, True
        elif not active[i] and later > TOLERANCE and load[i] > TOLERANCE:
            active[i], switched = True, True
    return switched
