"""The step's linear system A x = b: factored once, then amended by few rows without factoring it anew.

Which stops push, and how much friction resists, is settled with the step. Each time a few of them change, A changes
to A + G^T W G with few rows G of weights W. With A = L L^T and Z = L^-1 G^T this is L (1 + Z W Z^T) L^T, and

    (A + G^T W G)^-1 = L^-T (1 - Z K Z^T) L^-1,    K = (1 + W Z^T Z)^-1 W

needs only a matrix K as large as there are changes.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit
from scipy.linalg.lapack import dgesv, dpotrf, dtrtrs


class Changes(NamedTuple):
    """Rows to add to a system: ``slope`` (most, nv), ``weight`` (most,), ``push`` (most,), the first of each used."""

    slope: np.ndarray
    weight: np.ndarray
    push: np.ndarray


class System:
    """A symmetric positive definite system of nv equations.

    Parameters
    ----------
    size : nv.
    most : the most rows that can be added.

    Attributes
    ----------
    lower, force : (nv, nv) lower triangle and (nv,) right side without any stop.
    factor, right : with the stops that push. ``factor`` is the matrix until :meth:`factorize`.
    changes : where rows are listed before :meth:`amend`.
    """

    def __init__(self, size: int, most: int):
        self.lower, self.factor = np.zeros((2, size, size))
        self.force, self.right, self._first_right = np.zeros((3, size))
        self.changes = Changes(np.zeros((most, size)), np.zeros(most), np.zeros(most))
        self._spread, self._inner = np.zeros((0, size)), np.zeros((0, 0))

    def begin(self) -> None:
        """Start from the system without stops."""
        self.right = self._first_right
        np.copyto(self.factor, self.lower)
        np.copyto(self.right, self.force)

    def factorize(self) -> int:
        """Factor the matrix in place; 0, or LAPACK's number of the equation where it is not positive definite."""
        self._spread = self._spread[:0]
        # LAPACK's matrices go by columns: the lower triangle is an upper one
        return dpotrf(self.factor.T, lower=0, clean=0, overwrite_a=1)[1]

    def amend(self, count: int) -> None:
        """Add the first ``count`` of the listed changes to the factored system, in place of earlier changes."""
        slope, weight, push = (part[:count] for part in self.changes)
        self.right = self._first_right + push @ slope
        self._spread = slope
        if count:
            self._spread = dtrtrs(self.factor.T, slope.T, lower=0, trans=1)[0].T
            inner = weight[:, None] * (self._spread @ self._spread.T)
            inner.flat[:: count + 1] += 1.0
            self._inner = np.ascontiguousarray(dgesv(inner, np.diag(weight))[2])

    def solve(self, h: float, bias) -> np.ndarray:
        """Solution (nv,) for ``right`` less ``bias`` (nv,), times ``h``."""
        x = np.empty(len(bias))
        _solve(self.factor, self._spread, self._inner, self.right, bias, h, x)
        return x


@njit(cache=True, fastmath={"contract", "reassoc"}, error_model="numpy")
def _solve(factor, spread, inner, right, bias, h, x):
    """Forward substitution, the changes, backward substitution."""
    for i in range(x.shape[0]):
        row, known = factor[i], 0.0
        for k in range(i):
            known += row[k] * x[k]
        x[i] = (h * (right[i] - bias[i]) - known) / row[i]
    if spread.shape[0]:
        along = inner @ (spread @ x)
        for j in range(spread.shape[0]):
            for i in range(x.shape[0]):
                x[i] -= spread[j, i] * along[j]
    for i in range(x.shape[0] - 1, -1, -1):
        row = factor[i]
        x[i] /= row[i]
        for k in range(i):
            x[k] -= row[k] * x[i]
