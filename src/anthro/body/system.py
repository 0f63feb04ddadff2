"""The step's linear system A x = b: factored once, then amended by few rows without factoring it anew.

Which stops push, and how much friction resists, is settled with the step. Each time a few of them change, A changes
to A + G^T W G with few rows G of weights W. With A = L L^T and Z = L^-1 G^T this is L (1 + Z W Z^T) L^T, and

    (A + G^T W G)^-1 = L^-T (1 - Z K Z^T) L^-1,    K = (1 + W Z^T Z)^-1 W

needs only a matrix K as large as there are changes.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.linalg.lapack import dgesv, dpotrf, dpotrs, dtrtrs


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
        self._factor = self.factor.T  # LAPACK's columns: an upper triangle
        self._amended = None

    def begin(self) -> None:
        """Start from the system without stops."""
        np.copyto(self.factor, self.lower)
        np.copyto(self.right, self.force)

    def factorize(self) -> int:
        """Factor the matrix in place; 0, or LAPACK's number of the equation where it is not positive definite."""
        np.copyto(self._first_right, self.right)
        self._amended = None
        return dpotrf(self._factor, lower=0, clean=0, overwrite_a=1)[1]

    def amend(self, count: int) -> None:
        """Add the first ``count`` of the listed changes to the factored system, in place of earlier changes."""
        slope, weight, push = (part[:count] for part in self.changes)
        np.add(self._first_right, push @ slope, out=self.right)
        self._amended = None
        if not count:
            return
        spread = dtrtrs(self._factor, slope.T, lower=0, trans=1)[0]
        inner = weight[:, None] * (spread.T @ spread)
        inner.flat[:: count + 1] += 1.0
        self._amended = spread, dgesv(inner, np.diag(weight))[2]

    def solve(self, right) -> np.ndarray:
        """Solution x (nv,) for a right side, which may be overwritten."""
        if self._amended is None:
            return dpotrs(self._factor, right, lower=0, overwrite_b=1)[0]
        spread, inner = self._amended
        half = dtrtrs(self._factor, right, lower=0, trans=1, overwrite_b=1)[0]
        half -= spread @ (inner @ (half @ spread))
        return dtrtrs(self._factor, half, lower=0, overwrite_b=1)[0]
