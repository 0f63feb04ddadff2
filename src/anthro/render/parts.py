"""What rays meet: rigid meshes, built once and placed anew in each frame, and balls."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from embreex.mesh_construction import TriangleMesh
from embreex.rtcore_scene import EmbreeScene

from anthro.render import culling, kernels
from anthro.render.mesh import Mesh, linear_rgb

FAR = 1e30
# A hit's distance is known to about 1e-6 of it: a shadow ray starts this far off its surface, m.
OFFSET = 2e-4
# Single precision halves the time of a frame, which memory bounds, and is embree's own.
REAL = np.float32
GOLDEN_ANGLE = np.pi * (3 - np.sqrt(5))
BAKED_EXPOSURE = (0.15, 0.85)  # what a fold keeps of the sky, and what an open place has more


class Rays:
    """Rays of the world, and room to carry some of them into a part's frame.

    Parameters
    ----------
    origins : ndarray (n, 3) or (3,)
        m.
    directions : ndarray (n, 3) or (3,)
        Unit. At least one of the two has a row for each ray.
    reach : ndarray (n,), optional
        How far each one looks, m; `FAR` if it is left out.

    Attributes
    ----------
    columns : ndarray (6, n)
        Origins and directions.
    """

    def __init__(self, origins: np.ndarray, directions: np.ndarray, reach: np.ndarray | None = None) -> None:
        count = len(directions) if np.ndim(directions) == 2 else len(origins)
        self.columns = np.empty((6, count), REAL)
        for rows, given in ((self.columns[:3], origins), (self.columns[3:], directions)):
            rows[:] = np.asarray(given).reshape(-1, 3).T
        self.reach = np.full(count, FAR, REAL) if reach is None else reach
        self.chosen = np.empty(count, np.int32)
        self.starts, self.ways = np.empty((count, 3), REAL), np.empty((count, 3), REAL)


class Hits:
    """First hits of n rays.

    Attributes
    ----------
    distance : ndarray (n,)
        m; `FAR` where nothing was hit.
    part : ndarray (n,)
        Index of the part, -1 where none.
    normal : ndarray (n, 3)
        Unit and turned to the ray's origin.
    surface : ndarray (n, 7)
        Columns: linear RGB; exposure, which is the share of the sky that the part itself leaves free; glow, gloss and
        mirror as in `Mesh`.
    """

    def __init__(self, count: int) -> None:
        self.distance = np.full(count, FAR, REAL)
        self.part = np.full(count, -1, np.int32)
        self.normal = np.zeros((count, 3), REAL)
        self.surface = np.zeros((count, 7), REAL)

    @property
    def columns(self) -> tuple[np.ndarray, ...]:
        """All attributes, in their order."""
        return self.distance, self.part, self.normal, self.surface

    @property
    def colour(self) -> np.ndarray:
        """Linear RGB (n, 3)."""
        return self.surface[:, :3]

    @property
    def mirror(self) -> np.ndarray:
        """Share (n,) of the light that is mirrored."""
        return self.surface[:, 6]


class Part:
    """A rigid mesh, built once and placed anew in each frame.

    Parameters
    ----------
    mesh : Mesh
        In its own frame.
    rotation : ndarray (3, 3), optional
    position : ndarray (3,), optional
        From that frame to the world, m.

    Attributes
    ----------
    rotation, position : ndarray (3, 3), (3,)
        Where it is.
    ball : ndarray (4,)
        A ball around it: centre in the world and radius, m.
    middle : ndarray (3,)
        That centre in its own frame.
    """

    def __init__(
        self,
        mesh: Mesh,
        rotation: np.ndarray | None = None,
        position: np.ndarray | None = None,
    ) -> None:
        self.mesh = mesh = replace(
            mesh,
            vertices=mesh.vertices.astype(REAL),
            normals=mesh.normals.astype(REAL),
            colours=mesh.colours.astype(REAL),
            glow=mesh.glow.astype(REAL),
        )
        low, high = mesh.vertices.min(axis=0), mesh.vertices.max(axis=0)
        self.middle = (low + high) / 2
        reach = np.linalg.norm(mesh.vertices - self.middle, axis=1).max()
        self.ball = np.array([0, 0, 0, 1.001 * reach], REAL)
        self.rotation, self.position = np.empty((3, 3), REAL), np.empty(3, REAL)
        # Wider than the mesh by what rounding may do to a ray that grazes it.
        self._box = (low - REAL(1e-4 + 1e-3 * reach), high + REAL(1e-4 + 1e-3 * reach))
        self._embree = EmbreeScene()
        # embreex keeps no reference to the arrays that it was given.
        self._arrays = (mesh.vertices, mesh.faces.astype(np.int32))
        TriangleMesh(self._embree, *self._arrays)
        self._corners = np.column_stack([mesh.normals, np.ones(len(mesh.vertices), REAL)])
        self._skins = np.column_stack([mesh.colours, mesh.glow])
        self._sheen = np.array([mesh.gloss, mesh.mirror], REAL)
        self.place(rotation, position)

    @property
    def exposure(self) -> np.ndarray:
        """Share (v,) of the sky that the part itself leaves free at each vertex, 0 to 1."""
        return self._corners[:, 3]

    def bake(self, rays: int = 32) -> Part:
        """Measure once, at each vertex, what share of the sky the part itself leaves free."""
        vertices, normals = self.mesh.vertices, self.mesh.normals
        index = np.arange(rays)
        height = 1 - 2 * (index + 0.5) / rays
        flat, turn = np.sqrt(1 - height**2), index * GOLDEN_ANGLE
        free, total = np.zeros(len(vertices)), np.zeros(len(vertices))
        for along in np.stack([flat * np.cos(turn), flat * np.sin(turn), height], axis=1):
            facing = normals @ along
            lit = np.flatnonzero(facing > 0.1)
            start = (vertices[lit] + 5 * OFFSET * normals[lit]).astype(REAL)
            ways = np.ascontiguousarray(np.broadcast_to(along.astype(REAL), start.shape))
            hit = self._embree.run(start, ways, query="OCCLUDED") == 0
            total[lit] += facing[lit]
            free[lit[~hit]] += facing[lit[~hit]]
        self._corners[:, 3] = BAKED_EXPOSURE[0] + BAKED_EXPOSURE[1] * free / np.maximum(total, 1e-9)
        return self

    def place(self, rotation: np.ndarray | None, position: np.ndarray | None) -> Part:
        """Put the mesh's frame into the world; None leaves it unturned or unshifted."""
        self.rotation[:] = np.eye(3) if rotation is None else rotation
        self.position[:] = 0 if position is None else position
        self.ball[:3] = np.dot(self.rotation, self.middle) + self.position
        return self

    def meet(self, index: int, rays: Rays, hits: Hits) -> None:
        """Write into `hits` where it is hit nearer than all before, as part `index`."""
        count = self._gather(rays, hits.distance)
        if not count:
            return
        found = self._embree.run(rays.starts[:count], rays.ways[:count], output=True)
        kernels.keep_nearest(
            index,
            rays.chosen,
            found["tfar"],
            found["primID"],
            found["u"],
            found["v"],
            self._arrays[1],
            self._corners,
            self._skins,
            self._sheen,
            self.rotation,
            rays.columns,
            *hits.columns,
        )

    def block(self, rays: Rays) -> None:
        """Set the reach of rays that meet it to 0."""
        count = self._gather(rays, rays.reach)
        if count:
            answer = self._embree.run(rays.starts[:count], rays.ways[:count], query="OCCLUDED")
            kernels.mark(rays.chosen, answer, rays.reach)

    def _gather(self, rays: Rays, reach: np.ndarray) -> int:
        """How many rays may meet it nearer than `reach` (n,); they are left in `rays`, in the part's frame."""
        return culling.gather(
            rays.columns,
            reach,
            self.ball,
            self.rotation,
            self.position,
            *self._box,
            rays.chosen,
            rays.starts,
            rays.ways,
        )


class Troop:
    """Parts that are placed at one stroke.

    Parameters
    ----------
    parts : sequence of Part
        They hold views of this troop's arrays from now on, and may still be placed one by one.
    """

    def __init__(self, parts: Sequence[Part]) -> None:
        self._rotations, self._positions = np.empty((len(parts), 3, 3), REAL), np.empty((len(parts), 3), REAL)
        self._balls, self._middles = np.empty((len(parts), 4), REAL), np.empty((len(parts), 3), REAL)
        for k, part in enumerate(parts):
            self._rotations[k], self._positions[k] = part.rotation, part.position
            self._balls[k], self._middles[k] = part.ball, part.middle
            part.rotation, part.position, part.ball = self._rotations[k], self._positions[k], self._balls[k]

    def place(self, rotations: np.ndarray, positions: np.ndarray) -> None:
        """Put the parts' frames into the world: rotations (p, 3, 3) and positions (p, 3), m."""
        self._rotations[:], self._positions[:] = rotations, positions
        self._balls[:, :3] = np.einsum("pij,pj->pi", self._rotations, self._middles) + self._positions


class Ball:
    """An exact ball that needs no mesh.

    Parameters
    ----------
    radius : float
        m.
    colour : str
        sRGB ``#rrggbb``.
    position : sequence of float
        m, in the world.
    gloss, glow, mirror : float
        As in `Mesh`; the first two are those of `anthro.render.mesh.sphere`.

    Attributes
    ----------
    centre : ndarray (3,)
        m, in the world.
    colour : str
    ball : ndarray (4,)
        As in `Part`: a little wider than it is.
    """

    def __init__(
        self,
        radius: float,
        colour: str,
        position: Sequence[float] = (0.0, 0.0, 0.0),
        gloss: float = 0.4,
        glow: float = 0.15,
        mirror: float = 0.0,
    ) -> None:
        self.radius = float(radius)
        self.ball = np.array([0, 0, 0, 1.001 * radius], REAL)
        self._skin = np.array([0, 0, 0, 1.0, glow, gloss, mirror], REAL)
        self.paint(colour).place(position)

    def paint(self, colour: str) -> Ball:
        """Give it another colour, sRGB ``#rrggbb``."""
        self.colour = colour
        self._skin[:3] = linear_rgb(colour)
        return self

    def place(self, position: Sequence[float]) -> Ball:
        """Put its centre (3,), m, into the world."""
        self.centre = np.array(position, float)
        self.ball[:3] = self.centre
        return self

    def meet(self, index: int, rays: Rays, hits: Hits) -> None:
        """As in `Part`."""
        kernels.meet_ball(index, self.centre, self.radius, self._skin, rays.columns, *hits.columns)

    def block(self, rays: Rays) -> None:
        """As in `Part`."""
        kernels.block_ball(self.centre, self.radius, rays.columns, rays.reach)
