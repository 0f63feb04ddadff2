"""Minimal-effort muscle activations for given joint torques.

Nakada et al. 2018, Appendix B, and Zhou et al. 2021, section 4.1, find the smallest activations that
make the torques of inverse dynamics, in one problem for the agonists and one for the antagonists.
Here one problem holds all muscles,

    minimise  1/2 |a - tone|^2   subject to   A a = b,   0 <= a <= 1,

with A (m, n) the joint torque of each muscle at full activation [N m] and b (m,) the torque that
the muscles have to make [N m]. The reason: which muscle is an agonist depends on the joint. A
biarticular muscle helps at one joint and hinders at another, and most arm muscles cross several
degrees of freedom. Split joint by joint, such a muscle is asked once for each joint and the torques
no longer add up to b (`agonists_by_joint` is that reading, kept for comparison). What the
antagonist problem is for, co-contraction, enters as `tone`: the activations from which effort is
measured.

**Dual.** With one multiplier y_j per joint torque the minimiser is a = clip(drive, 0, 1) where
drive = tone + A^T y is the unclipped neural drive: at most 0 for a silent muscle, at least 1 for a
saturated one. The dual of

    minimise  1/2 |a - tone|^2 + 1/2 |slack^(-1/2) S (A a - b)|^2,   0 <= a <= 1,

S scaling the rows of A to unit length, is to minimise without constraints the strictly convex,
piecewise quadratic  psi(y) = sum_i Phi(drive_i) - b.y + 1/2 y.slack y  with Phi' = clip (y and b
scaled likewise; slack may differ from row to row). A small `slack` leaves feasible problems exact
to about 1e-6 N m. Torques that the muscles cannot make get the activations nearest to them, every
joint's shortfall measured against that joint's strength, and y stays finite (at most
shortfall / slack).

**Convergence.** The semismooth Newton matrix S A D A^T S + slack (D marks muscles strictly
between 0 and 1) is positive definite, so every step descends; its length minimises psi exactly, as
the derivative along the step is piecewise linear. Descent on a strictly convex piecewise quadratic
reaches the right piece, and there one step is exact.
"""

from typing import NamedTuple

import numpy as np
from numba import njit

from anthro.errors import UserError

SLACK = 1e-10  # in reach the residual falls with it, out of reach rounding grows: both below 1e-5
SMALLEST_SLACK = 1e-12
MAX_ITERATIONS = 200


class Effort(NamedTuple):
    """Solution of one minimal-effort problem.

    Attributes
    ----------
    activation : (n,) array, in [0, 1]; equals clip(drive, 0, 1)
    drive : (n,) array, unclipped neural drive; large (up to 1 / slack) where torque is out of reach
    residual : float, largest |A a - b| [N m]
    iterations : int, Newton steps taken
    multiplier : (m,) array [1 / (N m)], drive = tone + A^T multiplier; `start` of the next problem
    """

    activation: np.ndarray
    drive: np.ndarray
    residual: float
    iterations: int
    multiplier: np.ndarray


@njit(cache=True, nogil=True, error_model="numpy")
def _solve_spd(matrix, x):
    """Solve matrix x = rhs in place by Cholesky; rows are updated contiguously for speed."""
    m = x.size
    for k in range(m):
        pivot = 1.0 / matrix[k, k]
        for i in range(k + 1, m):
            factor = matrix[k, i] * pivot
            if factor != 0.0:
                for j in range(i, m):
                    matrix[i, j] -= factor * matrix[k, j]
                x[i] -= factor * x[k]
    for k in range(m - 1, -1, -1):
        total = x[k]
        for j in range(k + 1, m):
            total -= matrix[k, j] * x[j]
        x[k] = total / matrix[k, k]


@njit(cache=True, nogil=True, error_model="numpy")
def _step_length(drive, direction, offset, curvature):
    """Root t > 0 of  sum_i w_i clip(u_i + t w_i) + offset + curvature t, increasing in t."""
    low, high, t, first = 0.0, np.inf, 1.0, 0.0
    for i in range(drive.size):
        first += direction[i] * min(max(drive[i], 0.0), 1.0)
    first = abs(first + offset)
    for _ in range(60):
        value = offset + curvature * t
        slope = curvature
        for i in range(drive.size):
            u = drive[i] + t * direction[i]
            if u >= 1.0:
                value += direction[i]
            elif u > 0.0:
                value += direction[i] * u
                slope += direction[i] * direction[i]
        if abs(value) <= 1e-12 * first:
            return t
        if value > 0.0:
            high = t
        else:
            low = t
        t -= value / slope
        if not low < t < high:
            t = 0.5 * (low + high) if high < np.inf else 2.0 * low
        if high < np.inf and high - low <= 1e-14 * high:
            return t
    return t


@njit(cache=True, nogil=True, error_model="numpy")
def _gradient(columns, drive, torque, y, slack, out):
    for j in range(y.size):
        out[j] = slack[j] * y[j] - torque[j]
    for i in range(drive.size):
        a = min(max(drive[i], 0.0), 1.0)
        if a > 0.0:
            for j in range(y.size):
                out[j] += a * columns[i, j]


@njit(cache=True, nogil=True, error_model="numpy")
def _drive(columns, tone, y, out):
    for i in range(out.size):
        total = 0.0
        for j in range(y.size):
            total += columns[i, j] * y[j]
        out[i] = tone[i] + total


@njit(cache=True, nogil=True, error_model="numpy")
def solve(A, b, tone, slack, start):
    """Compiled core of `minimal_effort`, for callers that are compiled themselves.

    Takes C-contiguous float64 arrays and returns the fields of `Effort` as a plain tuple;
    `iterations` is -1 when an input is not finite and MAX_ITERATIONS + 1 without convergence.
    """
    m, n = A.shape
    tolerance = 1e-14
    scale = np.empty(m)
    y = np.empty(m)
    torque = np.empty(m)
    columns = np.empty((n, m))
    finite = True
    for j in range(m):
        total = 0.0
        for i in range(n):
            total += A[j, i] * A[j, i]
        scale[j] = 1.0 / np.sqrt(total) if total > 0.0 else 1.0
        finite &= np.isfinite(total) and np.isfinite(b[j]) and np.isfinite(start[j])
        torque[j] = b[j] * scale[j]
        tolerance = max(tolerance, 1e-14 * abs(torque[j]))
        y[j] = start[j] / scale[j]
        for i in range(n):
            columns[i, j] = A[j, i] * scale[j]
    for i in range(n):
        finite &= np.isfinite(tone[i])
    drive = np.empty(n)
    activation = np.empty(n)
    if not finite:
        return activation, drive, np.nan, -1, y

    gradient = np.empty(m)
    step = np.empty(m)
    direction = np.empty(n)
    zero = np.zeros(n)
    hessian = np.empty((m, m))
    _drive(columns, tone, y, drive)
    iterations = MAX_ITERATIONS + 1
    for iteration in range(MAX_ITERATIONS + 1):
        _gradient(columns, drive, torque, y, slack, gradient)
        size = 0.0
        for j in range(m):
            size = max(size, abs(gradient[j]))
        if size <= tolerance:
            iterations = iteration
            break
        hessian[:, :] = 0.0
        for j in range(m):
            hessian[j, j] = slack[j]
        for i in range(n):
            if 0.0 < drive[i] < 1.0:
                for j in range(m):
                    factor = columns[i, j]
                    if factor != 0.0:
                        for k in range(j, m):
                            hessian[j, k] += factor * columns[i, k]
        for j in range(m):
            step[j] = -gradient[j]
        _solve_spd(hessian, step)
        _drive(columns, zero, step, direction)
        offset = 0.0
        curvature = 0.0
        for j in range(m):
            offset += step[j] * (slack[j] * y[j] - torque[j])
            curvature += slack[j] * step[j] * step[j]
        same_piece = True
        for i in range(n):
            u = drive[i]
            v = u + direction[i]
            if (0.0 < u < 1.0) != (0.0 < v < 1.0) or (u >= 1.0) != (v >= 1.0):
                same_piece = False
                break
        t = 1.0 if same_piece else _step_length(drive, direction, offset, curvature)
        moved = False
        for j in range(m):
            before = y[j]
            y[j] += t * step[j]
            moved |= abs(y[j] - before) > 1e-15 * abs(before)
        _drive(columns, tone, y, drive)
        if same_piece or not moved:
            iterations = iteration + 1
            break

    residual = 0.0
    for i in range(n):
        activation[i] = min(max(drive[i], 0.0), 1.0)
    for j in range(m):
        total = -torque[j]
        for i in range(n):
            total += columns[i, j] * activation[i]
        residual = max(residual, abs(total) / scale[j])
        y[j] *= scale[j]
    return activation, drive, residual, iterations, y


def _array(name, value, shape):
    value = np.ascontiguousarray(value, dtype=np.float64)
    if value.shape != shape:
        raise UserError(f"minimal effort: {name} has shape {value.shape}, expected {shape}")
    return value


def minimal_effort(A, b, tone, slack=SLACK, start=None):
    """Activations of least effort that make the torques b, or come nearest to them.

    Parameters
    ----------
    A : (m, n) array, joint torque of each muscle at full activation [N m]
    b : (m,) array, joint torques to make [N m]
    tone : (n,) array or float, activations from which effort is measured
    slack : float or (m,) array, weight of the multipliers in the dual (module docstring). A larger one trades
        exactness for a smaller `drive` where torque is hard to reach: the residual is about
        slack * multiplier * strength^2, with strength the norm of the joint's row of A.
    start : (m,) array, optional: the multiplier of a similar problem; fewer steps, same solution

    Returns
    -------
    Effort

    Raises
    ------
    UserError
        If an input is not finite, shapes differ, or slack is below SMALLEST_SLACK.

    Notes
    -----
    Nakada et al. 2018, Appendix B. Deterministic: no BLAS, no threads, no random numbers.
    """
    A = np.ascontiguousarray(A, dtype=np.float64)
    if A.ndim != 2:
        raise UserError(f"minimal effort: A has shape {A.shape}, expected (torques, muscles)")
    m, n = A.shape
    b = _array("b", b, (m,))
    tone = np.full(n, float(tone)) if isinstance(tone, int | float) else _array("tone", tone, (n,))
    start = np.zeros(m) if start is None else _array("start", start, (m,))
    slack = np.full(m, float(slack)) if isinstance(slack, int | float) else _array("slack", slack, (m,))
    if not (SMALLEST_SLACK <= slack).all() or not np.isfinite(slack).all():
        raise UserError(f"minimal effort: slack is {slack.min()}, must be at least {SMALLEST_SLACK}")
    result = Effort(*solve(A, b, tone, slack, start))
    if result.iterations < 0:
        raise UserError("minimal effort: torque matrix, torques, tone or start are not all finite")
    return result


def agonists_by_joint(A, b, tone):
    """Activations when each joint's agonists and antagonists are solved for that joint alone.

    The agonists of a joint make its torque, and what its antagonists take away at their tone, with
    least effort; a muscle of several joints gets the sum of its changes. One reading of Zhou et al.
    2021, section 4.1, for comparison: A a = b holds only if no muscle crosses two joints.

    Parameters
    ----------
    A, b, tone : (m, n), (m,), (n,) arrays as in `minimal_effort`

    Returns
    -------
    (n,) array of activations in [0, 1]
    """
    change = np.zeros_like(tone)
    for row, torque in zip(A, b, strict=True):
        agonist = row * (torque - row @ tone) > 0.0
        if agonist.any():
            rest = torque - row[~agonist] @ tone[~agonist]
            solved = minimal_effort(row[None, agonist], [rest], tone[agonist])
            change[agonist] += solved.activation - tone[agonist]
    return np.clip(tone + change, 0.0, 1.0)
