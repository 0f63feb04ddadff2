"""Which velocities lengthen which path, and compiled sums over them.

MuJoCo stores dl/dq of a tendon for every joint above any bone that it touches. A joint above all of them moves
the path as a whole and changes no length, so its entry is zero; dropping those leaves a third of the numbers.
Rows are kept one behind the other: row i is entries ``start[i]`` to ``start[i + 1]`` of ``column`` and ``value``.
"""

from __future__ import annotations

import mujoco
import numpy as np
from numba import njit

_WRAP = mujoco.mjtWrap
_BODY_OF = {
    int(_WRAP.mjWRAP_SITE): "site_bodyid",
    int(_WRAP.mjWRAP_SPHERE): "geom_bodyid",
    int(_WRAP.mjWRAP_CYLINDER): "geom_bodyid",
}


class Paths:
    """The nonzero part of dl/dq of all tendons of a model.

    Attributes
    ----------
    start : (t + 1,).  column : (nnz,) velocities, ascending in each row.  value : (nnz,) m or m/rad.
    """

    def __init__(self, model: mujoco.MjModel, data: mujoco.MjData):
        rows = [_moving_entries(model, tendon) for tendon in range(model.ntendon)]
        self.start = np.cumsum([0] + [len(row) for row in rows])
        self._source = np.concatenate([*rows, np.empty(0, int)]).astype(np.int64)
        self.column = model.ten_J_colind[self._source].astype(np.int64)
        self.value = np.zeros(len(self.column))
        self._full = data.ten_J

    def refresh(self) -> None:
        """Take over the entries that :func:`mujoco.mj_tendon` has written."""
        np.take(self._full, self._source, out=self.value, mode="clip")

    def dense(self, rows: int, width: int) -> np.ndarray:
        """dl/dq of the first ``rows`` tendons by ``width`` velocities, a new array."""
        jacobian = np.zeros((rows, width))
        _scatter(self.start, self.column, self.value, jacobian)
        return jacobian


def _moving_entries(model, tendon: int) -> np.ndarray:
    """Entries of ``ten_J`` of the joints that lie above some bone of the path but not above all."""
    first = model.tendon_adr[tendon]
    elements = range(first, first + model.tendon_num[tendon])
    bodies = {
        int(getattr(model, _BODY_OF[kind])[model.wrap_objid[k]])
        for k in elements
        if (kind := int(model.wrap_type[k])) in _BODY_OF
    }
    chains = [set(velocities_above(model, body)) for body in bodies]
    moving = set.union(*chains) - set.intersection(*chains)
    first = model.ten_J_rowadr[tendon]
    entries = np.arange(first, first + model.ten_J_rownnz[tendon])
    return entries[[column in moving for column in model.ten_J_colind[entries]]]


def velocities_above(model, body: int) -> list[int]:
    """Velocities that move a body, ascending."""
    above = []
    while body > 0:
        first = model.body_dofadr[body]
        above += range(first, first + model.body_dofnum[body])
        body = model.body_parentid[body]
    return sorted(above)


@njit(cache=True)
def _scatter(start, column, value, out):
    for i in range(out.shape[0]):
        for k in range(start[i], start[i + 1]):
            out[i, column[k]] = value[k]


@njit(cache=True)
def rates(start, column, value, v, out):
    """Rates of lengthening dl/dt (t,) at velocities ``v``."""
    for i in range(out.shape[0]):
        total = 0.0
        for k in range(start[i], start[i + 1]):
            total += value[k] * v[column[k]]
        out[i] = total


@njit(cache=True, fastmath={"contract"})
def add_square(lower, column, value, first, last, weight):
    """Add ``weight`` times the outer square of one row to the lower triangle ``lower``."""
    for a in range(first, last):
        left = weight * value[a]
        row = lower[column[a]]
        for b in range(first, a + 1):
            row[column[b]] += left * value[b]


@njit(cache=True)
def add_springs(lower, force, start, column, value, rate, h, tension, stiffness, damping):
    """Put tensions (t,) N and their slopes in length and speed into the step's system.

    Adds J^T (h d + h^2 k) J to the lower triangle and -J^T (f + h k l') to the force.
    """
    for i in range(tension.shape[0]):
        pull = tension[i] + h * stiffness[i] * rate[i]
        if pull != 0.0:
            for k in range(start[i], start[i + 1]):
                force[column[k]] -= pull * value[k]
        weight = h * damping[i] + h * h * stiffness[i]
        if weight > 0.0:
            add_square(lower, column, value, start[i], start[i + 1], weight)
