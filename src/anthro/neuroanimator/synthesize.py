"""Learn one task's controls through its emulator: ``python -m anthro.neuroanimator.synthesize --run DIR --task NAME``.

Gradient descent with momentum and plain (Grzeszczuk 1998, Sec. 4.3 and 6, Fig. 13 and 14). What was learned is then
applied to the plant itself, and the two motions are compared.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from anthro import cli
from anthro.neuroanimator.control import Descent, Problem, descend
from anthro.neuroanimator.emulator import load_emulator
from anthro.neuroanimator.hierarchy import load_dolphin, load_global
from anthro.neuroanimator.plants import plant_of
from anthro.neuroanimator.plants.plant import STEP
from anthro.neuroanimator.rows import row, write
from anthro.neuroanimator.tasks import LENGTH, SUPER_STEP, TASKS, Task, one_go, task_of
from anthro.runcard import RunCard

FINE = 5  # physical steps between recorded states
SHOWN = 6  # iterations of which the motion is recorded
VARIABLES = {"pendulum": 60, "truck": 40, "lander": 80, "dolphin": 60}  # that the paper optimises
DOLPHIN_SECONDS = 10.0  # s, what swimming took the paper to learn


def problem_of(run: Path, task: Task) -> Problem:
    """Read the emulator of a task: of the dolphin the global net alone (Grzeszczuk 1998, Sec. 6).

    Raises
    ------
    UserError
        Naming the file that is missing.
    """
    if task.plant == "dolphin":
        return Problem(task, load_global(run, SUPER_STEP))
    return Problem(task, load_emulator(run, f"{task.plant}_n{SUPER_STEP}", plant_of(task.plant)))


def finely(problem: Problem, controls: np.ndarray) -> np.ndarray:
    """Return the plant's states every `FINE` steps, (LENGTH * SUPER_STEP / FINE + 1, n_state), in its own variables."""
    plant, state = problem.plant, problem.begin
    states = [state]
    for inputs in problem.inputs(controls):
        for _ in range(SUPER_STEP // FINE):
            state = plant.step(state, inputs, steps=FINE)
            states.append(state)
    return np.array(states)


def motions(run: Path, problem: Problem, descent: Descent) -> dict[str, np.ndarray]:
    """What figures and videos show, in the plant's own variables.

    ``plant`` is the physical motion under the best controls, ``emulated`` the emulator's; ``progress`` the
    emulator's at the iterations ``progress_iteration``.
    """
    emulate = problem.emulate
    if problem.segments is not None:
        dolphin = load_dolphin(run, SUPER_STEP)

        def emulate(controls):
            return dolphin.rollout(problem.begin, problem.inputs(controls))

    best = descent.controls[descent.best]
    shown = np.unique(np.round(np.geomspace(1, descent.best + 1, SHOWN)).astype(int) - 1)
    return {
        "plant": finely(problem, best),
        "emulated": emulate(best),
        "inputs": problem.inputs(best),
        "progress": np.array([emulate(descent.controls[number]) for number in shown]),
        "progress_iteration": shown,
    }


def summary(problem: Problem, momentum: Descent, plain: Descent) -> dict:
    """Numbers of both descents, and of the best controls on the plant."""
    task, best = problem.task, momentum.controls[momentum.best]
    emulated, simulated = problem.emulate(best), problem.simulate(best)
    on_plant = [task.reached(problem.simulate(controls)) for controls in momentum.controls]
    return {
        "goal": task.goal,
        "variables": task.variables,
        "iterations": len(momentum.costs) - 1,
        "reached": momentum.reached,
        "reached_on_plant": next((number for number, share in enumerate(on_plant) if share <= 1.0), None),
        "reached_plain": plain.reached,
        "share_emulated": {name: share(emulated) for name, share in task.shares.items()},
        "share_simulated": {name: share(simulated) for name, share in task.shares.items()},
        "cost_emulated": problem.cost(best, emulated),
        "cost_simulated": problem.cost(best, simulated),
        "mean_difference": float(np.abs(emulated - simulated).mean()),
        "end_difference": float(np.abs(emulated[-1] - simulated[-1]).mean()),
        "seconds": momentum.seconds,
        "costs_momentum": momentum.costs,
        "costs_plain": plain.costs,
    }


def rows_of(name: str, told: dict, task: Task) -> list[dict]:
    """Scorecard rows of one task; a goal that is not reached has no number of iterations."""
    item, last = f"controller, {name}", task.iterations
    first, plain, plant = (
        float("nan") if told[key] is None else told[key] for key in ("reached", "reached_plain", "reached_on_plant")
    )
    ahead = min(told["costs_plain"]) - min(told["costs_momentum"])
    gap = told["cost_simulated"] - told["cost_emulated"]
    rows = [
        row(item, f"iterations to the goal: {task.goal}", first, "1", last, "max", "Sec. 6"),
        row(item, "iterations until the plant reaches the goal", plant, "1", last, "max", "Sec. 6"),
        row(item, "iterations to the goal, plain gradient descent", plain, "1", source="Fig. 14"),
        row(item, "least objective, plain less momentum", ahead, "1", 0.0, "min", "Fig. 14"),
        row(item, "objective on the plant less on the emulator", gap, "1", source="Sec. 4.3"),
        row(item, "mean difference of plant and emulator, all variables", told["mean_difference"], "SI"),
        row(item, "mean difference at the end, all variables", told["end_difference"], "SI"),
        row(item, "control variables", told["variables"], "1", VARIABLES[name], "equal", "Sec. 6"),
    ]
    seconds = ("s", DOLPHIN_SECONDS, "max", "Sec. 6") if name == "dolphin" else ("s",)
    rows.append(row(item, "time of all iterations", told["seconds"], *seconds))
    if name == "pendulum":
        rows.append(
            row(item, "work of one go over what raising the arm takes", one_go(), "ratio", 1.0, "max", "Sec. 6")
        )
    for share, value in told["share_simulated"].items():
        rows.append(row(item, f"{share} on the plant, as a share of the goal", value, "1", 1.0, "max"))
    return rows


def main(argv: Sequence[str] | None = None) -> None:
    """Learn one task's controls."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--run", required=True, type=Path, metavar="DIR", help="the run's folder, results/<run>")
    parser.add_argument("--task", required=True, help=f"one of {', '.join(TASKS)}")
    parser.add_argument(
        "--out", required=True, type=Path, metavar="DIR", help="for rollout.h5, metrics, rows, run card"
    )
    given = parser.parse_args(argv)
    task = task_of(given.task)
    problem = problem_of(given.run, task)
    with RunCard(given.out / "run_card.json", {"task": given.task}):
        descend(problem, task.rate, task.momentum, 1)  # compiles
        momentum = descend(problem, task.rate, task.momentum, task.iterations)
        plain = descend(problem, task.plain_rate, 0.0, task.iterations)
        told = summary(problem, momentum, plain)
        columns = motions(given.run, problem, momentum)
        columns["time"] = STEP * FINE * np.arange(len(columns["plant"]))
        columns["emulated_time"] = STEP * SUPER_STEP * np.arange(LENGTH + 1)
        write(given.out, told, rows_of(given.task, told, task), columns)


if __name__ == "__main__":
    sys.exit(cli.run(main))
