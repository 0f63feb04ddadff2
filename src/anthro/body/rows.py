"""Slopes of many quantities in the velocities, stored sparsely, and compiled sums over them.

Rows are kept one behind the other: row i is entries ``start[i]`` to ``start[i + 1]`` of ``column`` and ``value``.
Indices are unsigned, which spares compiled code the question whether they count from the end.
"""

from __future__ import annotations

import numpy as np
from numba import njit

INDEX = np.uint32


def layout(rows) -> tuple[np.ndarray, np.ndarray]:
    """``start`` (r + 1,) and ``column`` (nnz,) of rows that depend on the given velocities each."""
    start = np.cumsum([0] + [len(row) for row in rows])
    return start.astype(INDEX), np.concatenate([*rows, np.empty(0)]).astype(INDEX)


def velocities_above(model, body: int) -> list[int]:
    """Velocities that move a body, ascending."""
    above = []
    while body > 0:
        first = model.body_dofadr[body]
        above += range(first, first + model.body_dofnum[body])
        body = model.body_parentid[body]
    return sorted(above)


def dense(start, column, value, count: int, width: int) -> np.ndarray:
    """The first ``count`` rows as a matrix of ``width`` columns, a new array."""
    out = np.zeros((count, width))
    _scatter(start, column, value, out)
    return out


@njit(cache=True)
def _scatter(start, column, value, out):
    for i in range(out.shape[0]):
        for k in range(start[i], start[i + 1]):
            out[i, column[k]] = value[k]


@njit(cache=True)
def pull(start, column, value, first, force, out):
    """Add rows ``first`` and on, each times its ``force``, to ``out`` (width,)."""
    for i in range(force.shape[0]):
        for k in range(start[first + i], start[first + i + 1]):
            out[column[k]] += force[i] * value[k]


@njit(cache=True)
def gather(start, column, value, chosen, place, factor, out):
    """Put ``chosen`` rows, each times its ``factor``, into the columns of ``out``; velocity j goes to row ``place[j]``.

    Velocities whose place is negative are left out.
    """
    for j in range(chosen.shape[0]):
        i = chosen[j]
        for k in range(start[i], start[i + 1]):
            row = place[column[k]]
            if row >= 0:
                out[row, j] = factor[j] * value[k]


@njit(cache=True, forceinline=True)
def dot(start, column, value, i, v):
    """Row ``i`` times velocities ``v``."""
    total = 0.0
    for k in range(start[i], start[i + 1]):
        total += value[k] * v[column[k]]
    return total


@njit(cache=True)
def rates(start, column, value, v, out):
    """Rates (rows,) of what the rows are slopes of, at velocities ``v``."""
    for i in range(out.shape[0]):
        out[i] = dot(start, column, value, i, v)


@njit(cache=True, fastmath={"contract"}, forceinline=True)
def add_square(lower, start, column, value, i, weight):
    """Add ``weight`` times the outer square of row ``i`` to the lower triangle ``lower``, two of its rows at a time."""
    first, last = start[i], start[i + 1]
    a = first
    while a + 1 < last:
        upper, below = lower[column[a]], lower[column[a + 1]]
        left, right = weight * value[a], weight * value[a + 1]
        for b in range(first, a + 1):
            upper[column[b]] += left * value[b]
            below[column[b]] += right * value[b]
        below[column[a + 1]] += right * value[a + 1]
        a += 2
    if a < last:
        left, lowest = weight * value[a], lower[column[a]]
        for b in range(first, a + 1):
            lowest[column[b]] += left * value[b]


@njit(cache=True, forceinline=True)
def add_row(vector, start, column, value, i, factor):
    """Add ``factor`` times row ``i`` to ``vector``."""
    for k in range(start[i], start[i + 1]):
        vector[column[k]] += factor * value[k]
