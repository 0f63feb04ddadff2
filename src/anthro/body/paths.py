"""Lengths of all tendons, and which velocities change them.

MuJoCo stores dl/dq of a tendon for every joint above any bone that it touches. A joint above all of them moves
the path as a whole and changes no length, so its entry is zero; dropping those leaves a third of the numbers. Rows
are stored as in :mod:`anthro.body.rows`.
"""

from __future__ import annotations

import copy

import mujoco
import numpy as np
from numba import njit

from anthro.body import rows
from anthro.body.rows import INDEX, velocities_above
from anthro.body.strings import Strings, bone_of, elements, is_string


class Paths:
    """Lengths of all t tendons of a model, and the nonzero part of their slopes dl/dq.

    Attributes
    ----------
    length : (t,) m, MuJoCo's ``ten_length``.  rate : (t,) dl/dt, m/s.
    start : (t + 1,).  column : (nnz,) velocities, ascending in each row.  value : (nnz,) m or m/rad.
        MuJoCo's own ``ten_J`` holds only those that are left to it (:mod:`anthro.body.strings`).
    """

    def __init__(self, model: mujoco.MjModel, data: mujoco.MjData):
        entries = [_moving_entries(model, tendon) for tendon in range(model.ntendon)]
        self.start, self.column = rows.layout([model.ten_J_colind[row] for row in entries])
        self.value, self._width = np.zeros(len(self.column)), model.nv
        self.length, self.rate = data.ten_length, np.zeros(model.ntendon)
        own = np.array([is_string(model, tendon) for tendon in range(model.ntendon)], bool)
        self._strings = Strings(model, data, np.flatnonzero(own), self.start, self.column, self.value)
        self._rest, self._data = None, data
        if not own.all():
            self._rest = copy.copy(model)
            self._rest.tendon_num[own] = 0
        taken = np.repeat(~own, np.diff(self.start))
        source = np.concatenate([*entries, np.empty(0)])[taken]
        self._take = data.ten_J, source.astype(INDEX), np.flatnonzero(taken).astype(INDEX), self.value

    def refresh_positions(self) -> None:
        """Lengths and slopes, from MuJoCo's kinematics and joint axes."""
        if self._rest is not None:
            mujoco.mj_tendon(self._rest, self._data)
            _take(*self._take)
        self._strings.refresh()

    def refresh_velocities(self, v) -> None:
        """Rates of lengthening at velocities ``v`` (nv,)."""
        rows.rates(self.start, self.column, self.value, v, self.rate)

    def pull(self, first: int, force) -> np.ndarray:
        """Sum (nv,) of dl/dq of tendons ``first`` and on, each times its ``force``."""
        out = np.zeros(self._width)
        rows.pull(self.start, self.column, self.value, first, np.ascontiguousarray(force, float), out)
        return out

    def gather(self, chosen, place, factor) -> np.ndarray:
        """dl/dq of the tendons ``chosen`` (k,), each times its ``factor``, as columns of (1 + max(place), k).

        ``place`` (nv,) says in which row a velocity stands, negative where it is left out.
        """
        out = np.zeros((place.max() + 1, len(chosen)))
        rows.gather(self.start, self.column, self.value, chosen, place, factor, out)
        return out

    def dense(self, count: int, width: int) -> np.ndarray:
        """dl/dq of the first ``count`` tendons by ``width`` velocities, a new array."""
        return rows.dense(self.start, self.column, self.value, count, width)


def _moving_entries(model, tendon: int) -> np.ndarray:
    """Entries of ``ten_J`` of the joints that lie above some bone of the path but not above all."""
    bones = {bone_of(model, k) for k in elements(model, tendon)} - {-1}
    chains = [set(velocities_above(model, bone)) for bone in bones]
    moving = set.union(*chains) - set.intersection(*chains)
    first = model.ten_J_rowadr[tendon]
    entries = np.arange(first, first + model.ten_J_rownnz[tendon])
    return entries[[column in moving for column in model.ten_J_colind[entries]]]


@njit(cache=True)
def _take(full, source, target, value):
    for k in range(source.shape[0]):
        value[target[k]] = full[source[k]]
