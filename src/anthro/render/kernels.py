"""Inner loops of ray tracing, compiled: which hit is nearest, what light it sends back.

Vectors are single precision. Rays have origins and unit directions (n, 3) in the world, or are columns (6, n) of both;
``reach`` (n,) says how far each of them still looks, m, and is 0 for one that looks no more.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from anthro.render.culling import COMPILED, SMALL

SHININESS = 40  # exponent of the highlight


@njit(**COMPILED)
def cast(local, rotation, pinhole):
    """Rays through a pinhole (3,), m, of the world; in double precision but for what is returned.

    Parameters
    ----------
    local : ndarray (n, 3)
        Their directions in an eye's frame.
    rotation : ndarray (3, 3)
        From that frame to the world.

    Returns
    -------
    origins, directions : ndarray (n, 3)
    """
    origins, directions = np.empty(local.shape, np.float32), np.empty(local.shape, np.float32)
    for i in range(len(local)):
        x, y, z = local[i, 0], local[i, 1], local[i, 2]
        for j in range(3):
            origins[i, j] = pinhole[j]
            directions[i, j] = rotation[j, 0] * x + rotation[j, 1] * y + rotation[j, 2] * z
    return origins, directions


@njit(**COMPILED)
def keep_nearest(
    index, chosen, far, face, u, v, faces, corners, skins, sheen, rotation, columns, distance, part, normal, surface
):
    """Hits of a part that are nearer than what the rays hit so far.

    Parameters
    ----------
    index : int
        Of the part.
    chosen, far, face, u, v : ndarray (k,)
        Rays, and where they hit it: distance, triangle (-1 for a miss), barycentric coordinates.
    faces, corners, skins, sheen : ndarray (m, 3), (v, 4), (m, 4), (2,)
        The part's triangles; normal and exposure of each vertex; colour and glow of each triangle; gloss and mirror.
    distance, part, normal, surface : ndarray (n,), (n,), (n, 3), (n, 7)
        Changed: nearest hits; ``surface`` has colour, exposure, glow, gloss and mirror.
    """
    for k in range(len(far)):
        i, f = chosen[k], face[k]
        if f < 0 or far[k] >= distance[i]:
            continue
        distance[i], part[i] = far[k], index
        a, b, c = faces[f, 0], faces[f, 1], faces[f, 2]
        w = 1 - u[k] - v[k]
        x = w * corners[a, 0] + u[k] * corners[b, 0] + v[k] * corners[c, 0]
        y = w * corners[a, 1] + u[k] * corners[b, 1] + v[k] * corners[c, 1]
        z = w * corners[a, 2] + u[k] * corners[b, 2] + v[k] * corners[c, 2]
        size, facing = np.float32(0.0), np.float32(0.0)
        for j in range(3):
            value = rotation[j, 0] * x + rotation[j, 1] * y + rotation[j, 2] * z
            normal[i, j] = value
            size += value * value
            facing += value * columns[3 + j, i]
        scale = 1 / max(np.sqrt(size), SMALL)
        if facing > 0:
            scale = -scale
        for j in range(3):
            normal[i, j] *= scale
            surface[i, j] = skins[f, j]
        surface[i, 3] = w * corners[a, 3] + u[k] * corners[b, 3] + v[k] * corners[c, 3]
        surface[i, 4], surface[i, 5], surface[i, 6] = skins[f, 3], sheen[0], sheen[1]


@njit(**COMPILED)
def mark(chosen, answer, reach):
    """Set the ``reach`` of those rays (k,) to 0 whose ``answer`` (k,) of embree's occlusion query is 0."""
    for k in range(len(answer)):
        if answer[k] == 0:
            reach[chosen[k]] = 0


@njit(**COMPILED)
def meet_ball(index, centre, radius, skin, columns, distance, part, normal, surface):
    """Hits of a ball that are nearer than what the rays hit so far; arguments as in `keep_nearest`.

    Double precision: the difference of two squares decides.
    """
    for i in range(len(distance)):
        x, y, z = centre[0] - columns[0, i], centre[1] - columns[1, i], centre[2] - columns[2, i]
        ahead = x * columns[3, i] + y * columns[4, i] + z * columns[5, i]
        gap = ahead * ahead - (x * x + y * y + z * z) + radius * radius
        if gap <= 0:
            continue
        half = np.sqrt(gap)
        far = ahead - half
        if far <= 0:
            far = ahead + half
        if far <= 0 or far >= distance[i]:
            continue
        distance[i], part[i] = far, index
        facing = 0.0
        for j in range(3):
            normal[i, j] = (columns[j, i] + far * columns[3 + j, i] - centre[j]) / radius
            facing += normal[i, j] * columns[3 + j, i]
        if facing > 0:
            for j in range(3):
                normal[i, j] = -normal[i, j]
        for j in range(7):
            surface[i, j] = skin[j]


@njit(**COMPILED)
def block_ball(centre, radius, columns, reach):
    """Set the ``reach`` of rays that meet a ball to 0."""
    for i in range(len(reach)):
        x, y, z = centre[0] - columns[0, i], centre[1] - columns[1, i], centre[2] - columns[2, i]
        ahead = x * columns[3, i] + y * columns[4, i] + z * columns[5, i]
        away = x * x + y * y + z * z - radius * radius
        if ahead * ahead - away > 0 and (ahead > 0 or away < 0):
            reach[i] = 0


@njit(**COMPILED)
def leave(seen, origins, directions, distance, normal, offset):
    """Points (k, 3), m, just off the surfaces that the rays ``seen`` (k,) hit."""
    points = np.empty((len(seen), 3), np.float32)
    for k in range(len(seen)):
        i = seen[k]
        for j in range(3):
            points[k, j] = origins[i, j] + distance[i] * directions[i, j] + offset * normal[i, j]
    return points


@njit(**COMPILED)
def phong(seen, directions, normal, surface, arrived, key, sky, axis, colours):
    """Light that surfaces send back along the rays ``seen`` (k,).

    Phong's local model (1975) with Blinn's halfway vector (1977) for the highlight; what is ambient comes from a sky
    that is brighter above.

    Parameters
    ----------
    arrived : ndarray (k,)
        Share of the key light that arrives, with the cosine of its angle.
    key, sky : float
        Strengths.
    axis : ndarray (3,)
        Unit, to the key light.
    colours : ndarray (n, 3)
        Changed: linear RGB.
    """
    half = np.empty(3, np.float32)
    for k in range(len(seen)):
        i = seen[k]
        light = key * arrived[k] + sky * surface[i, 3] * np.float32(0.7 + 0.3 * normal[i, 2]) + surface[i, 4]
        highlight = np.float32(0.0)
        if arrived[k] > 0 and surface[i, 5] > 0:
            size, facing = np.float32(0.0), np.float32(0.0)
            for j in range(3):
                half[j] = axis[j] - directions[i, j]
                size += half[j] * half[j]
                facing += half[j] * normal[i, j]
            facing = min(max(facing / np.sqrt(size), 0.0), 1.0)
            highlight = surface[i, 5] * facing**SHININESS
        for j in range(3):
            colours[i, j] = surface[i, j] * light + highlight


@njit(**COMPILED)
def backdrop(directions, horizon, top):
    """Linear RGB (n, 3) of a backdrop that turns from one colour (3,) to another as rays (n, 3) rise."""
    colours = np.empty((len(directions), 3), np.float32)
    for i in range(len(directions)):
        rise = min(max(directions[i, 2] / np.float32(0.45), np.float32(0.0)), np.float32(1.0))
        for j in range(3):
            colours[i, j] = horizon[j] + (top[j] - horizon[j]) * rise
    return colours


@njit(**COMPILED)
def meet_floor(origins, directions, needed, floor):
    """Which of the rays that are ``needed`` (n,) meet the floor from above, and where.

    Returns
    -------
    rows : ndarray (k,)
    points : ndarray (k, 3)
        m.
    """
    rows = np.empty(len(directions), np.int64)
    points = np.empty((len(directions), 3), np.float32)
    count = 0
    for i in range(len(directions)):
        if needed[i] and directions[i, 2] < -1e-3 and origins[i, 2] > floor:
            distance = (floor - origins[i, 2]) / directions[i, 2]
            for j in range(3):
                points[count, j] = origins[i, j] + distance * directions[i, j]
            rows[count] = i
            count += 1
    return rows[:count], points[:count]


@njit(**COMPILED)
def paint_floor(rows, points, origins, lit, floor_colour, colours):
    """Colour the rays ``rows`` (k,) that meet the floor at ``points`` (k, 3), m; ``lit`` (k,) 0 in shadow, 1 in light.

    The floor fades into the backdrop, so that no horizon cuts the picture.
    """
    for k in range(len(rows)):
        i = rows[k]
        away = np.float32(0.0)
        for j in range(3):
            away += (points[k, j] - origins[i, j]) ** 2
        height = origins[i, 2] - points[k, 2]
        fade = min(np.sqrt(away) / (6 * height + 6), np.float32(1.0))
        fade = fade * fade * (3 - 2 * fade)
        light = np.float32(0.45) + np.float32(0.55) * min(max(lit[k], np.float32(0.0)), np.float32(1.0))
        for j in range(3):
            colours[i, j] = floor_colour[j] * light * (1 - fade) + colours[i, j] * fade
