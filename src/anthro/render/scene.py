"""What a film frame shows: bones, muscles and the target as meshes with colours.

A mesh that moves rigidly is built into one ray tracing scene and only placed anew in each frame,
so a frame pays for the muscles' tubes alone.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import mujoco
import numpy as np

from anthro.render.mesh import Mesh, evenly, join, linear_rgb, make_mesh, move, outermost, tubes

BONE_COLOUR = "#EADFC8"
CONTEXT_COLOUR = "#E6E3DE"
TARGET_COLOUR = "#F0C800"
SPECIFIC_TENSION = 60e4  # N/m^2, with which the tables' areas became forces
# A belly is drawn thinner than its area asks: a line's neighbours stay in sight.
RADIUS_SHARE = 0.5
BELLY_RADII = (0.0014, 0.0055)  # m, of the thinnest and the thickest bellies of a film
TENDON_SHARE = 0.45  # of a belly's radius
# A film draws a muscle with so many rings: the first number that keeps them within a spacing.
RINGS, RING_SPACING, SIDES = (7, 10, 14, 20, 28, 40), 0.012, 6


def root_bone(model: mujoco.MjModel) -> int:
    """The bone that carries all others: the first child of the world."""
    return int(np.flatnonzero(model.body_parentid[1:] == 0)[0]) + 1


def carrier(model: mujoco.MjModel, body: int) -> int:
    """The bone with which another moves as one; the root bone for all that never move against it.

    What hangs on the world beside the root bone is carried by the world, 0.
    """
    root = root_bone(model)
    while body != root and body != 0 and model.body_jntnum[body] == 0:
        body = int(model.body_parentid[body])
    return body


def bones(model: mujoco.MjModel) -> dict[int, Mesh]:
    """Meshes of the model's bones, one for all that move as one.

    Parameters
    ----------
    model : mujoco.MjModel
        Its mesh geoms are drawn; those that do not move against a fixed root are a shade paler.

    Returns
    -------
    dict of int to Mesh
        `carrier` of the bones, and their mesh in that body's frame.
    """
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    pieces: dict[int, list[Mesh]] = {}
    for geom in mesh_geoms(model):
        body = carrier(model, int(model.geom_bodyid[geom]))
        to_body = data.xmat[body].reshape(3, 3).T
        rotation = to_body @ data.geom_xmat[geom].reshape(3, 3)
        position = to_body @ (data.geom_xpos[geom] - data.xpos[body])
        mesh = geom_mesh(model, geom, BONE_COLOUR if model.body_weldid[body] else CONTEXT_COLOUR)
        pieces.setdefault(body, []).append(move(mesh, rotation, position))
    return {body: join(meshes) for body, meshes in pieces.items()}


def corners(model: mujoco.MjModel) -> dict[int, np.ndarray]:
    """Outermost points (k, 3), m, of each bone's surface, in the frame of its body."""
    found: dict[int, list[np.ndarray]] = {}
    for geom in mesh_geoms(model):
        rotation = np.empty(9)
        mujoco.mju_quat2Mat(rotation, model.geom_quat[geom])
        points = outermost(geom_mesh(model, geom, BONE_COLOUR).vertices)
        placed = points @ rotation.reshape(3, 3).T + model.geom_pos[geom]
        found.setdefault(int(model.geom_bodyid[geom]), []).append(placed)
    return {body: np.concatenate(points) for body, points in found.items()}


def mesh_geoms(model: mujoco.MjModel) -> np.ndarray:
    """Geoms (k,) that are bone surfaces."""
    return np.flatnonzero(model.geom_type == mujoco.mjtGeom.mjGEOM_MESH)


def geom_mesh(model: mujoco.MjModel, geom: int, colour: str) -> Mesh:
    """A mesh geom's surface in its own frame, m, in an sRGB colour ``#rrggbb``."""
    mesh = model.geom_dataid[geom]
    first, count = model.mesh_vertadr[mesh], model.mesh_vertnum[mesh]
    vertices = model.mesh_vert[first : first + count].astype(float)
    first, count = model.mesh_faceadr[mesh], model.mesh_facenum[mesh]
    faces = model.mesh_face[first : first + count].astype(np.int64)
    return make_mesh(vertices, faces, linear_rgb(colour))


def muscle_paths(model: mujoco.MjModel, data: mujoco.MjData) -> list[np.ndarray]:
    """Wrapped path of every tendon at the pose in `data`.

    Parameters
    ----------
    model : mujoco.MjModel
    data : mujoco.MjData
        After `mj_kinematics`, `mj_comPos` and `mj_tendon`.

    Returns
    -------
    list of ndarray (k, 3)
        Points in m from origin to insertion; arcs on wrapping surfaces are sampled.
    """
    points = data.wrap_xpos.reshape(-1, 3)
    objects = data.wrap_obj.reshape(-1)
    paths = []
    for tendon in range(model.ntendon):
        first, count = data.ten_wrapadr[tendon], data.ten_wrapnum[tendon]
        path = [points[first]] if count else []
        for i in range(first + 1, first + count):
            if objects[i] >= 0 and objects[i] == objects[i - 1]:
                path.extend(_arc(model, data, objects[i], points[i - 1], points[i]))
            path.append(points[i])
        paths.append(_without_repeats(np.array(path).reshape(-1, 3)))
    return paths


def _arc(model: mujoco.MjModel, data: mujoco.MjData, geom: int, start: np.ndarray, end: np.ndarray) -> np.ndarray:
    """Points strictly between two on a wrapping sphere or cylinder, along the shorter way."""
    rotation = data.geom_xmat[geom].reshape(3, 3)
    local = (np.stack([start, end]) - data.geom_xpos[geom]) @ rotation
    height = np.zeros(2)
    if model.geom_type[geom] == mujoco.mjtGeom.mjGEOM_CYLINDER:
        height, local = local[:, 2].copy(), local * [1, 1, 0]
    radii = np.linalg.norm(local, axis=1)
    if radii.min() < 1e-9:
        return np.empty((0, 3))
    units = local / radii[:, None]
    angle = np.arccos(np.clip(units[0] @ units[1], -1, 1))
    steps = int(angle / np.deg2rad(12))
    if steps < 1 or np.sin(angle) < 1e-6:
        return np.empty((0, 3))
    share = np.arange(1, steps + 1)[:, None] / (steps + 1)
    turned = np.sin((1 - share) * angle) * units[0] + np.sin(share * angle) * units[1]
    arc = turned / np.sin(angle) * ((1 - share) * radii[0] + share * radii[1])
    arc[:, 2] += (1 - share[:, 0]) * height[0] + share[:, 0] * height[1]
    return arc @ rotation.T + data.geom_xpos[geom]


def _without_repeats(path: np.ndarray) -> np.ndarray:
    keep = np.ones(len(path), bool)
    keep[1:] = np.linalg.norm(np.diff(path, axis=0), axis=1) > 1e-6
    return path[keep]


def belly_radii(max_force: np.ndarray) -> np.ndarray:
    """Radii (n,), m, of bellies from the muscles' greatest forces (n,), N, for a film."""
    return np.clip(RADIUS_SHARE * np.sqrt(max_force / SPECIFIC_TENSION / np.pi), *BELLY_RADII)


def muscles(paths: Sequence[np.ndarray], radii: np.ndarray, colours: np.ndarray, glow: np.ndarray) -> Mesh:
    """Muscles as thin tubes.

    Parameters
    ----------
    paths : sequence of ndarray (k, 3)
        Of each of n muscles, m.
    radii : ndarray (n,)
        Of each belly, m.
    colours : ndarray (n, 3)
        Linear RGB.
    glow : ndarray (n,)
        As in `Mesh`.

    Returns
    -------
    Mesh
        Of all muscles, those with as many rings together.
    """
    length = np.array([np.linalg.norm(np.diff(path, axis=0), axis=1).sum() for path in paths])
    size = np.minimum(np.searchsorted(RINGS, length / RING_SPACING), len(RINGS) - 1)
    meshes = []
    for index in np.unique(size):
        chosen = np.flatnonzero(size == index)
        rings = RINGS[index]
        belly = TENDON_SHARE + (1 - TENDON_SHARE) * np.sin(np.pi * np.linspace(0, 1, rings)) ** 2
        smooth = evenly([paths[i] for i in chosen], rings)
        mesh = tubes(smooth, radii[chosen, None] * belly, colours[chosen], SIDES)
        meshes.append(replace(mesh, glow=np.repeat(glow[chosen], 2 * SIDES * (rings - 1))))
    return join(meshes)
