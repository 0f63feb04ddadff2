"""The ten vision DNNs online: from optic nerve vectors to what eyes, neck and limbs are told (Nakada 2018, Sec. 6.2).

A retina tells where things are from the gaze, not from the trunk: the target of one picture may lie before a head that
is turned or behind one that is not. So all vision DNNs answer in the frame of their own eye (x along the gaze, y left,
z up), which the optic nerve vector determines, and answers are turned into the head's frame by the angles of the eyes,
which a body knows of itself. Nothing here, or in what it imports, is told where a target is; a test holds it to that.

The two eyes' networks answer side by side, each in a thread: they wait for their weights to come from memory.
"""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np

from anthro.eyes.eye import SIDES, Eye
from anthro.motor import senses
from anthro.motor.network import FeedForward

BALL_RADIUS = 0.05  # m, of the balls that the vision DNNs know
WHITE, RED = "#FFFFFF", "#D02020"  # their colours (Nakada 2018, Sec. 6.2: white for the eyes, red for the limbs)
OUTPUTS = {"foveation": 2, "vision": 3}
THREADS = ThreadPoolExecutor(len(SIDES), thread_name_prefix="eye")


class Vision:
    """Foveation DNNs of both eyes, and limb vision DNNs of both eyes for some limbs.

    Parameters
    ----------
    foveation : pair of FeedForward
        Of the left and the right eye: from an optic nerve vector in bytes (n_in,) to theta and phi (2,), rad.
    limbs : dict of str to pair of FeedForward
        By limb: to the offset (3,), m, from its effector to the target.
    """

    def __init__(self, foveation: Sequence[FeedForward], limbs: dict[str, Sequence[FeedForward]] | None = None):
        self.foveation = tuple(foveation)
        self.limbs = {name: tuple(pair) for name, pair in (limbs or {}).items()}

    @classmethod
    def load(cls, run: Path, limbs: Sequence[str] = (), retina: str = "") -> Vision:
        """The networks of a run, those of the paper's retina or of another one; UserError where one is missing."""
        prefix = f"{retina}_" if retina else ""

        def pair(name: str, role: str) -> tuple[FeedForward, ...]:
            folder = Path(run) / "nets"
            return tuple(
                FeedForward.load(folder / f"{prefix}{name}{side}" / "weights.h5", outputs=OUTPUTS[role])
                for side in SIDES
            )

        return cls(pair("foveation_", "foveation"), {limb: pair(f"{limb}_vision_", "vision") for limb in limbs})

    def discrepancy(self, stored: np.ndarray) -> np.ndarray:
        """Directions theta, phi (2, 2), rad, of the target in each eye's frame, from bytes (2, n_in)."""
        return _answers(self.foveation, stored)

    def offsets(self, limb: str, stored: np.ndarray) -> np.ndarray:
        """Offsets (2, 3), m, from a limb's effector to the target in each eye's frame, from bytes (2, n_in)."""
        return _answers(self.limbs[limb], stored)


def _answers(networks: Sequence[FeedForward], stored: np.ndarray) -> np.ndarray:
    return np.array(list(THREADS.map(FeedForward.predict, networks, stored)), float)


def gaze_command(eye: Eye, angles: np.ndarray, discrepancy: np.ndarray) -> np.ndarray:
    """Angles theta, phi (2,), rad, in the head's frame at which an eye would look at its target.

    Parameters
    ----------
    eye : Eye
    angles : ndarray (2,)
        Where it looks now, rad.
    discrepancy : ndarray (2,)
        Theta and phi of the target in the eye's frame, rad. At phi = 0 they add to `angles`.
    """
    return senses.angles(eye.rotation(angles) @ senses.direction(*discrepancy))


def seen_from(eye: Eye, angles: np.ndarray, point: np.ndarray) -> np.ndarray:
    """Theta and phi (2,), rad, of a point (3,), m, of the head's frame in the frame of an eye that looks at `angles`.

    The inverse of `gaze_command` for a point: what the foveation DNNs learn.
    """
    return senses.angles((np.asarray(point, float) - eye.centre) @ eye.rotation(angles))
