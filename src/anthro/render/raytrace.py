"""Ray tracing with embree: primary rays, a key light with shadows, a floor and a backdrop."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from embreex.mesh_construction import TriangleMesh
from embreex.rtcore_scene import EmbreeScene

from anthro.render.camera import Camera
from anthro.render.mesh import Mesh, linear_rgb

FAR = 1e30
# A hit's distance is known to about 1e-6 of it: a shadow ray starts this far off its surface, m.
OFFSET = 2e-4
# Single precision halves the time of a frame, which memory bounds, and is embree's own.
REAL = np.float32
GOLDEN_ANGLE = np.pi * (3 - np.sqrt(5))


class Part:
    """A rigid mesh, built once and placed anew in each frame.

    Parameters
    ----------
    mesh : Mesh
        In its own frame.
    rotation : ndarray (3, 3), optional
    position : ndarray (3,), optional
        From that frame to the world, m.
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
        self._middle = (low + high) / 2
        reach = np.linalg.norm(mesh.vertices - self._middle, axis=1).max()
        self.radius = float(1.001 * reach)
        self._embree = EmbreeScene()
        # embreex keeps no reference to the arrays that it was given.
        self._arrays = (mesh.vertices, mesh.faces.astype(np.int32))
        TriangleMesh(self._embree, *self._arrays)
        self.exposure = np.ones(len(mesh.vertices), REAL)
        self.place(rotation, position)

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
            start = vertices[lit] + 5 * OFFSET * normals[lit]
            hit = self._run(start, along, query="OCCLUDED") == 0
            total[lit] += facing[lit]
            free[lit[~hit]] += facing[lit[~hit]]
        self.exposure = (0.15 + 0.85 * free / np.maximum(total, 1e-9)).astype(REAL)
        return self

    def place(self, rotation: np.ndarray | None, position: np.ndarray | None) -> Part:
        """Put the mesh's frame into the world; None leaves it unturned or unshifted."""
        self.rotation = np.asarray(np.eye(3) if rotation is None else rotation, REAL)
        self.position = np.asarray(np.zeros(3) if position is None else position, REAL)
        self.centre = self.rotation @ self._middle + self.position
        return self

    def query(self, origins: np.ndarray, directions: np.ndarray, **options) -> dict | np.ndarray:
        """Embree's answer for rays of the world carried into the part's frame.

        Parameters
        ----------
        origins, directions : ndarray (n, 3) or (3,)
            m; unit. At least one of the two has a row for each ray; the other may be common to all.
        """
        start = (origins - self.position) @ self.rotation
        return self._run(start, directions @ self.rotation, **options)

    def _run(self, origins: np.ndarray, directions: np.ndarray, **options) -> dict | np.ndarray:
        start, along = np.broadcast_arrays(origins.astype(REAL), directions.astype(REAL))
        return self._embree.run(np.ascontiguousarray(start), np.ascontiguousarray(along), **options)


def _dot(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Dot products of vectors (n, 3) or (3,) with vectors (n, 3) or (3,)."""
    if a.ndim == 1:
        return b @ a
    return a @ b if b.ndim == 1 else a[:, 0] * b[:, 0] + a[:, 1] * b[:, 1] + a[:, 2] * b[:, 2]


def _pick(vectors: np.ndarray, rows: np.ndarray) -> np.ndarray:
    """The rows of vectors (n, 3), or the one vector (3,) common to all rows."""
    return vectors if vectors.ndim == 1 else vectors.take(rows, axis=0)


def _meet(centre: np.ndarray, radius: float, origins: np.ndarray, directions: np.ndarray) -> np.ndarray:
    """Which rays (n,) bool meet a ball; arguments as in `Part.query`, m."""
    to_centre = centre - origins
    ahead, square = _dot(to_centre, directions), _dot(to_centre, to_centre)
    return (square - ahead * ahead < radius**2) & ((ahead > 0) | (square < radius**2))


def _candidates(parts: Sequence[Part], origins: np.ndarray, directions: np.ndarray) -> Iterator[tuple[int, np.ndarray]]:
    """Index of each part and the rays (k,) that meet the ball around it.

    Parts are halved again and again by where they lie: few rays are tried against each of them.
    """
    if not len(parts):
        return
    count = max(np.size(origins), np.size(directions)) // 3
    centres = np.array([part.centre for part in parts], REAL)
    radii = np.array([part.radius for part in parts], REAL)
    waiting = [(np.arange(len(parts)), np.arange(count))]
    while waiting:
        chosen, rays = waiting.pop()
        middle = (centres[chosen].min(axis=0) + centres[chosen].max(axis=0)) / 2
        reach = (np.linalg.norm(centres[chosen] - middle, axis=1) + radii[chosen]).max()
        rays = rays[_meet(middle, reach, _pick(origins, rays), _pick(directions, rays))]
        if not len(rays):
            continue
        if len(chosen) == 1:
            yield int(chosen[0]), rays
            continue
        axis = np.argmax(np.ptp(centres[chosen], axis=0))
        order = chosen[np.argsort(centres[chosen, axis], kind="stable")]
        waiting += [(order[len(order) // 2 :], rays), (order[: len(order) // 2], rays)]


@dataclass(frozen=True)
class Hits:
    """First hits of n rays.

    Parameters
    ----------
    distance : ndarray (n,)
        m; `FAR` where nothing was hit.
    part : ndarray (n,)
        Index of the part, -1 where none.
    normal, colour : ndarray (n, 3)
        Unit and turned to the ray's origin; linear RGB.
    exposure : ndarray (n,)
        Share of the sky that the part itself leaves free, 0 to 1.
    glow, gloss : ndarray (n,)
        As in `Mesh`.
    """

    distance: np.ndarray
    part: np.ndarray
    normal: np.ndarray
    colour: np.ndarray
    exposure: np.ndarray
    glow: np.ndarray
    gloss: np.ndarray


def intersect(parts: Sequence[Part], origins: np.ndarray, directions: np.ndarray) -> Hits:
    """Nearest hit of each ray with all parts.

    Parameters
    ----------
    parts : sequence of Part
    origins : ndarray (n, 3) or (3,)
        m.
    directions : ndarray (n, 3)
        Unit.

    Returns
    -------
    Hits
    """
    n = len(directions)
    zeros, vectors = np.zeros(n, REAL), np.zeros((n, 3), REAL)
    hits = Hits(
        np.full(n, FAR, REAL),
        np.full(n, -1),
        vectors,
        vectors.copy(),
        zeros,
        zeros.copy(),
        zeros.copy(),
    )
    for index, rays in _candidates(parts, origins, directions):
        part = parts[index]
        answer = part.query(_pick(origins, rays), directions[rays], output=True)
        nearer = (answer["primID"] >= 0) & (answer["tfar"] < hits.distance[rays])
        rays, face = rays[nearer], answer["primID"][nearer]
        u, v = answer["u"][nearer], answer["v"][nearer]
        mesh, corners = part.mesh, part.mesh.faces[face]
        weights = np.stack([1 - u - v, u, v], axis=1)
        normal = np.einsum("ij,ijk->ik", weights, mesh.normals[corners]) @ part.rotation.T
        normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-12)
        away = _dot(normal, directions[rays]) > 0
        hits.distance[rays] = answer["tfar"][nearer]
        hits.part[rays] = index
        hits.normal[rays] = np.where(away[:, None], -normal, normal)
        hits.colour[rays] = mesh.colours[face]
        hits.exposure[rays] = np.einsum("ij,ij->i", weights, part.exposure[corners])
        hits.glow[rays] = mesh.glow[face]
        hits.gloss[rays] = mesh.gloss
    return hits


def occluded(parts: Sequence[Part], origins: np.ndarray, directions: np.ndarray) -> np.ndarray:
    """Whether rays from `origins` (n, 3) along `directions` (n, 3) or (3,) meet any part: (n,)."""
    blocked = np.zeros(len(origins), bool)
    for index, rays in _candidates(parts, origins, directions):
        rays = rays[~blocked[rays]]
        if len(rays):
            along = _pick(directions, rays)
            blocked[rays] = parts[index].query(origins[rays], along, query="OCCLUDED") == 0
    return blocked


@dataclass(frozen=True)
class Studio:
    """Lights and surroundings.

    Parameters
    ----------
    key_direction : ndarray (3,)
        To the key light, any length.
    key_spread_deg : float
        Radius of the key light's disc: softens shadows.
    key_rays : int
        Shadow rays to the key light.
    floor : float or None
        Height of the floor, m; None for no floor.
    key, sky : float
        Strengths.
    backdrop_top, backdrop_horizon, floor_colour : ndarray (3,)
        Linear RGB.
    """

    key_direction: np.ndarray = field(default_factory=lambda: np.array([0.55, -0.65, 1.1]))
    key_spread_deg: float = 1.5
    key_rays: int = 1
    floor: float | None = None
    key: float = 0.72
    sky: float = 0.5
    backdrop_top: np.ndarray = field(default_factory=lambda: linear_rgb("#C9D3DE"))
    backdrop_horizon: np.ndarray = field(default_factory=lambda: linear_rgb("#F3F4F5"))
    floor_colour: np.ndarray = field(default_factory=lambda: linear_rgb("#D9DBDD"))

    @property
    def key_axis(self) -> np.ndarray:
        """Unit direction (3,) to the key light."""
        return (self.key_direction / np.linalg.norm(self.key_direction)).astype(REAL)


def disc_directions(axis: np.ndarray, spread_deg: float, count: int) -> np.ndarray:
    """Unit directions (count, 3) that fill a cone about a unit `axis` (3,); one is the axis."""
    side = np.cross(axis, np.eye(3)[np.argmin(np.abs(axis))])
    side /= np.linalg.norm(side)
    index = np.arange(count)
    radius = np.tan(np.deg2rad(spread_deg)) * np.sqrt(index / max(count - 1, 1))
    x, y = radius * np.cos(index * GOLDEN_ANGLE), radius * np.sin(index * GOLDEN_ANGLE)
    spread = axis + x[:, None] * side + y[:, None] * np.cross(axis, side)
    return (spread / np.linalg.norm(spread, axis=1, keepdims=True)).astype(REAL)


def shade(parts: Sequence[Part], studio: Studio, origin: np.ndarray, directions: np.ndarray) -> np.ndarray:
    """Linear RGB (n, 3) seen from `origin` (3,) along unit directions (n, 3)."""
    origin, directions = np.asarray(origin, REAL), np.asarray(directions, REAL)
    hits = intersect(parts, origin, directions)
    colours = _surroundings(parts, studio, origin, directions, hits.distance >= FAR)
    seen = np.flatnonzero(hits.part >= 0)
    if not len(seen):
        return colours
    normal, view = hits.normal[seen], directions[seen]
    points = origin + hits.distance[seen, None] * view + OFFSET * normal
    key = _key_light(parts, studio, points, normal)
    sky = hits.exposure[seen] * (0.7 + 0.3 * normal[:, 2])
    albedo = hits.colour[seen]
    light = studio.key * key + studio.sky * sky + hits.glow[seen]
    halfway = studio.key_axis - view
    halfway /= np.linalg.norm(halfway, axis=1, keepdims=True)
    shine = np.clip(_dot(normal, halfway), 0, 1) ** 40
    highlight = hits.gloss[seen] * shine * (key > 0)
    colours[seen] = albedo * light[:, None] + highlight[:, None]
    return colours


def _key_light(parts: Sequence[Part], studio: Studio, points: np.ndarray, normals: np.ndarray) -> np.ndarray:
    """Share of the key light (n,) that arrives at points and their normals (n, 3)."""
    total = np.zeros(len(points), REAL)
    for direction in disc_directions(studio.key_axis, studio.key_spread_deg, studio.key_rays):
        facing = normals @ direction
        lit = np.flatnonzero(facing > 0)
        free = ~occluded(parts, points[lit], direction)
        total[lit[free]] += facing[lit[free]]
    return total / studio.key_rays


def _surroundings(
    parts: Sequence[Part],
    studio: Studio,
    origin: np.ndarray,
    directions: np.ndarray,
    needed: np.ndarray,
) -> np.ndarray:
    """Backdrop and floor (n, 3) for the rays that are `needed` (n,)."""
    rise = np.clip(directions[:, 2:3] / 0.45, 0, 1)
    horizon, top = studio.backdrop_horizon.astype(REAL), studio.backdrop_top.astype(REAL)
    colours = horizon + (top - horizon) * rise
    if studio.floor is None or origin[2] <= studio.floor:
        return colours
    down = np.flatnonzero(needed & (directions[:, 2] < -1e-3))
    distance = (studio.floor - origin[2]) / directions[down, 2]
    points = origin + distance[:, None] * directions[down]
    up = np.broadcast_to(np.array([0.0, 0.0, 1.0], REAL), points.shape)
    shadow = _key_light(parts, studio, points, up) / studio.key_axis[2]
    lit = studio.floor_colour.astype(REAL) * (0.45 + 0.55 * np.clip(shadow, 0, 1))[:, None]
    # The floor fades into the backdrop, so that no horizon cuts the picture.
    fade = np.clip(distance / (6 * np.abs(origin[2] - studio.floor) + 6), 0, 1)[:, None]
    fade = fade * fade * (3 - 2 * fade)
    colours[down] = lit * (1 - fade) + colours[down] * fade
    return colours


def render(
    parts: Sequence[Part], camera: Camera, studio: Studio, samples: int = 3, threshold: float = 0.02
) -> np.ndarray:
    """A picture with its edges smoothed.

    Parameters
    ----------
    parts : sequence of Part
    camera : Camera
    studio : Studio
    samples : int
        Rays per pixel side where a pixel differs from its neighbours; one ray elsewhere.
    threshold : float
        That difference, of the displayed range.

    Returns
    -------
    ndarray (height, width, 3) uint8
        sRGB. The same scene gives the same bytes.
    """
    shape = (camera.height, camera.width)
    rows, columns = np.divmod(np.arange(shape[0] * shape[1]), shape[1])
    seen = shade(parts, studio, camera.position, camera.rays(columns + 0.5, rows + 0.5))
    picture = _display(seen)
    if samples > 1:
        edges = np.flatnonzero(_edges(picture.reshape(*shape, 3), threshold))
        offsets = (np.arange(samples) + 0.5) / samples
        column = (columns[edges, None, None] + offsets[None, None, :]).repeat(samples, axis=1)
        row = (rows[edges, None, None] + offsets[None, :, None]).repeat(samples, axis=2)
        fine = shade(parts, studio, camera.position, camera.rays(column.ravel(), row.ravel()))
        # Clipped first: else one highlight outshines its pixel's other rays and edges look torn.
        fine = np.clip(fine, 0, 1).reshape(len(edges), samples * samples, 3)
        picture[edges] = _display(fine.mean(axis=1))
    return np.rint(255 * picture).astype(np.uint8).reshape(*shape, 3)


def _edges(picture: np.ndarray, threshold: float) -> np.ndarray:
    edge = np.zeros(picture.shape[:2], bool)
    down = np.abs(np.diff(picture, axis=0)).max(axis=2) > threshold
    along = np.abs(np.diff(picture, axis=1)).max(axis=2) > threshold
    edge[1:] |= down
    edge[:-1] |= down
    edge[:, 1:] |= along
    edge[:, :-1] |= along
    return edge


def _display(linear: np.ndarray) -> np.ndarray:
    """The sRGB curve, 0 to 1, of linear RGB."""
    value = np.clip(linear, 0, 1)
    return np.where(value <= 0.0031308, 12.92 * value, 1.055 * value ** (1 / 2.4) - 0.055)
