"""What the eyes tell: optic nerve vectors, by rays from each photoreceptor through the pinhole into the scene.

Nakada 2018, Sec. 6.1: rays recursively meet visible surfaces, which are lit by Phong's local model and looked at by
shadow rays; red, green and blue of each of 3,600 receptors make an optic nerve vector (ONV) of 10,800 numbers. Film
frames are shaded by the same code, `anthro.render.raytrace.shade`.
"""

from __future__ import annotations

from collections.abc import Sequence

import mujoco
import numpy as np

from anthro.body import Body
from anthro.errors import UserError
from anthro.eyes.eye import SIDES, Eye, EyeState, MainSequenceMover, PaperMover, mover
from anthro.eyes.layout import Layout, layout
from anthro.eyes.scene import Scene
from anthro.render import kernels
from anthro.render.raytrace import shade

LUMINANCE = np.array([0.2126, 0.7152, 0.0722], np.float32)  # of linear RGB (Rec. ITU-R BT.709)
WHITE_FROM = 0.5  # luminance from which a binary receptor tells white


def rays(
    eye: Eye, receptors: Layout, angles: np.ndarray, rotation: np.ndarray, position: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Rays that an eye's receptors receive.

    Parameters
    ----------
    eye : Eye
    receptors : Layout
    angles : ndarray (2,)
        theta, phi, rad.
    rotation, position : ndarray (3, 3), (3,)
        From the head's frame to the world, m.

    Returns
    -------
    origins : ndarray (n, 3) float32
        The pinhole, m, in the world, for each ray.
    directions : ndarray (n, 3) float32
        Unit, out into the world.
    """
    turn, pinhole = rotation @ eye.rotation(angles), position + rotation @ eye.pupil(angles)
    return kernels.cast(receptors.directions, turn, pinhole)


def nerve(colours: np.ndarray, binary: bool = False) -> np.ndarray:
    """Optic nerve vector, 0 to 1, of what n receptors receive.

    Parameters
    ----------
    colours : ndarray (..., n, 3)
        Linear RGB.
    binary : bool
        As in `Layout`.

    Returns
    -------
    ndarray (..., 3 n) float32
        Red, green and blue of each receptor in turn; (..., n), 0 or 1, if they are binary.
    """
    if binary:
        return (np.clip(colours, 0, 1) @ LUMINANCE >= WHITE_FROM).astype(np.float32)
    return np.clip(colours, 0, 1).reshape(*colours.shape[:-2], -1).astype(np.float32, copy=False)


def as_bytes(vector: np.ndarray) -> np.ndarray:
    """An optic nerve vector, 0 to 1, as uint8: to be stored."""
    return np.rint(255 * vector).astype(np.uint8)


def as_floats(stored: np.ndarray) -> np.ndarray:
    """An optic nerve vector, 0 to 1, of stored bytes."""
    return stored.astype(np.float32) / np.float32(255)


class Eyes:
    """The two eyes of a body: they look, and they turn.

    Parameters
    ----------
    body : Body
        Its effector ``head`` carries the eyes.
    scene : Scene
        What they see.
    retina : str
        Of `anthro.eyes.layout.LAYOUTS`.
    movement : str
        Of `anthro.eyes.eye.MOVERS`.
    seed : int
        Of the run, by which receptors are placed.

    Attributes
    ----------
    eyes : tuple of Eye
        Left, right; all pairs below are in this order.
    layouts : tuple of Layout
    """

    def __init__(
        self, body: Body, scene: Scene, retina: str = "log_polar", movement: str = "paper", seed: int = 0
    ) -> None:
        self.scene, self.eyes = scene, tuple(Eye(side) for side in SIDES)
        self.layouts = tuple(layout(retina, side, seed) for side in SIDES)
        self._site = body.effector("head")
        self._mover: PaperMover | MainSequenceMover = mover(movement)
        self.reset()

    @property
    def angles(self) -> np.ndarray:
        """Theta, phi of each eye (2, 2), rad."""
        return np.array([state.angles for state in self._states])

    def reset(self, angles: np.ndarray | None = None) -> None:
        """Let the eyes rest at angles (2, 2), rad, within their limits; straight ahead if they are left out."""
        angles = np.zeros((2, 2)) if angles is None else np.asarray(angles, float)
        if angles.shape != (2, 2) or not np.isfinite(angles).all():
            raise UserError("two eyes rest at two finite angles each")
        self._states = [EyeState(eye.within(pair)) for eye, pair in zip(self.eyes, angles, strict=True)]

    def turn(self, command: np.ndarray, seconds: float) -> np.ndarray:
        """Turn for a control step of some seconds towards commanded angles (2, 2), rad; returns `angles`."""
        self._states = [
            self._mover.step(eye, state, aim, seconds)
            for eye, state, aim in zip(self.eyes, self._states, command, strict=True)
        ]
        return self.angles

    def aim(self, data: mujoco.MjData, point: np.ndarray) -> np.ndarray:
        """Angles (2, 2), rad, at which both eyes would look at a point (3,), m, of the world; limits not heeded."""
        rotation, position = self.head(data)
        local = (np.asarray(point, float) - position) @ rotation
        return np.array([eye.angles_to(local) for eye in self.eyes])

    def head(self, data: mujoco.MjData) -> tuple[np.ndarray, np.ndarray]:
        """From the head's frame to the world: rotation (3, 3), position (3,), m."""
        return data.site_xmat[self._site].reshape(3, 3), data.site_xpos[self._site]

    def rays(self, data: mujoco.MjData, layouts: Sequence[Layout] | None = None) -> tuple[np.ndarray, np.ndarray]:
        """Pinholes and directions (n, 3) of the rays of both eyes, left first: of all receptors, or of those told."""
        head = self.head(data)
        pairs = [rays(*eye, *head) for eye in zip(self.eyes, layouts or self.layouts, self.angles, strict=True)]
        origins, directions = (np.concatenate(both) for both in zip(*pairs, strict=True))
        return origins, directions

    def near(self, data: mujoco.MjData, point: np.ndarray, radius: float) -> tuple[Layout, Layout]:
        """Receptors of each eye whose rays pass a point (3,) of the world as `Layout.near` tells."""
        rotation, position = self.head(data)
        local = (point - position) @ rotation
        return tuple(
            receptors.near((local - eye.pupil(angles)) @ eye.rotation(angles), radius)
            for eye, receptors, angles in zip(self.eyes, self.layouts, self.angles, strict=True)
        )

    def see(self, data: mujoco.MjData) -> np.ndarray:
        """Optic nerve vectors of both eyes as the body lies in `data`, after `mj_kinematics`.

        Returns
        -------
        ndarray (2, 10800) float32
            From 0 to 1, as `nerve` orders them; of binary receptors (2, n).
        """
        self.scene.place(data)
        colours = shade(self.scene.parts, self.scene.studio, *self.rays(data))
        return nerve(colours.reshape(2, -1, 3), self.layouts[0].binary)
