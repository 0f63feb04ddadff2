"""Controllers learned through an emulator: an objective, its gradient through time, gradient descent with momentum."""

from __future__ import annotations

import time
from dataclasses import dataclass, field

import numpy as np

from anthro.errors import UserError
from anthro.neuroanimator.emulator import Emulator
from anthro.neuroanimator.plants import plant_of
from anthro.neuroanimator.plants.plant import STEP
from anthro.neuroanimator.sample import checked
from anthro.neuroanimator.segments import Segments
from anthro.neuroanimator.tasks import SUPER_STEP, Task


class Problem:
    """A task on an emulator and on the plant that it emulates.

    Controls are (knots, n_control), as shares of the plant's upper limits.

    Parameters
    ----------
    task : Task
    emulator : Emulator
        Of super-steps of `SUPER_STEP`; of the dolphin the global one.
    """

    def __init__(self, task: Task, emulator: Emulator):
        self.task, self.emulator, self.plant = task, emulator, plant_of(task.plant)
        self.low, self.high = self.plant.low / self.plant.high, np.ones(self.plant.n_control)
        self.expansion = task.expansion
        self.segments = Segments(self.plant) if task.plant == "dolphin" else None
        self.begin = task.start if self.segments is None else self.plant.rest  # in the plant's own variables

    def clip(self, controls: np.ndarray) -> np.ndarray:
        """Return controls within the plant's limits."""
        return np.clip(controls, self.low, self.high)

    def inputs(self, controls: np.ndarray) -> np.ndarray:
        """Return the plant's inputs (LENGTH, n_control) of each super-step."""
        return self.expansion @ controls * self.plant.high

    def emulate(self, controls: np.ndarray) -> np.ndarray:
        """Return the emulated states (LENGTH + 1, n)."""
        return self.emulator.rollout(self.task.start, self.inputs(controls))

    def simulate(self, controls: np.ndarray) -> np.ndarray:
        """Return the plant's states (LENGTH + 1, n), in the variables of the emulator.

        Raises
        ------
        UserError
            Naming the step and the variable, when the simulation diverges.
        """
        state = self.begin
        states = [state]
        for number, inputs in enumerate(self.inputs(controls)):
            state = checked(self.plant, self.plant.step(state, inputs, steps=SUPER_STEP), number * SUPER_STEP * STEP)
            states.append(state)
        states = np.array(states)
        return states if self.segments is None else self.segments.split(states)[0]

    def cost(self, controls: np.ndarray, states: np.ndarray) -> float:
        """Return the objective (Grzeszczuk 1998, Eq. 11 and 12), smaller being better."""
        task = self.task
        motion = 0.5 * float(np.sum(task.weights * np.square(states - task.desired)))
        return 0.5 * task.effort * float(np.sum(np.square(controls))) + motion - float(task.reward @ states[-1])

    def slope(self, controls: np.ndarray, states: np.ndarray) -> np.ndarray:
        """Return the objective's derivative by the controls (knots, n_control), through time."""
        task = self.task
        by_states = task.weights * (states - task.desired)
        by_states[-1] -= task.reward
        by_inputs = self.emulator.slopes(states, self.inputs(controls), by_states)
        return task.effort * controls + self.expansion.T @ (by_inputs * self.plant.high)


@dataclass
class Descent:
    """What a descent went through: one entry for each iteration, the first before any.

    Attributes
    ----------
    costs, goals : list of float
    controls : list of ndarray, (knots, n_control)
    seconds : float
        Wall time of all iterations.
    """

    costs: list[float] = field(default_factory=list)
    goals: list[float] = field(default_factory=list)
    controls: list[np.ndarray] = field(default_factory=list)
    seconds: float = 0.0

    @property
    def reached(self) -> int | None:
        """First iteration at which the goal is reached."""
        return next((number for number, goal in enumerate(self.goals) if goal <= 1.0), None)

    @property
    def best(self) -> int:
        """Iteration with the least cost."""
        return int(np.argmin(self.costs))


def descend(
    problem: Problem, rate: float, momentum: float, iterations: int, start: np.ndarray | None = None
) -> Descent:
    """Learn controls (Grzeszczuk 1998, Eq. 13 to 15): each iteration emulates once and goes back through time once.

    Parameters
    ----------
    problem : Problem
    rate, momentum : float
        ``eta_x`` and ``alpha_x``; without momentum it is plain gradient descent.
    iterations : int
    start : ndarray, (knots, n_control), optional
        Controls to begin with; the task's, if they are not given.

    Raises
    ------
    UserError
        Naming the iteration, the super-step and the variable, when an emulation diverges.
    """
    found, controls = Descent(), problem.clip(problem.task.first if start is None else start)
    change = np.zeros_like(controls)
    started = time.perf_counter()
    for number in range(iterations + 1):
        try:
            states = problem.emulate(controls)
        except UserError as error:
            raise UserError(f"{problem.task.name}, iteration {number}: {error}") from None
        found.costs.append(problem.cost(controls, states))
        found.goals.append(problem.task.reached(states))
        found.controls.append(controls)
        change = momentum * change - rate * problem.slope(controls, states)
        controls = problem.clip(controls + change)
    found.seconds = time.perf_counter() - started
    return found
