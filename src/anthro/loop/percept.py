"""One look: from optic nerve vectors to directions and offsets, turned from the eyes' frames by the body's own pose.

Vision DNNs answer in the frame of their eye. The angles of the eyes and of the neck, which a body senses of itself,
turn the answers into one frame: the world's, as far as the body's own posture tells it. The target itself is known by
the answers alone.

Whether there is a target is told by the receptors' colours: a ball is red, nothing else is. Its place is not read from
them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import mujoco
import numpy as np

from anthro.eyes.sight import Eyes, as_bytes
from anthro.eyes.vision import Vision
from anthro.motor.senses import direction

REDDER = 2  # red over the larger of green and blue: nothing but a red ball has as much, which has 10
DARK = 30  # bytes of red, below which no colour is told


@dataclass(frozen=True)
class Percept:
    """What one look told.

    Attributes
    ----------
    time : s.
    nerve : (2, n) uint8, optic nerve vectors of the left and the right eye.
    discrepancy : (2, 2) rad, what the foveation DNNs say; NaN of an eye that sees no target.
    directions : (2, 3) unit, from each eye to the target, in the world; None where there is no target.
    centres : (2, 3) m, of the pupils, in the world.
    offsets : by limb (3,) m, from its effector to the target, in the world; of limbs that were asked for.
    """

    time: float
    nerve: np.ndarray
    discrepancy: np.ndarray
    directions: np.ndarray | None
    centres: np.ndarray
    offsets: dict[str, np.ndarray] = field(default_factory=dict)

    @property
    def direction(self) -> np.ndarray:
        """Mean (3,) of both eyes' directions, unit."""
        mean = self.directions.mean(axis=0)
        return mean / np.linalg.norm(mean)

    @property
    def origin(self) -> np.ndarray:
        """Between the pupils of the eyes that see the target (3,) m."""
        return self.centres[np.isfinite(self.discrepancy).all(axis=1)].mean(axis=0)

    @property
    def baseline(self) -> float:
        """Distance between the pupils, m."""
        return float(np.linalg.norm(self.centres[1] - self.centres[0]))

    @property
    def fixation(self) -> np.ndarray | None:
        """Where both eyes' lines to the target pass each other (3,) m, in the world; None unless both see it."""
        return crossing(self.centres, self.directions) if np.isfinite(self.discrepancy).all() else None


def crossing(origins: np.ndarray, directions: np.ndarray) -> np.ndarray | None:
    """The point (3,) m nearest to two lines from origins (2, 3) m along unit directions (2, 3); None if not ahead."""
    along = np.stack([directions[0], -directions[1]], axis=1)
    lengths = np.linalg.lstsq(along, origins[1] - origins[0], rcond=None)[0]
    return (origins + lengths[:, None] * directions).mean(axis=0) if lengths.min() > 0.0 else None


def red_receptors(nerve: np.ndarray) -> np.ndarray:
    """How many receptors of each eye (2,) receive red, of optic nerve vectors (2, 3 n) uint8."""
    red, green, blue = np.moveaxis(nerve.reshape(len(nerve), -1, 3), -1, 0)
    return ((red > DARK) & (red // REDDER > np.maximum(green, blue))).sum(axis=1)


class Onlooker:
    """Eyes with the DNNs behind them.

    Parameters
    ----------
    eyes : Eyes
    vision : Vision
    receptors : int
        The fewest by which an eye tells of a target; an eye without goes where the other one looks.
    foveated : float
        Angle from the gaze, rad, up to which limb vision is asked.
    open_eyes : sequence of int
        Those that look, of 0 (left) and 1 (right); a shut one turns with the other.
    """

    def __init__(
        self, eyes: Eyes, vision: Vision, receptors: int, foveated: float, open_eyes: Sequence[int] = (0, 1)
    ) -> None:
        self.eyes, self.vision = eyes, vision
        self._receptors, self._foveated, self._open = receptors, foveated, list(open_eyes)

    def look(self, data: mujoco.MjData, time: float, limbs: Sequence[str]) -> Percept:
        """See, and have the DNNs answer, at a time, s, for some limbs."""
        eyes = self.eyes
        nerve = as_bytes(eyes.see(data))
        rotation, position = eyes.head(data)
        red = red_receptors(nerve)
        centres = position + np.array([eye.centre for eye in eyes.eyes]) @ rotation.T
        looking = [k for k in self._open if red[k] >= self._receptors]
        discrepancy = np.full((2, 2), np.nan)
        if not looking:
            return Percept(time, nerve, discrepancy, None, centres)
        discrepancy[looking] = self.vision.discrepancy(nerve)[looking]
        turns = [rotation @ eye.rotation(pair) for eye, pair in zip(eyes.eyes, eyes.angles, strict=True)]
        seen = np.array([turns[k] @ direction(*discrepancy[k]) for k in looking])
        directions = seen if len(seen) == 2 else seen.repeat(2, axis=0)
        offsets = {}
        if np.abs(discrepancy[looking]).max() <= self._foveated:
            for limb in limbs:
                told = self.vision.offsets(limb, nerve)
                offsets[limb] = np.mean([turns[k] @ told[k] for k in looking], axis=0)
        return Percept(time, nerve, discrepancy, directions, centres, offsets)
