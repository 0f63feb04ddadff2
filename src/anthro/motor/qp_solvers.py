"""QP solvers for the minimal-effort problem, one call each, for `anthro.motor.compare_solvers`.

A solver is a function of a problem (arrays A, b and those of a neighbour, near_A and near_b) and a
slack (0: A a = b as an equality; else the soft problem of `anthro.motor.effort`). It returns a
callable that is what the clock sees: it takes in the new A and b, solves, and returns x, the first
n entries of which are the activations. Warm starts begin from the neighbour's solution.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from anthro.motor import effort

TONE = 0.02
TOLERANCE = 1e-9  # asked of every proximal, active-set and interior-point solver
SPLITTING_TOLERANCE = 1e-6  # asked of OSQP before its polishing


@dataclass(frozen=True)
class Quadratic:
    """Minimise 1/2 |x|^2 - c.x  subject to  E x = e, low <= x <= high; x begins with a."""

    c: np.ndarray
    E: np.ndarray
    e: np.ndarray
    low: np.ndarray
    high: np.ndarray


def quadratic(A, b, slack) -> Quadratic:
    """State the effort problem for a QP solver: hard if slack is 0, else soft as in `effort`."""
    m, n = A.shape
    strength = np.linalg.norm(A, axis=1)
    E, e = A / strength[:, None], b / strength
    c, low, high = np.full(n, TONE), np.zeros(n), np.ones(n)
    if slack:
        E = np.hstack([E, -np.sqrt(slack) * np.eye(m)])
        c = np.append(c, np.zeros(m))
        low, high = np.append(low, np.full(m, -np.inf)), np.append(high, np.full(m, np.inf))
    return Quadratic(c, np.ascontiguousarray(E), e, low, high)


def newton(problem, slack, warm=False) -> Callable[[], np.ndarray]:
    """Make our solver ready; calling the result solves the problem."""
    slack = slack or effort.SLACK
    start = None
    if warm:
        near = effort.minimal_effort(problem.near_A, problem.near_b, TONE, slack)
        start = near.multiplier
    A, b, tone = problem.A, problem.b, np.full(problem.A.shape[1], TONE)
    return lambda: effort.minimal_effort(A, b, tone, slack, start).activation


def proxqp(problem, slack, warm=False) -> Callable[[], np.ndarray]:
    """Make proxsuite's dense ProxQP ready."""
    import proxsuite

    dense = proxsuite.proxqp.dense
    q = quadratic(problem.A, problem.b, slack)
    near = quadratic(problem.near_A, problem.near_b, slack)
    size = q.c.size
    qp = dense.QP(size, q.e.size, 0, True, dense.HessianType.Diagonal)
    qp.settings.eps_abs, qp.settings.eps_rel = TOLERANCE, 0.0
    initial = proxsuite.proxqp.InitialGuess
    qp.settings.initial_guess = initial.WARM_START_WITH_PREVIOUS_RESULT if warm else initial.NO_INITIAL_GUESS
    qp.init(np.eye(size), -near.c, near.E, near.e, None, None, None, near.low, near.high)
    qp.solve()

    def solve():
        qp.update(A=q.E, b=q.e)
        qp.solve()
        return np.array(qp.results.x)

    return solve


def daqp(problem, slack) -> Callable[[], np.ndarray]:
    """Make DAQP (dual active set) ready."""
    import daqp as package

    q = quadratic(problem.A, problem.b, slack)
    identity, linear = np.eye(q.c.size), -q.c
    high, low = np.append(q.high, q.e), np.append(q.low, q.e)
    sense = np.append(np.zeros(q.c.size), np.full(q.e.size, 5)).astype(np.int32)
    return lambda: package.solve(identity, linear, q.E, high, low, sense, primal_tol=TOLERANCE)[0]


def piqp(problem, slack) -> Callable[[], np.ndarray]:
    """Make PIQP's dense interior-point solver ready."""
    import piqp as package

    q = quadratic(problem.A, problem.b, slack)
    near = quadratic(problem.near_A, problem.near_b, slack)
    solver = package.DenseSolver()
    solver.settings.eps_abs, solver.settings.eps_rel = TOLERANCE, 0.0
    solver.settings.eps_duality_gap_abs, solver.settings.eps_duality_gap_rel = TOLERANCE, TOLERANCE
    rows = np.asfortranarray(q.E)
    solver.setup(
        np.asfortranarray(np.eye(q.c.size)), -q.c, np.asfortranarray(near.E), near.e,
        x_l=q.low, x_u=q.high,
    )  # fmt: skip

    def solve():
        solver.update(A=rows, b=q.e)
        solver.solve()
        return np.array(solver.result.x)

    return solve


def osqp(problem, slack) -> Callable[[], np.ndarray]:
    """Make OSQP (sparse operator splitting, with polishing) ready."""
    import osqp as package
    from scipy import sparse

    q = quadratic(problem.A, problem.b, slack)
    near = quadratic(problem.near_A, problem.near_b, slack)
    size = q.c.size
    # the neighbour may have other zeros: one pattern must hold both
    full = np.vstack([np.where((q.E != 0) | (near.E != 0), 1.0, 0.0), np.eye(size)])
    pattern = sparse.csc_matrix(full)
    rows = pattern.copy()
    rows.data = np.vstack([q.E, np.eye(size)]).T[full.T != 0]
    low, high = np.append(q.e, q.low), np.append(q.e, q.high)
    solver = package.OSQP()
    solver.setup(
        sparse.csc_matrix(sparse.eye(size)), -q.c, pattern, low, high,
        eps_abs=SPLITTING_TOLERANCE, eps_rel=0.0, polishing=True, max_iter=4000,
        warm_starting=False, verbose=False,
    )  # fmt: skip

    def solve():
        solver.update(Ax=rows.data)
        return solver.solve(raise_error=False).x

    return solve


SOLVERS: dict[str, Callable] = {
    "semismooth Newton": newton,
    "semismooth Newton, warm": lambda problem, slack: newton(problem, slack, warm=True),
    "proxsuite": proxqp,
    "proxsuite, warm": lambda problem, slack: proxqp(problem, slack, warm=True),
    "DAQP": daqp,
    "PIQP": piqp,
    "OSQP": osqp,
}
