"""Undirected searches for the same goals: ``python -m anthro.neuroanimator.search --run DIR --task NAME --out DIR``.

Simulated annealing and the simplex method, which the paper compares with (Grzeszczuk 1998, Sec. 6), and CMA-ES look
for controls on the plant itself, by the same objective, until the same goal is reached or no evaluation is left; each
evaluation is a simulation of 20 s. Backpropagation through time starts from the same controls on the emulator.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Callable, Sequence
from pathlib import Path

import cma
import numpy as np
from scipy.optimize import Bounds, dual_annealing, minimize

from anthro import cli
from anthro.errors import UserError
from anthro.neuroanimator.control import Problem, descend
from anthro.neuroanimator.rows import row, write
from anthro.neuroanimator.synthesize import problem_of
from anthro.neuroanimator.tasks import TASKS, task_of
from anthro.progress import progress
from anthro.runcard import RunCard
from anthro.streams import stream

JITTER = 0.02  # of the limits: how much the starts of the seeds differ
SPREAD = 0.2  # of the limits: first step of a search
ORDERS = 100.0  # the paper's two orders of magnitude
DIRECTED = "backpropagation"


class _Done(Exception):
    """The goal is reached, or nothing is left to spend."""


class Meter:
    """An objective on the plant that counts, and stops the search that calls it.

    Attributes
    ----------
    evaluations, iterations : int
    best : float
        Least cost so far.
    reached : bool
        Whether the goal is.
    seconds : float
        Since it was made, until it stopped.
    """

    def __init__(self, problem: Problem, most: int):
        self._problem, self._most, self._started = problem, most, time.perf_counter()
        self.evaluations = self.iterations = 0
        self.best, self.reached, self.seconds = np.inf, False, 0.0

    def __call__(self, flat: np.ndarray) -> float:
        """Cost of controls (variables,)."""
        if self.evaluations == self._most:
            self._stop()
        controls = self._problem.clip(np.reshape(flat, self._problem.task.first.shape))
        states = self._problem.simulate(controls)
        self.evaluations += 1
        cost = self._problem.cost(controls, states)
        self.best = min(self.best, cost)
        if self._problem.task.reached(states) <= 1.0:
            self.reached = True
            self._stop()
        return cost

    def tick(self, *_, **__) -> None:
        """Count an iteration of the search."""
        self.iterations += 1

    def _stop(self) -> None:
        raise _Done

    def close(self) -> None:
        """Stop the clock."""
        self.seconds = time.perf_counter() - self._started


def annealing(meter: Meter, start: np.ndarray, bounds: Bounds, seed: int) -> None:
    """Simulated annealing (scipy's, without local search); every evaluation is an iteration."""

    def counted(flat):
        cost = meter(flat)
        meter.tick()
        return cost

    dual_annealing(counted, bounds, x0=start, rng=np.random.default_rng(seed), no_local_search=True, maxiter=10**6)


def simplex(meter: Meter, start: np.ndarray, bounds: Bounds, seed: int) -> None:
    """The simplex method of Nelder and Mead (scipy's, its coefficients adapted to the number of variables)."""
    drawn = np.random.default_rng(seed).uniform(0.5, 1.0, len(start)) * SPREAD
    corners = np.vstack([start, start + np.diag(np.where(start + drawn > bounds.ub, -drawn, drawn))])
    options = {"adaptive": True, "initial_simplex": corners, "maxfev": 10**9, "maxiter": 10**9, "xatol": 0, "fatol": 0}
    minimize(meter, start, method="Nelder-Mead", bounds=bounds, options=options, callback=meter.tick)


def evolution(meter: Meter, start: np.ndarray, bounds: Bounds, seed: int) -> None:
    """CMA-ES; an iteration is a generation."""
    options = {"bounds": [bounds.lb, bounds.ub], "seed": seed + 1, "verbose": -9, "tolfun": 0, "tolx": 0}
    strategy = cma.CMAEvolutionStrategy(start, SPREAD, options)
    while True:
        asked = strategy.ask()
        strategy.tell(asked, [meter(flat) for flat in asked])
        meter.tick()


METHODS: dict[str, Callable] = {"annealing": annealing, "simplex": simplex, "cma_es": evolution}


def spend(method: Callable, problem: Problem, start: np.ndarray, most: int, seed: int) -> dict:
    """Run one search and tell what it took."""
    bounds = Bounds(np.tile(problem.low, problem.task.knots), np.tile(problem.high, problem.task.knots))
    meter = Meter(problem, most)
    try:
        method(meter, np.clip(start.ravel(), bounds.lb, bounds.ub), bounds, seed)
    except _Done:
        pass
    meter.close()
    names = ("reached", "evaluations", "iterations", "seconds", "best")
    return {name: getattr(meter, name) for name in names}


def directed(problem: Problem, start: np.ndarray) -> dict:
    """Learn through the emulator from `start`; tell what it took until the emulator reaches the goal."""
    task = problem.task
    descend(problem, task.rate, task.momentum, 1, start)  # compiles
    found = descend(problem, task.rate, task.momentum, task.iterations, start)
    each = found.seconds / len(found.costs)
    took = task.iterations if found.reached is None else found.reached
    states = problem.simulate(found.controls[found.best])
    return {
        "reached": found.reached is not None,
        "reached_on_plant": any(task.reached(problem.simulate(controls)) <= 1.0 for controls in found.controls),
        "evaluations": took + 1,
        "iterations": took,
        "seconds": each * (took + 1),
        "best": problem.cost(found.controls[found.best], states),
    }


def compare(problem: Problem, most: int, seeds: int, seed: int) -> dict[str, list[dict]]:
    """What each method took from each seed's start, by method."""
    found: dict[str, list[dict]] = {DIRECTED: [], **{name: [] for name in METHODS}}
    for number in progress(range(seeds), seeds, f"{problem.task.name} seeds"):
        generator = stream(seed, f"neuroanimator/search/{problem.task.name}", number)
        start = problem.clip(problem.task.first + generator.normal(0.0, JITTER, problem.task.first.shape))
        drawn = int(generator.integers(2**31 - 2))
        found[DIRECTED].append(directed(problem, start))
        for name, method in METHODS.items():
            found[name].append(spend(method, problem, start, most, drawn))
    return found


def rows_of(name: str, found: dict[str, list[dict]], most: int) -> list[dict]:
    """Scorecard rows of one task: medians over seeds; a search that missed the goal counts with all that it spent."""
    item, rows, middle = f"search, {name}", [], {}
    for method, runs in found.items():
        shown = method.replace("_", "-")
        middle[method] = {
            key: float(np.median([run[key] for run in runs])) for key in ("evaluations", "iterations", "seconds")
        }
        reached = sum(run["reached"] for run in runs) / len(runs)
        rows.append(row(item, f"{shown}: share of {len(runs)} seeds that reach the goal", reached, "1"))
        for key, unit in (("iterations", "1"), ("evaluations", "1"), ("seconds", "s")):
            rows.append(row(item, f"{shown}: {key}, at most {most} evaluations", middle[method][key], unit))
    ours = middle.pop(DIRECTED)
    reached = sum(run["reached_on_plant"] for run in found[DIRECTED]) / len(found[DIRECTED])
    rows.append(row(item, "backpropagation: share of seeds whose controls reach the goal on the plant", reached, "1"))
    for method, theirs in middle.items():
        shown = method.replace("_", "-")
        ratio = theirs["evaluations"] / max(1.0, ours["evaluations"])
        rows.append(row(item, f"evaluations, {shown} over backpropagation", ratio, "ratio", ORDERS, "min", "Sec. 6"))
        ratio = theirs["seconds"] / theirs["evaluations"] / (ours["seconds"] / ours["evaluations"])
        rows.append(
            row(item, f"time of an evaluation, {shown} over backpropagation", ratio, "ratio", ORDERS, "min", "Sec. 6")
        )
    return rows


def main(argv: Sequence[str] | None = None) -> None:
    """Compare the methods on one task."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--run", required=True, type=Path, metavar="DIR", help="the run's folder, results/<run>")
    parser.add_argument("--task", required=True, help=f"one of {', '.join(TASKS)}")
    parser.add_argument("--evaluations", type=int, default=1500, help="of a search at most (default 1500)")
    parser.add_argument("--seeds", type=int, default=3, help="(default 3)")
    parser.add_argument("--seed", type=int, default=7, help="(default 7)")
    parser.add_argument("--out", required=True, type=Path, metavar="DIR", help="for metrics, rows and run card")
    given = parser.parse_args(argv)
    if min(given.evaluations, given.seeds) < 1:
        raise UserError("--evaluations and --seeds: at least 1 is wanted")
    problem = problem_of(given.run, task_of(given.task))
    spec = {"task": given.task, "evaluations": given.evaluations, "seeds": given.seeds}
    with RunCard(given.out / "run_card.json", spec, given.seed):
        found = compare(problem, given.evaluations, given.seeds, given.seed)
        write(given.out, found, rows_of(given.task, found, given.evaluations))


if __name__ == "__main__":
    sys.exit(cli.run(main))
