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
    """

    vertices: np.ndarray
    faces: np.ndarray
    normals: np.ndarray
    colours: np.ndarray
    glow: np.ndarray
    gloss: float = 0.1


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
    """One triangle soup of several meshes; the first one's gloss holds for all."""
    starts = np.cumsum([0] + [len(mesh.vertices) for mesh in meshes[:-1]])
    return Mesh(
        np.concatenate([mesh.vertices for mesh in meshes]),
        np.concatenate([mesh.faces + start for mesh, start in zip(meshes, starts, strict=True)]),
        np.concatenate([mesh.normals for mesh in meshes]),
        np.concatenate([mesh.colours for mesh in meshes]),
        np.concatenate([mesh.glow for mesh in meshes]),
        meshes[0].gloss,
    )


def move(mesh: Mesh, rotation: np.ndarray, position: np.ndarray) -> Mesh:
    """The mesh turned by `rotation` (3, 3), then shifted by `position` (3,) in metres."""
    return replace(mesh, vertices=mesh.vertices @ rotation.T + position, normals=mesh.normals @ rotation.T)


def tube(path: np.ndarray, radius: np.ndarray, colour: np.ndarray, sides: int = 8) -> Mesh:
    """A round tube along a path.

    Parameters
    ----------
    path : ndarray (k, 3)
        m, at least two points, none repeated.
    radius : ndarray (k,)
        m, at each point.
    colour : ndarray (3,)
        Linear RGB.
    sides : int
        Of its cross-section.

    Returns
    -------
    Mesh
        Open at its ends, which lie in bone.
    """
    along = np.gradient(path, axis=0)
    along /= np.maximum(np.linalg.norm(along, axis=1, keepdims=True), 1e-12)
    # Each ring's frame is the last one's, turned as little as the path asks, so tubes do not twist.
    side = np.empty_like(path)
    axis = np.eye(3)[np.argmin(np.abs(along[0]))]
    for i, direction in enumerate(along):
        axis = axis - direction * (axis @ direction)
        axis = axis / np.linalg.norm(axis)
        side[i] = axis
    angle = 2 * np.pi * np.arange(sides) / sides
    other = np.cross(along, side)
    normals = np.cos(angle)[:, None] * side[:, None] + np.sin(angle)[:, None] * other[:, None]
    vertices = path[:, None] + radius[:, None, None] * normals
    ring = np.arange(len(path) - 1)[:, None] * sides
    near, far = ring + np.arange(sides), ring + (np.arange(sides) + 1) % sides
    faces = np.stack([near, far, far + sides, near, far + sides, near + sides], axis=-1)
    faces = faces.reshape(-1, 3)
    colours = np.broadcast_to(np.asarray(colour, float), (len(faces), 3))
    glow = np.zeros(len(faces))
    return Mesh(vertices.reshape(-1, 3), faces, normals.reshape(-1, 3), colours, glow, 0.35)


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
    length = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(path, axis=0), axis=1))])
    count = max(int(length[-1] / spacing), 4) + 1
    at = np.linspace(0, length[-1], count)
    points = np.stack([np.interp(at, length, path[:, axis]) for axis in range(3)], axis=1)
    for _ in range(2):
        points[1:-1] = (points[:-2] + 2 * points[1:-1] + points[2:]) / 4
    return points
