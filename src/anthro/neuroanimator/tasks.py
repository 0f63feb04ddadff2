"""The four control tasks (Grzeszczuk 1998, Sec. 6 and Fig. 13): start, controls, objective and goal, in data.

Objectives are those of Eq. 11 and 12 turned round into costs. Every task lasts 20 s: 2,000 physical steps, 40
super-steps of 50. States are those of the emulator, for the dolphin the frames of its segments.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from anthro.errors import UserError
from anthro.neuroanimator.plants import plant_of
from anthro.neuroanimator.plants.lander import HEIGHT
from anthro.neuroanimator.segments import COUNT, PLACE, Segments

SUPER_STEP = 50  # physical steps
LENGTH = 40  # super-steps
RAISED = 1.6  # rad: the pendulum's arm, straight, above the horizontal
SWUM = 1.5  # m
SLOW = 4  # super-steps before the landing in which the descent must be slow


@dataclass(frozen=True)
class Task:
    """One control task.

    Attributes
    ----------
    name, plant : str
    start : ndarray, (n,)
    desired : ndarray, (n,)
        The state that is wanted.
    weights : ndarray, (LENGTH + 1, n)
        Of the squared distance from it, at each moment and for each variable.
    reward : ndarray, (n,)
        Gain for each unit of a variable at the end.
    knots : int
        Values of each control input over the 20 s.
    smooth : bool
        Whether inputs go from one value to the next along a line; else they are held.
    first : ndarray, (knots, n_control)
        Controls at the beginning, as shares of the plant's upper limits.
    effort : float
        Weight of the squared controls (``mu_u``).
    rate, momentum, plain_rate : float
        Of gradient descent with momentum (Eq. 14 and 15), and of plain gradient descent (Eq. 13).
    iterations : int
        What the paper reports.
    shares : dict of str to callable
        Parts of the goal: each takes the states (LENGTH + 1, n); its number is 1 at most when it is reached.
    goal : str
        The goal in words.
    """

    name: str
    plant: str
    start: np.ndarray
    desired: np.ndarray
    weights: np.ndarray
    reward: np.ndarray
    knots: int
    smooth: bool
    first: np.ndarray
    effort: float
    rate: float
    momentum: float
    plain_rate: float
    iterations: int
    shares: dict[str, Callable[[np.ndarray], float]]
    goal: str

    @property
    def variables(self) -> int:
        """Number of control variables that are optimised."""
        return self.first.size

    @property
    def expansion(self) -> np.ndarray:
        """Matrix (LENGTH, knots) from values to the inputs of each super-step."""
        if not self.smooth:
            return np.kron(np.eye(self.knots), np.ones((LENGTH // self.knots, 1)))
        moments = (np.arange(LENGTH) + 0.5) * self.knots / LENGTH - 0.5
        columns = [np.interp(moments, np.arange(self.knots), row) for row in np.eye(self.knots)]
        return np.stack(columns, axis=1)

    def reached(self, states: np.ndarray) -> float:
        """Largest part of the goal, which is reached at 1 or less."""
        return max(share(states) for share in self.shares.values())


def _last(weight) -> np.ndarray:
    """Weights that count at the end only."""
    weights = np.zeros((LENGTH + 1, len(weight)))
    weights[-1] = weight
    return weights


def _scaled(reach) -> np.ndarray:
    """Weights at the end only: the inverse square of how far controls of unit size carry each variable.

    The reach of each was read off the plant's derivative by the controls at the start; so weighted, no variable's
    slope drowns another's, and plain gradient descent can follow all of them.
    """
    return _last(1.0 / np.square(reach))


def _off(desired: np.ndarray, part: slice, bar: float) -> Callable[[np.ndarray], float]:
    """Largest distance of some variables from where they shall end, over a bar."""
    return lambda states: float(np.abs(states[-1, part] - desired[part]).max() / bar)


def pendulum() -> Task:
    """Swing up: the straight arm at rest for a moment, above the horizontal."""
    plant = plant_of("active_pendulum")
    desired = np.array([RAISED, 0, 0, 0, 0, 0])
    return Task(
        name="pendulum",
        plant=plant.name,
        start=plant.rest,
        desired=desired,
        weights=_last([1.0, 1.0, 1.0, 0.2, 0.2, 0.2]),
        reward=np.zeros(6),
        knots=20,
        smooth=False,
        first=np.zeros((20, 3)),
        effort=0.0,
        rate=3.0,
        momentum=0.5,
        plain_rate=2.0,
        iterations=20,
        shares={"angle": _off(desired, slice(0, 3), 0.3), "rate": _off(desired, slice(3, 6), 0.5)},
        goal=f"arm at {RAISED} rad from hanging, each joint within 0.3 rad and 0.5 rad/s",
    )


def one_go() -> float:
    """Return what work the pendulum's motors can do without turning back, over the energy that raising the arm takes.

    Below 1, they have to swing. A motor's work is at most its torque times the angle of its joint.
    """
    plant, task = plant_of("active_pendulum"), pendulum()
    lift = plant.energy(task.desired) - plant.energy(task.start)
    return float(plant.high @ np.abs(task.desired - task.start)[: plant.n_control] / lift)


def truck() -> Task:
    """Park beside and ahead of where it stands, heading as before."""
    plant = plant_of("truck")
    desired = np.array([18.0, 3.0, 0, 0, 0, 0])
    first = np.tile([0.2, 0.0], (20, 1))
    return Task(
        name="truck",
        plant=plant.name,
        start=np.zeros(6),
        desired=desired,
        weights=_scaled([19.0, 6.3, 0.62, 1.9, 1.0, 1.0]),
        reward=np.zeros(6),
        knots=20,
        smooth=False,
        first=first,
        effort=0.0,
        rate=0.5,
        momentum=0.7,
        plain_rate=0.5,
        iterations=15,
        shares={
            "place": _off(desired, slice(0, 2), 0.5),
            "heading": _off(desired, slice(2, 3), 0.1),
            "velocity": _off(desired, slice(3, 6), 0.2),
        },
        goal="parked within 0.5 m, 0.1 rad and 0.2 m/s",
    )


def lander() -> Task:
    """Land softly: upright on the surface, the descent slow before."""
    plant = plant_of("lander")
    desired = plant.rest.copy()
    desired[2] = HEIGHT
    start = plant.rest.copy()
    start[:3], start[7:10] = (3.0, -2.0, 15.0), (0.2, 0.0, -0.5)
    first = np.tile([0.5, 0, 0, 0], (20, 1))
    return Task(
        name="lander",
        plant=plant.name,
        start=start,
        desired=desired,
        weights=_scaled([120.0, 120.0, 120.0, 1.0, 0.64, 0.64, 0.64, 23.0, 23.0, 14.5, 2.0, 2.0, 2.0]),
        reward=np.zeros(13),
        knots=20,
        smooth=False,
        first=first,
        effort=0.0,
        rate=0.7,
        momentum=0.7,
        plain_rate=0.5,
        iterations=15,
        shares={
            "place": _off(desired, slice(0, 3), 1.0),
            "attitude": _off(desired, slice(3, 7), 0.05),
            "velocity": _off(desired, slice(7, 10), 0.5),
            "descent": lambda states: float(np.abs(states[-1 - SLOW :, 9]).max() / 1.5),
        },
        goal="on the surface within 1 m, 0.1 rad and 0.5 m/s, the last 2 s of descent under 1.5 m/s",
    )


def dolphin() -> Task:
    """Swim forward as far as possible, with little work of muscles."""
    rest = Segments(plant_of("dolphin")).rest
    forward = np.zeros(len(rest))
    forward[PLACE : PLACE + 3 * COUNT : 3] = 1.0 / COUNT
    wave = np.sin(2 * np.pi * np.arange(10) * 0.37)[:, None] * np.ones(3)
    return Task(
        name="dolphin",
        plant="dolphin",
        start=rest,
        desired=np.zeros(len(rest)),
        weights=np.zeros((LENGTH + 1, len(rest))),
        reward=forward,
        knots=10,
        smooth=True,
        first=0.3 + 0.1 * np.concatenate([wave, -wave], axis=1),
        effort=0.01,
        rate=1.0,
        momentum=0.5,
        plain_rate=1.0,
        iterations=20,
        shares={"distance": lambda states: float(SWUM / max(1e-9, (states[-1] - states[0]) @ forward))},
        goal=f"{SWUM:g} m forward",
    )


TASKS = {"pendulum": pendulum, "truck": truck, "lander": lander, "dolphin": dolphin}


def task_of(name: str) -> Task:
    """Return a task.

    Raises
    ------
    UserError
        When there is none of that name.
    """
    if name not in TASKS:
        raise UserError(f"unknown task {name!r}; known: {', '.join(TASKS)}")
    return TASKS[name]()
