"""Where eyes and head look between looks: directions that are followed, and turned back as the head turns."""

from __future__ import annotations

import numpy as np

from anthro.eyes.sight import Eyes
from anthro.loop.plan import GazePlan, HeadPlan
from anthro.motor.senses import angles, direction


class Gaze:
    """The directions from both eyes to what they look at: an alpha-beta filter in the world's frame.

    What is seen otherwise than expected moves directions and their velocities, by a share each; a jump only the former.
    Commands to the eyes are directions in the head as it is now, so that a head that turns does not carry the gaze off.
    """

    def __init__(self, plan: GazePlan):
        self.plan = plan
        self.reset()

    def reset(self) -> None:
        """Look at nothing."""
        self._directions: np.ndarray | None = None
        self._velocity = np.zeros((2, 3))
        self._time = 0.0

    def follow(self, directions: np.ndarray | None, time: float) -> None:
        """Take in directions (2, 3) that were seen at a time, s; None lets the eyes rest."""
        if directions is None or self._directions is None:
            self.reset()
            self._directions, self._time = directions, time
            return
        plan, passed = self.plan, time - self._time
        otherwise = directions - self.directions(time)
        if np.linalg.norm(otherwise, axis=1).max() > np.deg2rad(plan.jump_deg):
            self._directions, self._velocity = directions, np.zeros((2, 3))
        else:
            self._directions = _unit(self.directions(time) + plan.position_gain * otherwise)
            self._velocity = self._velocity + plan.velocity_gain / passed * otherwise
        self._time = time

    def directions(self, time: float) -> np.ndarray:
        """Where they are expected (2, 3) at a time, s; only while there is something to look at."""
        return _unit(self._directions + (time - self._time) * self._velocity)

    def command(self, eyes: Eyes, rotation: np.ndarray, time: float) -> np.ndarray:
        """Angles (2, 2), rad, that both eyes turn to, with the head's rotation (3, 3); ahead if there is nothing."""
        if self._directions is None:
            return np.zeros((2, 2))
        x, y, z = (self.directions(time) @ rotation).T
        return np.stack([np.arctan2(y, x), np.arctan2(z, np.hypot(x, y))], axis=1)


def head_target(plan: HeadPlan, base: np.ndarray, towards: np.ndarray) -> np.ndarray:
    """Direction (3,) of the world to which the head is led: that one (3,), as far as the neck's base (3, 3) allows.

    The paper feeds the neck with the mean of the foveation DNNs' outputs. Those are 0 for eyes that foveate, so that a
    head which followed them alone would stay where it is once the eyes have arrived; here it is led to where the eyes
    look together with what the outputs add.
    """
    azimuth, elevation = angles(base.T @ towards)
    azimuth = np.clip(azimuth, *np.deg2rad(plan.azimuth_deg))
    return base @ direction(azimuth, np.clip(elevation, *np.deg2rad(plan.elevation_deg)))


def _unit(vectors: np.ndarray) -> np.ndarray:
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)
