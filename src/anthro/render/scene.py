"""What a film frame shows: bones, muscles and the target as meshes with colours.

A mesh that moves rigidly is built into one ray tracing scene and only placed anew in each frame,
so a frame pays for the muscles' tubes alone.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from zlib import crc32

import mujoco
import numpy as np

from anthro.render.mesh import Mesh, join, linear_rgb, make_mesh, move, resample, tube

# Of the palette for colour blind readers of Okabe and Ito (Wong 2011), sRGB.
GROUP_COLOURS = {
    "shoulder": "#D55E00",
    "elbow": "#0072B2",
    "forearm": "#CC79A7",
    "wrist": "#009E73",
}
# Other groups: the legs' like the joints of the arm above, the trunk's and neck's by their name.
LEG_COLOURS = {"hip": "#D55E00", "knee": "#0072B2", "ankle": "#009E73"}
TRUNK_COLOURS = ("#D55E00", "#CC79A7", "#E69F00", "#B5495B", "#8C5A2B")
BONE_COLOUR = "#EADFC8"
CONTEXT_COLOUR = "#E6E3DE"
TARGET_COLOUR = "#F0C800"


def bones(model: mujoco.MjModel) -> dict[int, Mesh]:
    """Meshes of the model's bones, one for all that move as one.

    Parameters
    ----------
    model : mujoco.MjModel
        Its mesh geoms are drawn; those that never move are a shade paler.

    Returns
    -------
    dict of int to Mesh
        Body to which the bones are welded, and their mesh in that body's frame.
    """
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    pieces: dict[int, list[Mesh]] = {}
    for geom in mesh_geoms(model):
        body = int(model.body_weldid[model.geom_bodyid[geom]])
        to_body = data.xmat[body].reshape(3, 3).T
        rotation = to_body @ data.geom_xmat[geom].reshape(3, 3)
        position = to_body @ (data.geom_xpos[geom] - data.xpos[body])
        mesh = geom_mesh(model, geom, BONE_COLOUR if body else CONTEXT_COLOUR)
        pieces.setdefault(body, []).append(move(mesh, rotation, position))
    return {body: join(meshes) for body, meshes in pieces.items()}


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


def group_colour(group: str) -> str:
    """Colour ``#rrggbb`` of any group of muscles, always the same one."""
    known = GROUP_COLOURS | LEG_COLOURS
    return known.get(group, TRUNK_COLOURS[crc32(group.encode()) % len(TRUNK_COLOURS)])


def muscle_colour(group: str, activation: float) -> tuple[np.ndarray, float]:
    """Colour (3,), linear RGB, and glow of a muscle: its group's hue, brighter with activation."""
    share = np.sqrt(np.clip(activation, 0.0, 1.0))
    hue = linear_rgb(group_colour(group))
    return hue * (0.25 + 0.75 * share), 0.5 * share


def muscles(
    paths: Sequence[np.ndarray],
    groups: Sequence[str],
    activation: np.ndarray,
    tendon_radius: float = 0.0020,
    belly_radius: float = 0.0050,
) -> list[Mesh]:
    """Muscles as thin tubes, coloured by group, brighter with activation.

    Parameters
    ----------
    paths : sequence of ndarray (k, 3)
        Of each of n muscles, m.
    groups : sequence of str
        Of each muscle.
    activation : ndarray (n,)
        0 to 1.
    tendon_radius, belly_radius : float
        At the ends and at the middle, m.

    Returns
    -------
    list of Mesh
        One for each muscle, in order.
    """
    tubes = []
    for path, group, level in zip(paths, groups, activation, strict=True):
        smooth = resample(path, 0.008)
        belly = np.sin(np.pi * np.linspace(0, 1, len(smooth))) ** 2
        colour, glow = muscle_colour(group, level)
        mesh = tube(smooth, tendon_radius + (belly_radius - tendon_radius) * belly, colour)
        tubes.append(replace(mesh, glow=np.full(len(mesh.faces), glow)))
    return tubes
