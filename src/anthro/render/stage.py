"""A body on stage: its bones placed, its muscles drawn, at any pose of a rollout."""

from __future__ import annotations

import mujoco
import numpy as np

from anthro.body import Body
from anthro.render.camera import Camera
from anthro.render.mesh import join, sphere
from anthro.render.raytrace import Part, Studio
from anthro.render.rollout import Rollout
from anthro.render.scene import TARGET_COLOUR, bones, muscle_paths, muscles

TARGET_RADIUS = 0.022
# From the body's front right, a little above: the fall of the arm and its depth both show.
AZIMUTH_DEG, ELEVATION_DEG = -64.0, 6.0


class Stage:
    """Everything that is drawn of one body.

    Parameters
    ----------
    body : Body
    """

    def __init__(self, body: Body) -> None:
        self.body = body
        self._data = mujoco.MjData(body.model)
        self._bones = {index: Part(mesh).bake() for index, mesh in bones(body.model).items()}

    def _move(self, qpos: np.ndarray) -> None:
        data = self._data
        data.qpos[:] = qpos
        mujoco.mj_kinematics(self.body.model, data)
        mujoco.mj_comPos(self.body.model, data)
        mujoco.mj_tendon(self.body.model, data)
        for body, part in self._bones.items():
            part.place(data.xmat[body].reshape(3, 3), data.xpos[body])

    def parts(self, qpos: np.ndarray, activation: np.ndarray, target: np.ndarray | None = None) -> list[Part]:
        """What is seen at one instant.

        Parameters
        ----------
        qpos : ndarray (m,)
            rad.
        activation : ndarray (n,)
            Of each muscle, 0 to 1.
        target : ndarray (3,), optional
            m; not drawn if it is not finite.

        Returns
        -------
        list of Part
            Valid until the next call.
        """
        self._move(qpos)
        paths = muscle_paths(self.body.model, self._data)[: self.body.muscle_count]
        drawn = [*self._bones.values()]
        drawn.append(Part(join(muscles(paths, self.body.muscle_groups, activation))))
        if target is not None and np.isfinite(target).all():
            drawn.append(Part(sphere(np.asarray(target, float), TARGET_RADIUS, TARGET_COLOUR)))
        return drawn

    def outline(self, rollout: Rollout, frames: int = 40) -> np.ndarray:
        """Points (k, 3), m, around all that a rollout shows, from `frames` instants of it."""
        points = []
        for index in np.linspace(0, len(rollout.time) - 1, frames).astype(int):
            self._move(rollout.qpos[index])
            points += [part.outline() for part in self._bones.values()]
        targets = np.unique(rollout.target[np.isfinite(rollout.target).all(axis=1)], axis=0)
        around = TARGET_RADIUS * np.concatenate([np.eye(3), -np.eye(3)])
        points += [target + around for target in targets]
        return np.concatenate(points)

    def shot(self, rollout: Rollout, width: int, height: int, key_rays: int = 1) -> tuple[Camera, Studio]:
        """Camera and light that keep the whole rollout in a picture of that size."""
        points = self.outline(rollout)
        camera = Camera.framing(points, AZIMUTH_DEG, ELEVATION_DEG, width, height)
        return camera, Studio(floor=float(points[:, 2].min()) - 0.05, key_rays=key_rays)
