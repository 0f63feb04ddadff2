"""Drops of balls that come by sloped planes into a limb's reach (Nakada et al. 2018, Sec. 8.4, Fig. 25).

The paper lets a ball bounce on multiple sloped planes before the right arm intercepts it, and prints neither their
number nor their places: :func:`staircase` is ours.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from anthro.errors import UserError
from anthro.world.balls import Ball, Balls
from anthro.world.surfaces import Slope, tilted

TRIES = 2000  # drops looked at for one that comes into reach
SAMPLE = 0.005  # s, between the instants at which a path is looked at


def staircase(aside: float = -0.3) -> list[Slope]:
    """Three slopes ahead of the body, ``aside`` m to its left, each lower and nearer than the one before."""
    places = ((2.04, 1.58, 22.5), (1.62, 1.27, 12.0), (1.11, 0.77, 24.0))  # x and z in m, fall in degrees
    return [
        tilted(f"slope_{k}", (x, aside, z), (-1.0, 0.0), np.deg2rad(fall), half_size=(0.22, 0.4))
        for k, (x, z, fall) in enumerate(places, start=1)
    ]


@dataclass(frozen=True)
class Drop:
    """A ball's start (3,) m and velocity (3,) m/s; where (3,) m and when in s it comes into reach; bounces before."""

    position: np.ndarray
    velocity: np.ndarray
    point: np.ndarray
    arrival: float
    bounces: int


@dataclass
class Drops:
    """Draws drops that come into reach, by simulating them without the body.

    Attributes
    ----------
    slopes : what the ball bounces on.
    ball : the ball.
    within : tells which of points (n, 3) m are in reach (:meth:`anthro.world.reach.Reach.contains`).
    rng : of the drops.
    arrival : s, earliest and latest time in reach.
    low, high : (3,) m, corners of the box that balls are dropped in.
    speed : m/s, at most, to either side along x and y.

    Raises
    ------
    UserError
        There is no slope, or the box or the arrival has no inside.
    """

    slopes: Sequence[Slope]
    ball: Ball
    within: Callable[[np.ndarray], np.ndarray]
    rng: np.random.Generator
    arrival: tuple[float, float] = (0.8, 2.0)
    low: tuple[float, float, float] = (1.94, -0.5, 2.0)
    high: tuple[float, float, float] = (2.14, -0.1, 2.6)
    speed: float = 0.3

    def __post_init__(self):
        if not self.slopes:
            raise UserError("drops: there is no slope to bounce on")
        if not np.all(np.asarray(self.low, float) <= np.asarray(self.high, float)):
            raise UserError(f"drops: the box has no inside, from {self.low} to {self.high}")
        if not 0.0 < self.arrival[0] < self.arrival[1] < np.inf:
            raise UserError(f"drops: arrival must be from some to more seconds, got {self.arrival}")

    def draw(self) -> Drop:
        """A drop that comes into reach in time, after one bounce or more; UserError where hardly any does."""
        for _ in range(TRIES):
            position = self.rng.uniform(self.low, self.high)
            velocity = np.append(self.rng.uniform(-self.speed, self.speed, 2), 0.0)
            drop = self.follow(position, velocity)
            if drop is not None:
                return drop
        raise UserError(f"drops: none of {TRIES} came into reach within {self.arrival} s")

    def follow(self, position, velocity) -> Drop | None:
        """What becomes of a drop; None where it is too early, too late, or not at all in reach after a bounce."""
        balls = Balls([self.ball], surfaces=self.slopes)
        balls.throw(0, position, velocity)
        path = np.empty((round(self.arrival[1] / SAMPLE), 3))
        for k in range(len(path)):
            balls.advance(SAMPLE)
            path[k] = balls.position[0]
        reached = np.flatnonzero(self.within(path))
        if not len(reached):
            return None
        first = int(reached[0])
        time = SAMPLE * (first + 1)
        bounces = sum(hit.time < time for hit in balls.hits)
        if time < self.arrival[0] or not bounces:
            return None
        return Drop(np.array(position, float), np.array(velocity, float), path[first], time, bounces)
