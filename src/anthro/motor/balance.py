"""Where the support's force acts: the centre of pressure of a body that moves on a fixed pelvis."""

from __future__ import annotations

import numpy as np

from anthro.body.simulator import Simulator

GRAVITY = 9.81  # m/s^2
SMOOTHING = 0.05  # s, over which the acceleration of the centre of mass is taken


class Balance:
    """Follows the centre of pressure and tells when it nears the margin of the support (Zhou 2021, Sec. 4.1.1).

    The centre of pressure of a body whose centre of mass c moves over level ground at height z_0 is
    c - (c_z - z_0) a / (a_z + g), horizontally, with a the acceleration of c (angular momentum's change left out).

    Parameters
    ----------
    support : x_min, x_max, y_min, y_max of the ground that bears the body and z_0, m.
    """

    def __init__(self, support):
        *self.edges, self.height = support
        self._last = self._speed = None
        self._acceleration = np.zeros(3)

    def begin(self, simulator: Simulator) -> None:
        """Forget the past."""
        self._last, self._speed = simulator.centre_of_mass, np.zeros(3)
        self._acceleration = np.zeros(3)

    def lost(self, simulator: Simulator) -> bool:
        """Whether the centre of pressure of the step just taken has left the support."""
        h, now = simulator.step_seconds, simulator.centre_of_mass
        speed = (now - self._last) / h
        share = h / SMOOTHING
        self._acceleration += share * ((speed - self._speed) / h - self._acceleration)
        self._last, self._speed = now, speed
        x, y = self.centre_of_pressure(now, self._acceleration)
        x_min, x_max, y_min, y_max = self.edges
        return not (x_min < x < x_max and y_min < y < y_max)

    def centre_of_pressure(self, centre_of_mass, acceleration) -> np.ndarray:
        """Centre of pressure (2,) m."""
        lift = max(GRAVITY + acceleration[2], 0.1 * GRAVITY)
        return centre_of_mass[:2] - (centre_of_mass[2] - self.height) * acceleration[:2] / lift
