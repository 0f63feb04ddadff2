"""What a limb looks like from outside: a smooth rigid surface around each of its bones, in place of skin.

Each bone's convex hull is grown until it holds the bone's share of the body's mass. It grows more where the segment's
belly lies than at its ends (estimated), so that joints stay slender. What moves as one is one mesh.
"""

from __future__ import annotations

from functools import cache

import mujoco
import numpy as np
from scipy.optimize import brentq
from scipy.spatial import ConvexHull

from anthro.render.mesh import Mesh, join, make_mesh, move
from anthro.render.scene import carrier, geom_mesh, mesh_geoms

DENSITY = 1050.0  # kg/m^3, of limbs as a whole (Winter 2009, Table 4.1: 1.05 to 1.16)
SKIN = 0.002  # m: no bone lies closer to its surface
BELLY, ENDS = 0.35, 0.25  # where along the segment the belly lies; growth at the ends beside that of the belly
OUTERMOST = 400  # points by which a bone's hull is told
THICKEST = 0.2  # m: no bone needs so much around it
PRECISION = 2e-4  # m
GRAIN = 3  # triangles a side of each face of the octahedron by which hulls are grown


def limb_bones(model: mujoco.MjModel, roots: tuple[str, ...]) -> set[int]:
    """Bodies that are one of `roots` or hang on one; roots that the model lacks are left out."""
    found = {mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_BODY, root) for root in roots} - {-1}
    for body in range(1, model.nbody):
        if model.body_parentid[body] in found:
            found.add(body)
    return found


def flesh(model: mujoco.MjModel, roots: tuple[str, ...], colours: dict[str, np.ndarray]) -> dict[int, Mesh]:
    """Surfaces of limbs.

    Parameters
    ----------
    model : mujoco.MjModel
    roots : tuple of str
        First bone of each limb.
    colours : dict of str to ndarray (3,)
        Linear RGB of each limb, by its root.

    Returns
    -------
    dict of int to Mesh
        `anthro.render.scene.carrier` of the bones, and their mesh in that body's frame.
    """
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    pieces: dict[int, list[Mesh]] = {}
    geoms = mesh_geoms(model)
    for root in roots:
        bones = limb_bones(model, (root,))
        for geom in geoms[np.isin(model.geom_bodyid[geoms], list(bones))]:
            body = int(model.geom_bodyid[geom])
            frame = carrier(model, body)
            rotation, position = data.geom_xmat[geom].reshape(3, 3), data.geom_xpos[geom]
            begin, end = data.xpos[body], _far_end(model, data, body, bones)
            points = geom_mesh(model, geom, "#FFFFFF").vertices @ rotation.T + position
            around = grown(points, model.body_mass[body] / DENSITY, begin, end, colours[root])
            to_frame = data.xmat[frame].reshape(3, 3).T
            pieces.setdefault(frame, []).append(move(around, to_frame, -to_frame @ data.xpos[frame]))
    return {body: join(meshes) for body, meshes in pieces.items()}


def grown(points: np.ndarray, volume: float, begin: np.ndarray, end: np.ndarray, colour: np.ndarray) -> Mesh:
    """The convex hull of a bone's points, grown until it holds a volume.

    Parameters
    ----------
    points : ndarray (n, 3)
        m.
    volume : float
        m^3; a bone that fills it has a skin of `SKIN`.
    begin, end : ndarray (3,)
        Ends of the segment, m: how much a point grows goes with where between them it lies.
    colour : ndarray (3,)
        Linear RGB.

    Returns
    -------
    Mesh
    """
    points = _few(points)
    way = end - begin
    along = np.clip((points - begin) @ way / max(way @ way, 1e-12), 0, 1)
    share = ENDS + (1 - ENDS) * np.sin(np.pi * along ** (np.log(0.5) / np.log(BELLY)))
    directions = ball_directions(GRAIN)

    @cache
    def hull(most: float) -> ConvexHull:
        depth = np.maximum(most * share, SKIN)
        return ConvexHull((points[:, None] + depth[:, None, None] * directions).reshape(-1, 3))

    def lacking(most: float) -> float:
        """By how much too short an edge is of a cube that holds as much: about linear, unlike the volume."""
        return np.cbrt(volume) - np.cbrt(hull(most).volume)

    most = 0.0 if lacking(0.0) <= 0 else brentq(lacking, 0.0, THICKEST, xtol=PRECISION)
    return _hull_mesh(hull(most), colour)


def ball_directions(grain: int) -> np.ndarray:
    """Unit directions (k, 3) of an octahedron's faces, each side cut into `grain` pieces."""
    steps = np.arange(-grain, grain + 1)
    grid = np.stack(np.meshgrid(steps, steps, steps, indexing="ij"), axis=-1).reshape(-1, 3)
    on = grid[np.abs(grid).sum(axis=1) == grain]
    return on / np.linalg.norm(on, axis=1, keepdims=True)


def _far_end(model: mujoco.MjModel, data: mujoco.MjData, body: int, bones: set[int]) -> np.ndarray:
    """Where a bone's segment ends, m, in the world: at the mean of the joints beyond, else twice to its mass centre."""
    beyond = [child for child in bones if model.body_parentid[child] == body]
    reach = [data.xpos[child] for child in beyond if np.linalg.norm(data.xpos[child] - data.xpos[body]) > 0.05]
    if reach:
        return np.mean(reach, axis=0)
    middle = data.xpos[body] + data.xmat[body].reshape(3, 3) @ model.body_ipos[body]
    return 2 * middle - data.xpos[body]


def _few(points: np.ndarray) -> np.ndarray:
    """The points of a hull, at most `OUTERMOST`, those that lie outermost in directions all around."""
    points = points[ConvexHull(points).vertices]
    if len(points) <= OUTERMOST:
        return points
    return points[np.unique(np.argmax(points @ ball_directions(9).T, axis=0))]


def _hull_mesh(hull: ConvexHull, colour: np.ndarray) -> Mesh:
    """A hull as a mesh whose faces turn outwards."""
    index = np.full(len(hull.points), -1)
    index[hull.vertices] = np.arange(len(hull.vertices))
    vertices, faces = hull.points[hull.vertices], index[hull.simplices]
    corners = vertices[faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    inward = (normals * hull.equations[:, :3]).sum(axis=1) < 0
    faces[inward] = faces[inward][:, ::-1]
    return make_mesh(vertices, faces, colour)
