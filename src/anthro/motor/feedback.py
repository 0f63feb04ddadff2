"""What a controller makes of its limb's discrepancy before its voluntary network is told it.

The networks are told where the target is from the limb, not how fast the limb moves, and draw the drive to what held
the limb in their training. So a heavy trunk sways about its target, and a limb whose load is another than in training
stops short of it. The discrepancy is therefore told as it will be a moment later if the limb moves on as it does, and
with what has remained of it added up: lead and integral of a PID controller. A target that moves or jumps leads
nothing: the limb's own movement alone does. With ``lead`` and ``rate`` 0 the network is told the discrepancy itself, as
in Nakada et al. 2018, Sec. 5, and as it was trained.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

SMOOTHING = 0.02  # s, time constant of the velocity's filter


@dataclass(frozen=True)
class Feedback:
    """The keys of a region in ``config/feedback.yaml``.

    Attributes
    ----------
    lead : s, how far ahead the discrepancy is told.
    rate : 1/s, at which it is added up.
    near : m or rad. Discrepancies below are added up, to half of this; more is never led either.
    """

    lead: float = 0.0
    rate: float = 0.0
    near: float = 0.0


PLAIN = Feedback()


class FeedbackState:
    """What one controller keeps of its limb's discrepancy.

    Parameters
    ----------
    plan : what is made of it.
    step : s, of control.
    """

    def __init__(self, plan: Feedback, step: float):
        self.plan = plan
        self._step, self._share = step, min(step / SMOOTHING, 1.0)
        self.reset()

    def reset(self) -> None:
        """Forget all."""
        self._velocity, self._sum = 0.0, 0.0
        self._before, self._target = None, None

    def told(self, measure, target) -> np.ndarray:
        """What the network is told, (width,) m or rad, in the next control step.

        Parameters
        ----------
        measure : function of a target in the world that gives the discrepancy (width,) from it at present.
        target : where to, in the world.
        """
        plan, offset = self.plan, measure(target)
        result = offset
        if plan.lead:
            if self._before is not None:
                moved = (measure(self._target) - self._before) / self._step
                self._velocity += self._share * (_bounded(moved, plan.near / plan.lead) - self._velocity)
            self._before, self._target = offset, target
            result = result + plan.lead * self._velocity
        if plan.rate:
            if np.linalg.norm(offset) < plan.near:
                self._sum = _bounded(self._sum + plan.rate * self._step * offset, 0.5 * plan.near)
            result = result + self._sum
        return result


def _bounded(vector: np.ndarray, most: float) -> np.ndarray:
    """A vector (n,), shortened to a length where it is longer."""
    length = float(np.linalg.norm(vector))
    return vector if length <= most else vector * (most / length)
