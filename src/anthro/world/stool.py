"""A stool that is shaken with the body on it (Nakada et al. 2018, Sec. 8.6).

The paper displaces the stool by a continuous sinusoid, vertically and horizontally, with amplitudes of 10 cm at 3.75 Hz
and 70 cm at 6 Hz: 5.7 and 101 times gravity at the turning points. The amplitude is read as the sinusoid's, half of the
whole way. The sinusoid is faded in over one second, as it would begin with a jump in velocity.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from anthro.body.simulator import ROOT, Simulator
from anthro.errors import UserError

EASE_SECONDS = 1.0
VERTICAL, HORIZONTAL = (0.0, 0.0, 1.0), (1.0, 0.0, 0.0)


@dataclass(frozen=True)
class Shaking:
    """A displacement s(t / ease) A sin(2 pi f t) along a direction, with s = 10 x^3 - 15 x^4 + 6 x^5 up to 1.

    Attributes
    ----------
    amplitude : A in m.  frequency : f in Hz.
    direction : (3,), made of length one.
    ease : s, until the amplitude is reached.

    Raises
    ------
    UserError
        Amplitude is negative, frequency or ease not positive, or the direction none.
    """

    amplitude: float
    frequency: float
    direction: tuple[float, float, float] = VERTICAL
    ease: float = EASE_SECONDS

    def __post_init__(self):
        if not (0.0 <= self.amplitude < np.inf and 0.0 < self.frequency < np.inf and 0.0 < self.ease < np.inf):
            raise UserError(f"shaking: amplitude must not be negative, frequency and ease be positive, got {self}")
        length = np.linalg.norm(self.direction)
        if np.shape(self.direction) != (3,) or not 0.0 < length < np.inf:
            raise UserError(f"shaking: direction must be three numbers that are not all zero, got {self.direction}")
        object.__setattr__(self, "direction", tuple(float(x) for x in np.asarray(self.direction) / length))

    def displacement(self, time) -> np.ndarray:
        """Displacements (3,) or (T, 3) m at times () or (T,) s."""
        return np.multiply.outer(self._parts(time)[0], self.direction)

    def velocity(self, time) -> np.ndarray:
        """Velocities (3,) or (T, 3) m/s at times () or (T,) s."""
        return np.multiply.outer(self._parts(time)[1], self.direction)

    def _parts(self, time) -> tuple[np.ndarray, np.ndarray]:
        share = np.clip(np.asarray(time, float) / self.ease, 0.0, 1.0)
        fade, rise = share**3 * (10.0 + share * (6.0 * share - 15.0)), 30.0 * (share * (1.0 - share)) ** 2 / self.ease
        pace = 2.0 * np.pi * self.frequency
        sine, cosine = np.sin(pace * np.asarray(time)), np.cos(pace * np.asarray(time))
        return self.amplitude * fade * sine, self.amplitude * (rise * sine + fade * pace * cosine)


PAPER = {"10 cm at 3.75 Hz": (0.10, 3.75), "70 cm at 6 Hz": (0.70, 6.0)}  # amplitude, frequency


class Stool:
    """Shakes the fixed root of a movable body (:meth:`anthro.body.Body.movable`), from the simulator's present time on.

    Attributes
    ----------
    shaking : the motion.  start : s, when it began.
    """

    def __init__(self, simulator: Simulator, shaking: Shaking):
        self.simulator, self.shaking, self.start = simulator, shaking, simulator.time
        self._root = np.concatenate([simulator.model.body_pos[ROOT], simulator.model.body_quat[ROOT]])

    def shake(self) -> None:
        """Carry the root through the next step; called before each one.

        Raises
        ------
        UserError
            The root is free, or the body has ground or seat around it.
        """
        simulator = self.simulator
        then = simulator.time + simulator.step_seconds - self.start
        simulator.carry(self.shaking.displacement(then), self.shaking.velocity(then))

    def pose(self, times) -> np.ndarray:
        """Position in m and quaternion (w first) of the root, (7,) or (T, 7), at the simulator's times () or (T,) s."""
        moved = self.shaking.displacement(np.maximum(np.asarray(times) - self.start, 0.0))
        result = np.empty((*moved.shape[:-1], 7))
        result[..., :3], result[..., 3:] = self._root[:3] + moved, self._root[3:]
        return result
