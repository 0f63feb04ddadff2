"""Ray tracing with embree: primary rays, a key light with shadows, a floor and a backdrop."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from anthro.render import culling, kernels
from anthro.render.camera import Camera
from anthro.render.mesh import linear_rgb
from anthro.render.parts import FAR, GOLDEN_ANGLE, OFFSET, REAL, Ball, Hits, Part, Rays

BOUNCES = 2  # mirrors seen in mirrors; what lies behind them is not traced


def intersect(
    parts: Sequence[Part | Ball], origins: np.ndarray, directions: np.ndarray, reach: np.ndarray | None = None
) -> Hits:
    """Nearest hit of each ray with all parts.

    Parameters
    ----------
    parts : sequence of Part or Ball
    origins : ndarray (n, 3) or (3,)
        m.
    directions : ndarray (n, 3)
        Unit.
    reach : ndarray (n,), optional
        Parts that lie further away, m, need not be tried.

    Returns
    -------
    Hits
    """
    rays, hits = Rays(origins, directions, reach), Hits(len(directions))
    for index in within_reach(parts, rays):
        parts[index].meet(index, rays, hits)
    return hits


def within_reach(parts: Sequence[Part | Ball], rays: Rays) -> list[int]:
    """Indices of the parts that any ray may meet, the nearer ones first: what they hide need not be traced."""
    if not len(parts) or not len(rays.reach):
        return []
    balls = np.concatenate([part.ball for part in parts]).reshape(-1, 4)
    away = balls[:, :3] - rays.columns[:3, 0]
    order = np.argsort((away * away).sum(axis=1), kind="stable")
    return order[culling.reachable(rays.columns, rays.reach, balls)[order]].tolist()


def occluded(
    parts: Sequence[Part | Ball], origins: np.ndarray, directions: np.ndarray, reach: np.ndarray | None = None
) -> np.ndarray:
    """Whether rays from `origins` (n, 3) along `directions` (n, 3) or (3,) meet any part, or look 0 m far: (n,)."""
    rays = Rays(origins, directions, reach)
    for index in within_reach(parts, rays):
        parts[index].block(rays)
    return rays.reach == 0


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
    if count == 1:
        return axis[None].astype(REAL)
    side = np.cross(axis, np.eye(3)[np.argmin(np.abs(axis))])
    side /= np.linalg.norm(side)
    index = np.arange(count)
    radius = np.tan(np.deg2rad(spread_deg)) * np.sqrt(index / max(count - 1, 1))
    x, y = radius * np.cos(index * GOLDEN_ANGLE), radius * np.sin(index * GOLDEN_ANGLE)
    spread = axis + x[:, None] * side + y[:, None] * np.cross(axis, side)
    return (spread / np.linalg.norm(spread, axis=1, keepdims=True)).astype(REAL)


def shade(
    parts: Sequence[Part | Ball],
    studio: Studio,
    origins: np.ndarray,
    directions: np.ndarray,
    bounces: int = BOUNCES,
) -> np.ndarray:
    """Linear RGB (n, 3) seen along rays.

    Parameters
    ----------
    parts : sequence of Part or Ball
    studio : Studio
    origins : ndarray (n, 3) or (3,)
        m.
    directions : ndarray (n, 3)
        Unit.
    bounces : int
        How often a ray is followed on from a mirror.

    Returns
    -------
    ndarray (n, 3)
        From 0; a highlight may exceed 1.
    """
    directions = np.ascontiguousarray(directions, REAL)
    origins = np.ascontiguousarray(np.broadcast_to(np.asarray(origins, REAL), directions.shape))
    hits = intersect(parts, origins, directions)
    colours = _surroundings(parts, studio, origins, directions, hits.part < 0)
    seen = np.flatnonzero(hits.part >= 0)
    if not len(seen):
        return colours
    points = kernels.leave(seen, origins, directions, hits.distance, hits.normal, REAL(OFFSET))
    key = _key_light(parts, studio, points, hits.normal[seen])
    strengths = REAL(studio.key), REAL(studio.sky)
    kernels.phong(seen, directions, hits.normal, hits.surface, key, *strengths, studio.key_axis, colours)
    mirrors = np.flatnonzero(hits.mirror[seen] > 0) if bounces else []
    if len(mirrors):
        rows = seen[mirrors]
        normal, view, share = hits.normal[rows], directions[rows], hits.mirror[rows, None]
        onward = view - 2 * (view * normal).sum(axis=1, keepdims=True) * normal
        reflected = shade(parts, studio, points[mirrors], onward, bounces - 1)
        colours[rows] = (1 - share) * colours[rows] + share * reflected
    return colours


def _key_light(parts: Sequence[Part | Ball], studio: Studio, points: np.ndarray, normals: np.ndarray) -> np.ndarray:
    """Share of the key light (n,) that arrives at points (n, 3) and their normals (n, 3) or (3,)."""
    total = np.zeros(len(points), REAL)
    for direction in disc_directions(studio.key_axis, studio.key_spread_deg, studio.key_rays):
        facing = np.broadcast_to(normals @ direction, total.shape)
        reach = np.where(facing > 0, REAL(FAR), REAL(0))
        total += np.where(occluded(parts, points, direction, reach), REAL(0), facing)
    return total / studio.key_rays


def _surroundings(
    parts: Sequence[Part | Ball],
    studio: Studio,
    origins: np.ndarray,
    directions: np.ndarray,
    needed: np.ndarray,
) -> np.ndarray:
    """Backdrop and floor (n, 3) for the rays that are `needed` (n,)."""
    colours = kernels.backdrop(directions, studio.backdrop_horizon.astype(REAL), studio.backdrop_top.astype(REAL))
    if studio.floor is None:
        return colours
    down, points = kernels.meet_floor(origins, directions, needed, REAL(studio.floor))
    shadow = _key_light(parts, studio, points, np.array([0.0, 0.0, 1.0], REAL)) / studio.key_axis[2]
    kernels.paint_floor(down, points, origins, shadow, studio.floor_colour.astype(REAL), colours)
    return colours


def render(
    parts: Sequence[Part | Ball], camera: Camera, studio: Studio, samples: int = 3, threshold: float = 0.02
) -> np.ndarray:
    """A picture with its edges smoothed.

    Parameters
    ----------
    parts : sequence of Part or Ball
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
