"""The tasks of limbs, by what their controllers sense, and when a target counts as met."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from anthro.body.simulator import DEFAULT_STEP
from anthro.demos.session import SUCCESS_RADIUS, settled
from anthro.motor.limb import Limb


@dataclass(frozen=True)
class Task:
    """Targets in a row for limbs of one sense, and when one counts as met.

    Attributes
    ----------
    name : of the demo.
    unit : in which distances are shown: "m" or "deg".
    radius : m or rad, of the mean distance over the last 0.25 s of a target below which it is met.
    seconds : of each target.
    share : of each joint's range from which targets come.
    bar : least success rate that is asked for.
    bars : what is asked of further metrics, at most.
    compared : number of targets that are tried without reflex and by the teacher as well.
    source : section of the papers.
    """

    name: str
    unit: str
    radius: float
    seconds: float
    share: float
    bar: float
    bars: dict[str, float]
    compared: int
    source: str

    def shown(self, distance):
        """A distance in m or rad, in the task's unit."""
        return np.rad2deg(distance) if self.unit == "deg" else distance

    def met(self, distance) -> np.ndarray:
        """Which targets (n,) of distances (n, steps) in m or rad are met."""
        return settled_errors(distance) < self.radius

    def summary(self, distance, prefix: str = "") -> dict:
        """Success rate, settled errors and time to the radius of distances (n, steps) in m or rad."""
        last, met = settled_errors(distance), self.met(distance)
        times = [time_to_radius(one, self.radius) for one in distance[met]]
        found = {
            "success_rate": float(met.mean()),
            f"median_error_{self.unit}": float(self.shown(np.median(last))),
            f"p90_error_{self.unit}": float(self.shown(np.quantile(last, 0.9))),
            "median_time_s": float(np.median(times)) if times else None,
        }
        return {f"{prefix}{name}": value for name, value in found.items()}


TASKS = {
    "position": Task("reach", "m", SUCCESS_RADIUS, 1.5, 0.7, 0.90, {"median_error_m": 0.015}, 50, "Sec. 8.1"),
    "gaze": Task("head", "deg", np.deg2rad(2.0), 1.5, 0.6, 0.90, {"held_deviation_deg": 1.0}, 30, "Sec. 5.1"),
    "orientation": Task("core", "deg", np.deg2rad(3.0), 3.0, 0.4, 0.85, {"held_error_deg": 2.0}, 10, "Sec. 4.1"),
}


def task_of(limb: Limb) -> Task:
    """The task of a limb, by what its controller senses."""
    return TASKS[limb.plan.senses]


def settled_errors(distance) -> np.ndarray:
    """Mean distances (n,) over the last 0.25 s of distances (n, steps)."""
    return np.array([settled(one) for one in distance])


def time_to_radius(distance, radius: float = SUCCESS_RADIUS) -> float | None:
    """Seconds after which distances (steps,) first come under a radius; None when they never do."""
    inside = np.flatnonzero(np.asarray(distance) < radius)
    return float((inside[0] + 1) * DEFAULT_STEP) if len(inside) else None
