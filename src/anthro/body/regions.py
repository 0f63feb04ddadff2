"""Bones that share a mesh file, told apart by seed points, and small bones lofted as tubes.

Every face of a shared mesh belongs to the region of the seed nearest to its centroid. Seeds stand
on the right half alone: a face on the left is looked up at its mirror image.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import trimesh
from scipy.interpolate import CubicSpline
from scipy.spatial import cKDTree

from anthro.errors import UserError

SIDES = 12
RINGS_PER_SPAN = 6
# Latitudes of the rings that round off a tube's end; its pole follows.
CAP = np.deg2rad([30.0, 60.0])


@dataclass(frozen=True)
class Region:
    """One seed of a region of a mesh, in the assembly frame, m.

    Side R: a right bone, which takes only faces at y < 0; its left twin is mirrored from it.
    Side M: the region takes the faces of both halves.
    """

    seed: str
    mesh: str
    region: str
    side: str
    x_m: float
    y_m: float
    z_m: float
    quality: str
    source: str


@dataclass(frozen=True)
class Tube:
    """One point of a tube's centre line with the tube's radius there; assembly frame, m."""

    point: str
    tube: str
    order: float
    x_m: float
    y_m: float
    z_m: float
    radius_m: float
    quality: str
    source: str


def owners(whole: trimesh.Trimesh, seeds: list[Region]) -> np.ndarray:
    """Which seed each face belongs to.

    Parameters
    ----------
    whole : Trimesh
        The shared mesh with n faces, in the assembly frame.
    seeds : list of Region
        The seeds of this mesh.

    Returns
    -------
    ndarray (n,) of int
        Index into ``seeds`` of the one nearest to the face's centroid, both folded to y < 0.
    """
    fold = np.array([1.0, -1.0, 1.0])
    points = np.array([(seed.x_m, abs(seed.y_m), seed.z_m) for seed in seeds]) * fold
    centres = whole.triangles_center.copy()
    centres[:, 1] = -np.abs(centres[:, 1])
    return cKDTree(points).query(centres)[1]


def faces_of(whole: trimesh.Trimesh, mesh: str, region: str, regions: list[Region]) -> trimesh.Trimesh:
    """The part of a shared mesh that is one bone.

    Parameters
    ----------
    whole : Trimesh
        The shared mesh in the assembly frame.
    mesh, region : str
        Its name and the region's, as in ``regions.csv``.
    regions : list of Region
        All rows of ``regions.csv``.

    Returns
    -------
    Trimesh
        An open surface with the faces' own winding.

    Raises
    ------
    UserError
        The mesh has no such region, or no face lies nearest to its seeds.
    """
    seeds = [row for row in regions if row.mesh == mesh]
    names = sorted({seed.region for seed in seeds})
    if region not in names:
        raise UserError(f"mesh {mesh!r} has no region {region!r}; it has: {', '.join(names) or 'none'}")
    mine = np.array([seed.region == region for seed in seeds])
    right = np.array([seed.side == "R" for seed in seeds])
    owner = owners(whole, seeds)
    keep = mine[owner] & ~(right[owner] & (whole.triangles_center[:, 1] >= 0.0))
    if not keep.any():
        raise UserError(f"mesh {mesh!r}: no face lies nearest to a seed of region {region!r}")
    used, faces = np.unique(whole.faces[keep], return_inverse=True)
    return trimesh.Trimesh(whole.vertices[used], faces.reshape(-1, 3), process=False)


def loft(tubes: list[Tube], name: str) -> trimesh.Trimesh:
    """A closed round tube with rounded ends along a smooth line through its points.

    Parameters
    ----------
    tubes : list of Tube
        All rows of ``tubes.csv``.
    name : str
        The tube to make.

    Returns
    -------
    Trimesh
        Watertight, normals outward; mirror-symmetric if its points are.

    Raises
    ------
    UserError
        Unknown tube, or one with fewer than two points or a radius that is not positive.
    """
    rows = sorted((row for row in tubes if row.tube == name), key=lambda row: row.order)
    if not rows:
        raise UserError(f"no tube {name!r} in tubes.csv")
    if len(rows) < 2 or min(row.radius_m for row in rows) <= 0.0:
        raise UserError(f"tube {name!r} needs two or more points with positive radii")
    points = np.array([(row.x_m, row.y_m, row.z_m) for row in rows])
    centres, tangents, radii = _rounded(*_smooth(points, np.array([row.radius_m for row in rows])))
    rings = _rings(centres[1:-1], tangents[1:-1], radii[1:-1], _normal(points))
    vertices = np.vstack([centres[:1], rings.reshape(-1, 3), centres[-1:]])
    return trimesh.Trimesh(vertices, _tube_faces(len(rings)), process=False)


def _normal(points: np.ndarray) -> np.ndarray:
    """Unit normal (3,) of the plane nearest to the points (k, 3)."""
    return np.linalg.svd(points - points.mean(axis=0))[2][2]


def _smooth(points: np.ndarray, radii: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Centres (n, 3), unit tangents (n, 3) and radii (n,) along a natural spline."""
    along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
    line = CubicSpline(along, points, bc_type="natural")
    knots = np.arange(len(points))
    at = np.interp(np.linspace(0, knots[-1], RINGS_PER_SPAN * knots[-1] + 1), knots, along)
    tangents = line(at, 1)
    tangents /= np.linalg.norm(tangents, axis=1, keepdims=True)
    return line(at), tangents, np.interp(at, along, radii)


def _rounded(centres: np.ndarray, tangents: np.ndarray, radii: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The same line with the rings of a half sphere and its pole added at both ends."""
    latitudes = np.append(CAP, np.pi / 2)[:, None]
    head = centres[0] - radii[0] * np.sin(latitudes[::-1]) * tangents[0]
    tail = centres[-1] + radii[-1] * np.sin(latitudes) * tangents[-1]
    turns = np.repeat(tangents[[0, -1]], len(latitudes), axis=0)
    return (
        np.vstack([head, centres, tail]),
        np.vstack([turns[: len(head)], tangents, turns[len(head) :]]),
        np.concatenate([radii[0] * np.cos(latitudes[::-1, 0]), radii, radii[-1] * np.cos(latitudes[:, 0])]),
    )


def _rings(centres: np.ndarray, tangents: np.ndarray, radii: np.ndarray, normal: np.ndarray) -> np.ndarray:
    """Rings (n, SIDES, 3) square to the line, all started from the same normal: no twist."""
    first = normal - (tangents @ normal)[:, None] * tangents
    first /= np.linalg.norm(first, axis=1, keepdims=True)
    second = np.cross(tangents, first)
    angle = 2 * np.pi * np.arange(SIDES) / SIDES
    round_ = np.cos(angle)[:, None] * first[:, None, :] + np.sin(angle)[:, None] * second[:, None, :]
    return centres[:, None, :] + radii[:, None, None] * round_


def _tube_faces(count: int) -> np.ndarray:
    """Faces (m, 3) of ``count`` rings between a first and a last pole."""
    k = np.arange(SIDES)
    after = (k + 1) % SIDES
    last = 1 + count * SIDES
    start = 1 + SIDES * np.arange(count - 1)[:, None]
    a, b, c, d = start + k, start + after, start + SIDES + k, start + SIDES + after
    walls = np.vstack([np.stack([a, b, d], axis=-1).reshape(-1, 3), np.stack([a, d, c], axis=-1).reshape(-1, 3)])
    head = np.column_stack([np.zeros_like(k), 1 + after, 1 + k])
    end = last - SIDES
    tail = np.column_stack([np.full_like(k, last), end + k, end + after])
    return np.vstack([head, walls, tail])
