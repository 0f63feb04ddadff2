"""The trunk's bones around the arm: drawn, never simulated."""

from __future__ import annotations

import mujoco
import numpy as np

from anthro.body.source import Source
from anthro.render.mesh import Mesh, join, linear_rgb, make_mesh, move
from anthro.render.scene import CONTEXT_COLOUR

TRUNK = ("torso", "neck", "head", "lumbar1", "lumbar2", "lumbar3", "lumbar4", "lumbar5", "sacrum")


def trunk(source_model: str = "myoarm_r") -> Mesh:
    """Skull, spine and rib cage of a myo-sim model, in Anthro's world.

    Parameters
    ----------
    source_model : str
        The model that the body was built from: what moves hangs on the same trunk.

    Returns
    -------
    Mesh
    """
    source = Source.load(source_model)
    meshes = []
    for name in TRUNK:
        body = source.body(name)
        position, quaternion = source.world_pose(body)
        for geom in source.mesh_geoms(body):
            vertices, faces = source.mesh(geom)
            mesh = make_mesh(vertices.astype(float), faces.astype(np.int64), linear_rgb(CONTEXT_COLOUR))
            offset, turn = source.model.geom_pos[geom], source.model.geom_quat[geom]
            mesh = move(mesh, _matrix(turn), offset)
            meshes.append(move(mesh, _matrix(quaternion), position))
    return join(meshes)


def _matrix(quaternion: np.ndarray) -> np.ndarray:
    matrix = np.empty(9)
    mujoco.mju_quat2Mat(matrix, quaternion)
    return matrix.reshape(3, 3)
