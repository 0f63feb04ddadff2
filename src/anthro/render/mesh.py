"""Triangle meshes with colours: joined, moved, and made as tubes and balls."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np


@dataclass(frozen=True)
class Mesh:
    """Triangles with colours.

    Parameters
    ----------
    vertices : ndarray (n, 3)
        m.
    faces : ndarray (m, 3)
        Indices of vertices, counterclockwise from outside.
    normals : ndarray (n, 3)
        Unit, interpolated over each triangle.
    colours : ndarray (m, 3)
        Linear RGB of each triangle, 0 to 1.
    glow : ndarray (m,)
        Share of the colour that shows without light.
    gloss : float
        Strength of the highlight.
    mirror : float
        Share of the light that is mirrored as by a looking glass.
    """

    vertices: np.ndarray
    faces: np.ndarray
    normals: np.ndarray
    colours: np.ndarray
    glow: np.ndarray
    gloss: float = 0.1
    mirror: float = 0.0


def linear_rgb(colour: str) -> np.ndarray:
    """Linear RGB (3,) of an sRGB colour ``#rrggbb``."""
    values = np.array([int(colour[i : i + 2], 16) for i in (1, 3, 5)]) / 255
    return np.where(values <= 0.04045, values / 12.92, ((values + 0.055) / 1.055) ** 2.4)


def make_mesh(vertices: np.ndarray, faces: np.ndarray, colour: np.ndarray, gloss: float = 0.1) -> Mesh:
    """A mesh of one colour (3,), linear RGB, with normals weighted by the triangles' areas."""
    normals = vertex_normals(vertices, faces)
    colours = np.broadcast_to(np.asarray(colour, float), (len(faces), 3))
    return Mesh(vertices, faces, normals, colours, np.zeros(len(faces)), gloss)


def vertex_normals(vertices: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """Unit normals (n, 3) of the vertices (n, 3) of triangles (m, 3)."""
    corners = vertices[faces]
    area = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals = np.zeros_like(vertices)
    for corner in range(3):
        for axis in range(3):
            normals[:, axis] += np.bincount(faces[:, corner], area[:, axis], len(vertices))
    return normals / np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-30)


def join(meshes: Sequence[Mesh]) -> Mesh:
    """One triangle soup of several meshes; the first one's gloss and mirror hold for all."""
    starts = np.cumsum([0] + [len(mesh.vertices) for mesh in meshes[:-1]])
    return Mesh(
        np.concatenate([mesh.vertices for mesh in meshes]),
        np.concatenate([mesh.faces + start for mesh, start in zip(meshes, starts, strict=True)]),
        np.concatenate([mesh.normals for mesh in meshes]),
        np.concatenate([mesh.colours for mesh in meshes]),
        np.concatenate([mesh.glow for mesh in meshes]),
        meshes[0].gloss,
        meshes[0].mirror,
    )


def move(mesh: Mesh, rotation: np.ndarray, position: np.ndarray) -> Mesh:
    """The mesh turned by `rotation` (3, 3), then shifted by `position` (3,) in metres."""
    return replace(mesh, vertices=mesh.vertices @ rotation.T + position, normals=mesh.normals @ rotation.T)


def tube(path: np.ndarray, radius: np.ndarray, colour: np.ndarray, sides: int = 8) -> Mesh:
    """A round tube along one path (k, 3), m, of radii (k,), m, in a colour (3,); see `tubes`."""
    return tubes(path[None], radius[None], colour[None], sides)


def tubes(paths: np.ndarray, radii: np.ndarray, colours: np.ndarray, sides: int = 8) -> Mesh:
    """Round tubes along paths of equally many points.

    Parameters
    ----------
    paths : ndarray (n, k, 3)
        m; k is at least 2, no point is its follower's place.
    radii : ndarray (n, k)
        m, at each point.
    colours : ndarray (n, 3)
        Linear RGB.
    sides : int
        Of the cross-sections.

    Returns
    -------
    Mesh
        Open at the tubes' ends, which lie in bone. Each tube has 2 (k - 1) sides of the triangles, in order.
    """
    count, points = paths.shape[:2]
    along = np.gradient(paths, axis=1)
    along /= np.maximum(np.linalg.norm(along, axis=2, keepdims=True), 1e-12)
    # Each ring's frame is the last one's, turned as little as the path asks, so tubes do not twist.
    side = np.empty_like(paths)
    axis = np.eye(3)[np.argmin(np.abs(along[:, 0]), axis=1)]
    for i in range(points):
        direction = along[:, i]
        axis = axis - direction * (axis * direction).sum(axis=1, keepdims=True)
        axis /= np.maximum(np.linalg.norm(axis, axis=1, keepdims=True), 1e-12)
        side[:, i] = axis
    angle = 2 * np.pi * np.arange(sides) / sides
    other = np.cross(along, side)
    normals = np.cos(angle)[:, None] * side[:, :, None] + np.sin(angle)[:, None] * other[:, :, None]
    vertices = paths[:, :, None] + radii[:, :, None, None] * normals
    ring = (np.arange(count)[:, None, None] * points + np.arange(points - 1)[:, None]) * sides
    near, far = ring + np.arange(sides), ring + (np.arange(sides) + 1) % sides
    faces = np.stack([near, far, far + sides, near, far + sides, near + sides], axis=-1).reshape(-1, 3)
    each = np.repeat(np.asarray(colours, float), 2 * sides * (points - 1), axis=0)
    return Mesh(vertices.reshape(-1, 3), faces, normals.reshape(-1, 3), each, np.zeros(len(faces)), 0.35)


def sphere(centre: np.ndarray, radius: float, colour: str) -> Mesh:
    """A ball at `centre` (3,) in metres with its exact normals."""
    rings, sides = 24, 32
    polar = np.pi * np.arange(rings + 1) / rings
    round_ = 2 * np.pi * np.arange(sides) / sides
    normals = np.empty((rings + 1, sides, 3))
    normals[..., 0] = np.sin(polar)[:, None] * np.cos(round_)
    normals[..., 1] = np.sin(polar)[:, None] * np.sin(round_)
    normals[..., 2] = np.cos(polar)[:, None]
    ring = np.arange(rings)[:, None] * sides
    near, far = ring + np.arange(sides), ring + (np.arange(sides) + 1) % sides
    faces = np.stack([near, near + sides, far + sides, near, far + sides, far], axis=-1)
    normals = normals.reshape(-1, 3)
    mesh = make_mesh(centre + radius * normals, faces.reshape(-1, 3), linear_rgb(colour), 0.4)
    return replace(mesh, normals=normals, glow=np.full(len(mesh.faces), 0.15))


def resample(path: np.ndarray, spacing: float) -> np.ndarray:
    """Points (k, 3) about `spacing` metres apart along a path (n, 3), corners rounded a little."""
    length = np.linalg.norm(np.diff(path, axis=0), axis=1).sum()
    return evenly([path], max(int(length / spacing), 4) + 1)[0]


def evenly(paths: Sequence[np.ndarray], count: int) -> np.ndarray:
    """Points (n, count, 3), evenly spaced along each of n paths (k, 3), corners rounded a little.

    Parameters
    ----------
    paths : sequence of ndarray (k, 3)
        m; k may differ, each has a length.
    count : int
        At least 3.
    """
    points = np.concatenate(paths)
    ends = np.cumsum([len(path) for path in paths])
    steps = np.linalg.norm(np.diff(points, axis=0, prepend=points[:1]), axis=1)
    steps[ends[:-1]] = 1.0  # from one path to the next
    length = np.cumsum(steps)
    first, last = length[np.concatenate([[0], ends[:-1]])], length[ends - 1]
    at = np.linspace(first, last, count, axis=1)
    even = np.stack([np.interp(at, length, points[:, axis]) for axis in range(3)], axis=2)
    for _ in range(2):
        even[:, 1:-1] = (even[:, :-2] + 2 * even[:, 1:-1] + even[:, 2:]) / 4
    return even


def outermost(points: np.ndarray) -> np.ndarray:
    """Those (k, 3) of some points (n, 3) that lie outermost in any of 26 directions."""
    steps = np.stack(np.meshgrid(*[[-1, 0, 1]] * 3), axis=-1).reshape(-1, 3)
    return points[np.unique(np.argmax(points @ steps.T, axis=0))]
