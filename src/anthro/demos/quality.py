"""How a limb moves beside where it arrives: effort, smoothness, and the shape of the effector's speed."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from anthro.body.simulator import Simulator
from anthro.demos.session import Recorder
from anthro.motor.limb import Limb

CUT = 0.05  # share of its peak above which the speed belongs to the movement
PROMINENT = 0.1  # share of the highest peak by which another one stands out


@dataclass
class Gauge:
    """Told each step: effort, smoothness and effector of one limb; passes the step on to a recorder.

    Attributes
    ----------
    effort : sums over the limb's muscles of squared activations, which the papers' muscle optimisation minimises.
    change : mean squares over the muscles of the activations' rates of change, 1/s^2; 0 at the first step.
    path : positions (3,) m of the effector.
    """

    simulator: Simulator
    limb: Limb
    recorder: Recorder | None = None
    effort: list = field(default_factory=list)
    change: list = field(default_factory=list)
    path: list = field(default_factory=list)
    _last: np.ndarray | None = None

    def take(self, activation, targets: dict, controller_on: bool = True) -> None:
        """Measure the step that begins with activations (n_body,)."""
        own = activation[self.limb.muscles]
        change = 0.0 if self._last is None else np.mean(np.square(own - self._last)) / self.simulator.step_seconds**2
        self._last = own
        self.effort.append(float(own @ own))
        self.change.append(float(change))
        self.path.append(self.simulator.data.site_xpos[self.limb.site].copy())
        if self.recorder:
            self.recorder.take(activation, targets, controller_on)


def speed_shape(path, step: float) -> tuple[float, int]:
    """Peak over mean speed of a movement, and how many peaks its speed has.

    Parameters
    ----------
    path : (T, 3) m, positions ``step`` seconds apart.

    Notes
    -----
    The movement lasts from the first to the last instant at which the speed is above 5 % of its peak. A minimum jerk
    movement has one peak, 1.875 times its mean speed; cut so, :func:`minimum_jerk_shape`.
    """
    from scipy.signal import find_peaks  # takes half a second, and most demos ask for no shape

    speed = np.linalg.norm(np.diff(path, axis=0), axis=1) / step
    peak = speed.max()
    moving = np.flatnonzero(speed >= CUT * peak)
    mean = speed[moving[0] : moving[-1] + 1].mean()
    peaks, _ = find_peaks(np.concatenate([[0.0], speed, [0.0]]), prominence=PROMINENT * peak)
    return float(peak / mean) if mean else float("nan"), len(peaks)


def minimum_jerk_shape() -> float:
    """Peak over mean speed that :func:`speed_shape` finds for a movement of minimum jerk (Flash and Hogan 1985)."""
    t = np.linspace(0.0, 1.0, 2001)
    way = t**3 * (10.0 - 15.0 * t + 6.0 * t**2)
    return speed_shape(way[:, None] * [1.0, 0.0, 0.0], t[1])[0]
