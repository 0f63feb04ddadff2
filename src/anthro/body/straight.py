"""Lengths and slopes of paths that run straight from site to site, compiled.

A segment between two bones changes its length with the joints that lie above one of them and not above both: the
others move it as a whole. :func:`mujoco.mj_tendon` sums over all joints above either bone, which in a body of many
bones is most of its work. Paths over wrapping surfaces, over pulleys, or between two trees of bones are left to it.
"""

from __future__ import annotations

import mujoco
import numpy as np
from numba import njit

from anthro.body.rows import INDEX, velocities_above

_SITE = int(mujoco.mjtWrap.mjWRAP_SITE)
_SHORTEST = 1e-12  # m, a segment shorter than this has no direction


def elements(model, tendon: int) -> range:
    """Places of a tendon's elements in MuJoCo's ``wrap_type`` and ``wrap_objid``."""
    return range(model.tendon_adr[tendon], model.tendon_adr[tendon] + model.tendon_num[tendon])


def is_straight(model, tendon: int) -> bool:
    """Whether a tendon is this module's: sites only, on bones of one tree (those of the world belong to any)."""
    if any(model.wrap_type[k] != _SITE for k in elements(model, tendon)):
        return False
    bodies = [model.site_bodyid[model.wrap_objid[k]] for k in elements(model, tendon)]
    return len({int(model.body_rootid[body]) for body in bodies if velocities_above(model, body)}) <= 1


class StraightPaths:
    """Segments of the straight tendons of a model, and what moves them.

    Parameters
    ----------
    model, data : MuJoCo's.
    tendons : which are straight (:func:`is_straight`).
    start, column, value : rows of dl/dq of all tendons (:class:`anthro.body.paths.Paths`).
    """

    def __init__(self, model, data, tendons, start, column, value):
        above = [set(velocities_above(model, body)) for body in range(model.nbody)]
        segments, counts, entries = [], [], []
        for tendon in tendons:
            sites = [int(model.wrap_objid[k]) for k in elements(model, tendon)]
            bodies = [int(model.site_bodyid[site]) for site in sites]
            root = max((int(model.body_rootid[body]) for body in bodies if above[body]), default=0)
            place = {int(column[k]): k for k in range(start[tendon], start[tendon + 1])}
            for k in range(len(sites) - 1):
                ends = above[bodies[k]], above[bodies[k + 1]]
                moving = sorted(ends[0] ^ ends[1])
                segments.append((tendon, sites[k], sites[k + 1], root))
                counts.append(len(moving))
                entries += [(dof, place[dof], 1 if dof in ends[1] else -1) for dof in moving]
        rows = np.array([(start[tendon], start[tendon + 1], tendon) for tendon in tendons], INDEX).reshape(-1, 3)
        moved = np.array(entries, np.int64).reshape(-1, 3)
        self._tables = (
            rows,
            np.array(segments, INDEX).reshape(-1, 4),
            np.cumsum([0, *counts]).astype(INDEX),
            moved[:, 0].astype(INDEX),
            moved[:, 1].astype(INDEX),
            moved[:, 2].astype(float),
            data.site_xpos,
            data.subtree_com,
            data.cdof,
            data.ten_length,
            value,
        )

    def refresh(self) -> None:
        """Write lengths to ``data.ten_length`` and slopes to ``value``, from MuJoCo's sites and joint axes."""
        _refresh(*self._tables)


@njit(cache=True, fastmath={"contract"}, error_model="numpy")
def _refresh(rows, segments, first, dof, entry, sign, points, centres, axes, length, value):
    """Sum over segments: an axis (angular w, linear v at c) lengthens one along u at p by u.v + w.((p - c) x u)."""
    for i in range(rows.shape[0]):
        value[rows[i, 0] : rows[i, 1]] = 0.0
        length[rows[i, 2]] = 0.0
    for s in range(segments.shape[0]):
        a, b = segments[s, 1], segments[s, 2]
        ax, ay, az = points[a, 0], points[a, 1], points[a, 2]
        ux, uy, uz = points[b, 0] - ax, points[b, 1] - ay, points[b, 2] - az
        distance = np.sqrt(ux * ux + uy * uy + uz * uz)
        length[segments[s, 0]] += distance
        if first[s] == first[s + 1]:
            continue
        scale = 1.0 / max(distance, _SHORTEST)
        ux, uy, uz = ux * scale, uy * scale, uz * scale
        root = segments[s, 3]
        px, py, pz = ax - centres[root, 0], ay - centres[root, 1], az - centres[root, 2]
        mx, my, mz = py * uz - pz * uy, pz * ux - px * uz, px * uy - py * ux
        for k in range(first[s], first[s + 1]):
            axis = axes[dof[k]]
            turn = axis[0] * mx + axis[1] * my + axis[2] * mz
            value[entry[k]] += sign[k] * (turn + axis[3] * ux + axis[4] * uy + axis[5] * uz)
