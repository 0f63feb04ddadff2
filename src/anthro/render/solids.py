"""Solids for props: boxes with round edges, turned pieces."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from anthro.render.mesh import Mesh, linear_rgb


def box(centre: Sequence[float], size: Sequence[float], radius: float, colour: str, turn: float = 0.0) -> Mesh:
    """A box with round edges.

    Parameters
    ----------
    centre, size : sequence of float
        m, along x, y and z.
    radius : float
        Of its edges, m; at most half the least size.
    colour : str
        sRGB ``#rrggbb``.
    turn : float
        About z through its centre, rad.

    Returns
    -------
    Mesh
    """
    rings, sides = 18, 32
    polar = np.pi * np.arange(rings) / (rings - 1)
    # Half a step aside: no vertex lies between two corners, so the flat sides are the long triangles.
    round_ = 2 * np.pi * (np.arange(sides) + 0.5) / sides
    flat, height = np.sin(polar), np.cos(polar)
    flat[[0, -1]] = 0.0
    normals = np.empty((rings, sides, 3))
    normals[..., 0] = flat[:, None] * np.cos(round_)
    normals[..., 1] = flat[:, None] * np.sin(round_)
    normals[..., 2] = height[:, None]
    normals = normals.reshape(-1, 3)
    vertices = np.sign(np.round(normals, 9)) * (np.asarray(size) / 2 - radius) + radius * normals
    c, s = np.cos(turn), np.sin(turn)
    rotation = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1.0]])
    return _mesh(vertices @ rotation.T + np.asarray(centre), _grid(rings, sides), normals @ rotation.T, colour)


def turned(profile: Sequence[tuple[float, float]], colour: str, centre: Sequence[float] = (0.0, 0.0)) -> Mesh:
    """A solid of revolution about the vertical through `centre` (x, y), m.

    Parameters
    ----------
    profile : sequence of (radius, height)
        m, upwards along its outside; every corner is an edge.
    colour : str
        sRGB ``#rrggbb``.
    centre : sequence of float

    Returns
    -------
    Mesh
    """
    sides = 40
    round_ = 2 * np.pi * np.arange(sides) / sides
    around = np.stack([np.cos(round_), np.sin(round_), np.zeros(sides)], axis=1)
    vertices, normals = [], []
    for (r0, z0), (r1, z1) in zip(profile[:-1], profile[1:], strict=True):
        out, up = np.array([z1 - z0, r0 - r1]) / np.hypot(r1 - r0, z1 - z0)
        for radius, height in ((r1, z1), (r0, z0)):
            vertices.append(radius * around + [centre[0], centre[1], height])
            normals.append(out * around + [0, 0, up])
    pieces = len(profile) - 1
    faces = np.concatenate([_grid(2, sides) + 2 * sides * i for i in range(pieces)])
    return _mesh(np.concatenate(vertices), faces, np.concatenate(normals), colour)


def _grid(rings: int, sides: int) -> np.ndarray:
    """Triangles (m, 3) of rings of vertices, one below the other, that close round."""
    ring = np.arange(rings - 1)[:, None] * sides
    near, far = ring + np.arange(sides), ring + (np.arange(sides) + 1) % sides
    return np.stack([near, near + sides, far + sides, near, far + sides, far], axis=-1).reshape(-1, 3)


def _mesh(vertices: np.ndarray, faces: np.ndarray, normals: np.ndarray, colour: str) -> Mesh:
    colours = np.broadcast_to(linear_rgb(colour), (len(faces), 3))
    return Mesh(vertices, faces, normals, colours, np.zeros(len(faces)), 0.12)
