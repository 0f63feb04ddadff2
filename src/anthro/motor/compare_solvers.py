"""Which solver for the minimal-effort problem: time and residual on the same problems.

The arm's problems are poses from the middle 70 % of every joint's range with random accelerations,
through the body's own moment arms, muscle forces, mass matrix and gravity. Those within reach of
the muscles are solved with A a = b as an equality; those out of reach as the soft problem of
`anthro.motor.effort`, which always has a solution. Problems of a neck's size (21 torques, 216
muscles) are random and within reach.

Every solver gets rows scaled to unit length. Putting matrices together, allocating and analysing
sparsity happen before the clock starts for the others; our own solver is timed with its argument
checks and scaling. The order of solvers rotates from problem to problem.
"""

import argparse
import csv
import sys
import time
from dataclasses import dataclass
from importlib import metadata
from pathlib import Path

import numpy as np

from anthro import cli
from anthro.body import Body, hill
from anthro.errors import UserError
from anthro.files import atomic, write_json
from anthro.motor import effort
from anthro.motor.qp_solvers import SOLVERS, TOLERANCE, TONE
from anthro.progress import progress
from anthro.runcard import RunCard
from anthro.streams import stream

SOFT_SLACK = 1e-6  # of the problems out of reach
ACCELERATION = {"arm, in reach": 20.0, "arm, out of reach": 200.0}  # rad/s^2, standard deviation
NECK = "neck size, in reach"
REPEATS = 3
FAILED = 1e-3  # the minimiser is unique: activations further off than this are no solution
COLUMNS = (
    "group solver problems failed median_us p95_us median_residual max_residual median_distance max_distance"
).split()


@dataclass(frozen=True)
class Problem:
    """One problem and a close neighbour, from whose solution warm starts begin.

    Attributes
    ----------
    A, b : (m, n) and (m,) arrays [N m]
    near_A, near_b : the neighbour's, 5 ms of motion away
    """

    A: np.ndarray
    b: np.ndarray
    near_A: np.ndarray
    near_b: np.ndarray

    @property
    def strength(self) -> np.ndarray:
        """Norm of every row of A (m,) [N m]."""
        return np.linalg.norm(self.A, axis=1)


def problems(body, count, rng, spread) -> list[Problem]:
    """Draw effort problems of a body.

    Parameters
    ----------
    body : Body
    count : int
    rng : numpy.random.Generator
    spread : float, standard deviation of the wanted joint accelerations [rad/s^2]
    """
    simulator = body.simulator()
    middle, width = body.q_range.mean(axis=1), np.ptp(body.q_range, axis=1)
    drawn = []
    for _ in range(count):
        q = middle + 0.7 * width * (rng.random(middle.size) - 0.5)
        acceleration = spread * rng.normal(size=q.size)
        near = q + 0.005 * rng.normal(size=q.size)
        drawn.append(Problem(*torques(simulator, q, acceleration), *torques(simulator, near, acceleration)))
    return drawn


def torques(simulator, q, acceleration) -> tuple[np.ndarray, np.ndarray]:
    """Return A (m, n) and b (m,) [N m] of a pose (m,) [rad] at rest and a wanted acceleration."""
    simulator.reset(q)
    state = simulator.strain, simulator.strain_rate, simulator.body.max_force
    A = -simulator.jacobian.T * hill.active_force(*state)
    passive = -simulator.jacobian.T @ hill.passive_force(*state)
    return A, simulator.mass @ acceleration + simulator.data.qfrc_bias - passive


def random_problems(m, n, count, rng) -> list[Problem]:
    """Draw random problems in reach: four in ten muscles cross a joint, strengths 5 to 30 N m."""
    drawn = []
    for _ in range(count):
        A = rng.normal(size=(m, n)) * (rng.random((m, n)) < 0.4)
        A *= (rng.uniform(5.0, 30.0, m) / np.linalg.norm(A, axis=1))[:, None]
        a = 0.6 * rng.random(n) * (rng.random(n) < 0.5)
        near_A = A * (1.0 + 0.01 * rng.normal(size=A.shape))
        drawn.append(Problem(A, A @ a, near_A, near_A @ a))
    return drawn


def reachable(problem) -> bool:
    """Whether the muscles can make the torques, told by a linear program (HiGHS), not by us."""
    from scipy.optimize import linprog

    A, b = problem.A / problem.strength[:, None], problem.b / problem.strength
    gap = np.ones((b.size, 1))
    told = linprog(
        np.append(np.zeros(A.shape[1]), 1.0),
        A_ub=np.block([[A, -gap], [-A, -gap]]),
        b_ub=np.concatenate([b, -b]),
        bounds=[(0.0, 1.0)] * A.shape[1] + [(0.0, None)],
    )
    return told.x[-1] < 1e-7


def measure(problem, slack, order) -> dict[str, tuple[float, np.ndarray]]:
    """Solve one problem with every solver of `order`: best of three times [s] and activations.

    A solver without an answer gives NaN activations.
    """
    found = {}
    n = problem.A.shape[1]
    for name in order:
        elapsed = []
        for _ in range(REPEATS):
            solve = SOLVERS[name](problem, slack)
            started = time.perf_counter()
            x = solve()
            elapsed.append(time.perf_counter() - started)
        good = x is not None and np.isfinite(x[:n]).all()
        found[name] = min(elapsed), np.clip(x[:n], 0.0, 1.0) if good else np.full(n, np.nan)
    return found


def objective(problem, a, slack) -> float:
    """Effort plus the price of the torque left over, the quantity that all solvers minimise."""
    missed = (problem.A @ a - problem.b) / problem.strength
    return 0.5 * ((a - TONE) @ (a - TONE) + missed @ missed / (slack or effort.SLACK))


def compare(group, drawn, slack) -> list[dict]:
    """Solve every problem of a group with every solver and sum up.

    Returns
    -------
    list of dict
        One a solver, keys `COLUMNS`: times in microseconds; residual |A a - b|_inf in N m;
        distance of activations |a - best|_inf from the solution of least objective.
    """
    names = list(SOLVERS)
    measure(drawn[0], slack, names)
    seconds, residual, distance = (np.empty((len(drawn), len(names))) for _ in range(3))
    for i, problem in enumerate(progress(drawn, len(drawn), group)):
        turn = i % len(names)
        found = measure(problem, slack, names[turn:] + names[:turn])
        best = min(
            (a for _, a in found.values() if np.isfinite(a).all()),
            key=lambda a: objective(problem, a, slack),
        )
        for k, name in enumerate(names):
            seconds[i, k], a = found[name]
            residual[i, k] = np.abs(problem.A @ a - problem.b).max()
            distance[i, k] = np.abs(a - best).max()
    failed = ~(distance <= FAILED)
    return [
        dict(
            zip(
                COLUMNS,
                (
                    group,
                    name,
                    len(drawn),
                    int(failed[:, k].sum()),
                    1e6 * np.median(seconds[:, k]),
                    1e6 * np.percentile(seconds[:, k], 95),
                    float(np.median(residual[:, k])),
                    float(residual[:, k].max()),
                    float(np.median(distance[:, k])),
                    float(distance[:, k].max()),
                ),
                strict=True,
            )
        )
        for k, name in enumerate(names)
    ]


def joint_by_joint(drawn) -> float:
    """Median torque error [N m] when every joint's agonists and antagonists are solved alone."""
    errors = [np.abs(p.A @ effort.agonists_by_joint(p.A, p.b, np.full(p.A.shape[1], TONE)) - p.b).max() for p in drawn]
    return float(np.median(errors))


def scorecard_rows(table, split_error) -> list[dict]:
    """Make the scorecard's rows from the table of `compare` and the result of `joint_by_joint`."""
    arm = {row["solver"]: row for row in table if row["group"] == "arm, in reach"}
    own = arm["semismooth Newton"]
    others = [row for name, row in arm.items() if not name.startswith("semismooth")]
    exact = [row for row in others if not row["failed"]] or others
    fastest = min(exact, key=lambda row: row["median_us"])
    entries = (
        ("solvers compared", len({n.split(",")[0] for n in arm}), "", 3, "min"),
        ("median time, 29 muscles", own["median_us"], "us", 15.0, "max"),
        ("largest residual in reach", own["max_residual"], "N m", 1e-6, "max"),
        ("times faster than the next", fastest["median_us"] / own["median_us"], "", 1.0, "min"),
        ("median torque error, joint by joint instead", split_error, "N m", None, "info"),
    )
    return [
        {
            "paper": "nakada2018",
            "item": "effort solver",
            "metric": metric,
            "value": value,
            "unit": unit,
            "target": target,
            "source": "Appendix B; targets ours",
            "sense": sense,
        }
        for metric, value, unit, target, sense in entries
    ]


def arm_groups(body, count, seed) -> dict[str, list[Problem]]:
    """Draw until there are `count` problems in reach and as many out of reach."""
    groups = {}
    for group, spread in ACCELERATION.items():
        rng = stream(seed, f"compare_solvers/{group}")
        wanted = group == "arm, in reach"
        kept = []
        for _ in range(20):
            drawn = problems(body, count, rng, spread)
            kept += [problem for problem in drawn if reachable(problem) == wanted]
            if len(kept) >= count:
                break
        else:
            raise UserError(f"{body.name}: fewer than {count} problems are {group.split(', ')[1]}")
        groups[group] = kept[:count]
    return groups


def write_table(path, table) -> None:
    """Write the table of `compare` as CSV."""
    with atomic(path) as partial, partial.open("w", newline="") as file:
        writer = csv.DictWriter(file, COLUMNS, lineterminator="\n")
        writer.writeheader()
        writer.writerows(table)


def main(argv=None) -> None:
    """Compare the solvers; write solver_comparison.csv, metrics.json, rows.json and a run card."""
    parser = argparse.ArgumentParser(prog="anthro.motor.compare_solvers", description=__doc__)
    parser.add_argument("--body", type=Path, required=True, help="folder of the built body")
    parser.add_argument("--seed", type=int, default=1, help="the run's seed (1)")
    parser.add_argument("--problems", type=int, default=200, help="problems of each arm group (200)")
    parser.add_argument("--out", type=Path, required=True, help="folder to write")
    args = parser.parse_args(argv)
    if args.problems < 1 or args.seed < 0:
        raise UserError("--problems must be at least 1 and --seed at least 0")
    spec = {
        "body": args.body.name,
        "problems": args.problems,
        "tolerance": TOLERANCE,
        "slack": effort.SLACK,
        "soft_slack": SOFT_SLACK,
        "tone": TONE,
    }
    with RunCard(args.out / "run_card.json", spec, args.seed) as card:
        groups = arm_groups(Body.load(args.body), args.problems, args.seed)
        rng = stream(args.seed, f"compare_solvers/{NECK}")
        groups[NECK] = random_problems(21, 216, max(1, args.problems // 5), rng)
        table = []
        for group, drawn in groups.items():
            table += compare(group, drawn, SOFT_SLACK if "out of reach" in group else 0.0)
        split_error = joint_by_joint(groups["arm, in reach"])
        write_table(args.out / "solver_comparison.csv", table)
        write_json(args.out / "metrics.json", {"solvers": table, "joint_by_joint_error": split_error})
        write_json(args.out / "rows.json", scorecard_rows(table, split_error))
        card.note(solvers={name: metadata.version(name) for name in ("proxsuite", "daqp", "piqp", "osqp")})
    print(f"{'':22}{'':24}{'median':>9}{'p95':>9} us {'residual':>10} N m {'distance':>9}  failed")
    for row in table:
        print(
            f"{row['group']:22}{row['solver']:24}{row['median_us']:9.1f}{row['p95_us']:9.1f}    "
            f"{row['max_residual']:10.1e}     {row['max_distance']:9.1e}  {row['failed']}"
        )


if __name__ == "__main__":
    sys.exit(cli.run(main))
