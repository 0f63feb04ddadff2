"""What leads a limb: the places that its effector is to go to, made of what was seen of the target."""

from __future__ import annotations

from typing import Protocol

import numpy as np

from anthro.loop.percept import Percept
from anthro.loop.plan import ReachPlan


class Lead(Protocol):
    """Leads one limb."""

    estimate: np.ndarray | None  # where the target was seen last (3,) m, in the world

    def reset(self) -> None:
        """Forget what was seen."""

    def notice(self, percept: Percept, offset: np.ndarray, effector: np.ndarray) -> None:
        """Take in a look: offset (3,) m to the target from the effector (3,) m, both in the world."""

    def goal(self) -> np.ndarray | None:
        """Where the effector is to go (3,) m, in the world; None lets the limb rest."""


class Reaching:
    """Leads an effector to where its target is seen, as in the paper; the place is kept while the limb moves."""

    def __init__(self, plan: ReachPlan):
        self.plan = plan
        self.reset()

    def reset(self) -> None:
        self.estimate: np.ndarray | None = None
        self._place: np.ndarray | None = None

    def notice(self, percept: Percept, offset: np.ndarray, effector: np.ndarray) -> None:
        self.estimate = effector + offset
        known = self.estimate if self._place is None else self._place
        self._place = known + self.plan.gain * (self.estimate - known)

    def goal(self) -> np.ndarray | None:
        return self._place
