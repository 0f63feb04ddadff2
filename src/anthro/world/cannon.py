"""A cannon that shoots balls at a limb (Nakada et al. 2018, Sec. 8.3, Fig. 23).

Where it stands and how fast it shoots is not printed; flights of 0.8 to 1.4 s from 2.5 to 4 m ahead are ours.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from anthro.errors import UserError
from anthro.world.balls import GRAVITY


@dataclass(frozen=True)
class Shot:
    """A ball's start (3,) m and velocity (3,) m/s, the point (3,) m that it passes after ``flight`` s, and for whom."""

    limb: str
    muzzle: np.ndarray
    velocity: np.ndarray
    target: np.ndarray
    flight: float

    def position(self, time) -> np.ndarray:
        """Where the ball is, (3,) or (T, 3) m, at times () or (T,) s after the shot if it meets nothing."""
        t = np.asarray(time, float)[..., None]
        return self.muzzle + t * (self.velocity + 0.5 * t * np.array(GRAVITY))


def launch_velocity(muzzle, target, flight: float) -> np.ndarray:
    """Velocity (3,) m/s with which a ball in free fall from ``muzzle`` passes ``target`` after ``flight`` s.

    v = (target - muzzle) / T - g T / 2.

    Raises
    ------
    UserError
        The flight takes no time, or a number is not finite.
    """
    if not (np.isfinite(flight) and flight > 0.0):
        raise UserError(f"cannon: a flight must take some time, got {flight} s")
    if np.shape(muzzle) != (3,) or np.shape(target) != (3,) or not np.isfinite([muzzle, target]).all():
        raise UserError(f"cannon: muzzle {muzzle} and target {target} must be three finite numbers each")
    return np.subtract(target, muzzle) / flight - 0.5 * flight * np.array(GRAVITY)


@dataclass
class Cannon:
    """Draws shots.

    Attributes
    ----------
    limb : whom the balls are for.
    target : draws a point (3,) m within its reach.
    rng : of muzzle and flight.
    flight : s, from and to.
    low, high : (3,) m, corners of the box that muzzles lie in.

    Raises
    ------
    UserError
        Flights are not positive, or a range has no length to draw from.
    """

    limb: str
    target: Callable[[], np.ndarray]
    rng: np.random.Generator
    flight: tuple[float, float] = (0.8, 1.4)
    low: tuple[float, float, float] = (2.5, -0.6, 0.9)
    high: tuple[float, float, float] = (4.0, 0.6, 1.5)

    def __post_init__(self):
        if not 0.0 < self.flight[0] <= self.flight[1] < np.inf:
            raise UserError(f"cannon: flights must take from some to more seconds, got {self.flight}")
        if not np.all(np.asarray(self.low, float) <= np.asarray(self.high, float)):
            raise UserError(f"cannon: the muzzles' box has no inside, from {self.low} to {self.high}")

    def shoot(self) -> Shot:
        """A ball that comes at the limb."""
        muzzle, flight = self.rng.uniform(self.low, self.high), float(self.rng.uniform(*self.flight))
        target = np.asarray(self.target(), float)
        return Shot(self.limb, muzzle, launch_velocity(muzzle, target, flight), target, flight)
