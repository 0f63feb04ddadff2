"""A ball's flight, fitted to what was seen of it: free fall between bounces that nobody announces.

Position p and velocity v at the time t0 of the first look are estimated by weighted least squares, kept recursively as
information matrix and vector: a place z seen at t adds  H^T W (z - g (t - t0)^2 / 2)  with H = [1, (t - t0)] and W the
inverse covariance of the look. Gravity g is known. Directions are seen better than distances.

Looks that are too far from the flight, several in a row, tell of a bounce: the fit begins anew from these looks. All
that is assumed of it beforehand is that it turns falling into rising; where and how steep the surface is stays unknown.
"""

from __future__ import annotations

import numpy as np

from anthro.loop.plan import FlightPlan

GRAVITY = np.array([0.0, 0.0, -9.81])  # m/s^2
SPEED, PLACE = slice(3, 6), slice(0, 3)
FAR = 10.0  # m, standard deviation of the place before anything is seen


def covariance(plan: FlightPlan, direction: np.ndarray, distance: float, doubt: float) -> np.ndarray:
    """Of a place seen in a unit direction (3,) at a distance that is known to ``doubt``, both m: (3, 3) m^2."""
    across = (np.deg2rad(plan.direction_sd_deg) * distance) ** 2
    return across * np.eye(3) + (doubt**2 - across) * np.outer(direction, direction)


class Flight:
    """One ball's flight; times in s, places in m."""

    def __init__(self, plan: FlightPlan):
        self.plan = plan
        self.reset()

    def reset(self) -> None:
        """Nothing was seen."""
        self.bounces = 0
        self._strange: list = []
        self._begin(np.zeros(3), self.plan.speed_sd)

    def _begin(self, velocity: np.ndarray, spread: float) -> None:
        """Begin anew with a velocity (3,) m/s that is known to within a standard deviation, m/s."""
        self._start: float | None = None
        certainty = np.array([FAR**-2] * 3 + [spread**-2] * 3)
        self._information = np.diag(certainty)
        self._vector = certainty * np.concatenate([np.zeros(3), velocity])
        self._solved: tuple | None = None

    def _bounce(self) -> None:
        """Begin anew from the strange looks."""
        looks, self._strange = self._strange, []
        before = self._state[0][SPEED] + (looks[0][0] - self._start) * GRAVITY
        self.bounces += 1
        rebound = self.plan.rebound * abs(before[2])
        self._begin(np.array([before[0], before[1], rebound]), self.plan.rebound_sd)
        for look in looks:
            self._add(*look)

    @property
    def known(self) -> bool:
        """Whether anything was seen of it."""
        return self._start is not None

    def see(self, time: float, place: np.ndarray, spread: np.ndarray) -> None:
        """Take in a place (3,) with its covariance (3, 3), seen at a time later than all before."""
        if self.known and self._is_strange(time, place, spread):
            self._strange.append((time, place, spread))
            if len(self._strange) >= self.plan.bounce_looks:
                self._bounce()
            return
        for look in self._strange:  # they were outliers, not a bounce
            self._add(*look)
        self._strange = []
        self._add(time, place, spread)

    def _is_strange(self, time: float, place: np.ndarray, spread: np.ndarray) -> bool:
        expected, doubt = self.at(time)
        gap = place - expected
        return gap @ np.linalg.solve(doubt + spread, gap) > self.plan.bounce_sd**2

    def _add(self, time: float, place: np.ndarray, spread: np.ndarray) -> None:
        if self._start is None:
            self._start = time
        passed = time - self._start
        slopes = self._slopes(passed)
        weighted = slopes.T @ np.linalg.inv(spread)
        self._information = self._information + weighted @ slopes
        self._vector = self._vector + weighted @ (place - 0.5 * passed**2 * GRAVITY)
        self._solved = None

    @staticmethod
    def _slopes(passed: float) -> np.ndarray:
        return np.hstack([np.eye(3), passed * np.eye(3)])

    @property
    def _state(self) -> tuple[np.ndarray, np.ndarray]:
        """Place and velocity (6,) at the start, and their covariance (6, 6)."""
        if self._solved is None:
            doubt = np.linalg.inv(self._information)
            self._solved = doubt @ self._vector, doubt
        return self._solved

    def at(self, time: float) -> tuple[np.ndarray, np.ndarray]:
        """Expected place (3,) and its covariance (3, 3) at a time, if the ball meets nothing."""
        state, doubt = self._state
        slopes = self._slopes(time - self._start)
        return slopes @ state + 0.5 * (time - self._start) ** 2 * GRAVITY, slopes @ doubt @ slopes.T

    def path(self, times: np.ndarray) -> np.ndarray:
        """Expected places (n, 3) at times (n,)."""
        passed = np.asarray(times, float)[:, None] - self._start
        state = self._state[0]
        return state[PLACE] + passed * (state[SPEED] + 0.5 * passed * GRAVITY)
