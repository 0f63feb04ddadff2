"""Where a limb meets a ball: on the flight that is expected from what was seen, within what the limb reaches."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from anthro.loop.flight import Flight, covariance
from anthro.loop.percept import Percept
from anthro.loop.plan import FlightPlan, MeetingPlan

SPACING = 0.05  # m from a known place of the effector, within which another one counts as reached
INSTANTS = 75  # of the expected flight that are looked at
SOONEST = 0.01  # s


class Meeting:
    """Leads an effector to where it can meet the ball that is seen.

    Of the instants at which the expected flight passes within reach, that one is taken for which the effector has to
    move least fast. Where the flight does not come within reach, the limb is made ready: its effector goes to the
    reached place nearest to the flight (Nakada 2018, Sec. 8.4: preparatory movements).

    Parameters
    ----------
    places : ndarray (k, 3)
        Where the effector can go, m: what the body knows of its own limb.
    """

    def __init__(self, places: np.ndarray, flight: FlightPlan, plan: MeetingPlan):
        self.plan, self.flight = plan, Flight(flight)
        self._places, self._tree = np.asarray(places, float), cKDTree(places)
        self.reset()

    def reset(self) -> None:
        self.flight.reset()
        self.estimate: np.ndarray | None = None
        self._goal: np.ndarray | None = None

    def notice(self, percept: Percept, offset: np.ndarray, effector: np.ndarray) -> None:
        distance, doubt = self._distance(percept, offset, effector)
        self.estimate = percept.origin + distance * percept.direction
        spread = covariance(self.flight.plan, percept.direction, distance, doubt)
        self.flight.see(percept.time, self.estimate, spread)
        self._goal = self._meet(percept.time, effector)

    def _distance(self, percept: Percept, offset: np.ndarray, effector: np.ndarray) -> tuple[float, float]:
        """Of the ball from between the eyes, by the limb's vision and by the eyes' convergence: m, and its deviation.

        Each is weighted with its certainty. That of convergence falls with the square of the distance.
        """
        plan, fixation = self.flight.plan, percept.fixation
        told = [np.linalg.norm(effector + offset - percept.origin)]
        doubts = [plan.near_sd + plan.far_sd * np.linalg.norm(offset)]
        if fixation is not None:
            told.append(np.linalg.norm(fixation - percept.origin))
            doubts.append(np.deg2rad(plan.convergence_sd_deg) * told[-1] ** 2 / percept.baseline)
        certainty = np.array(doubts) ** -2.0
        return float(certainty @ told / certainty.sum()), float(certainty.sum() ** -0.5)

    def goal(self) -> np.ndarray | None:
        return self._goal

    def _meet(self, now: float, effector: np.ndarray) -> np.ndarray:
        times = now + np.linspace(SOONEST, self.plan.ahead, INSTANTS)
        path = self.flight.path(times)
        gap, nearest = self._tree.query(path)
        within = np.flatnonzero(gap <= SPACING)
        if len(within):
            speed = np.linalg.norm(path[within] - effector, axis=1) / (times[within] - now)
            return path[within[np.argmin(speed)]]
        return self._places[nearest[np.argmin(gap)]]
