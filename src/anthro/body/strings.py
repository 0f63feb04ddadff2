"""Lengths and slopes of paths from site to site, straight or over one sphere or cylinder on the way, compiled.

A straight piece between two bones changes its length with the joints that lie above one of them and not above both:
the others move it as a whole. :func:`mujoco.mj_tendon` sums over all joints above either bone, which in a body of
many bones is most of its work. Paths over pulleys, or between two trees of bones, are left to it.

Numba's cache watches this file's text alone: count up with each change of what it compiles in,
wrapping.py and rows.py: 2.
"""

from __future__ import annotations

import mujoco
import numpy as np
from numba import njit

from anthro.body.rows import INDEX, velocities_above
from anthro.body.wrapping import wrap

_SITE, _SPHERE, _CYLINDER = (int(getattr(mujoco.mjtWrap, f"mjWRAP_{name}")) for name in ("SITE", "SPHERE", "CYLINDER"))
_SHORTEST = 1e-12  # m, a piece shorter than this has no direction


def elements(model, tendon: int) -> range:
    """Places of a tendon's elements in MuJoCo's ``wrap_type`` and ``wrap_objid``."""
    return range(model.tendon_adr[tendon], model.tendon_adr[tendon] + model.tendon_num[tendon])


def bone_of(model, element: int) -> int:
    """The body that a site, sphere or cylinder belongs to; -1 for other elements."""
    kind, index = int(model.wrap_type[element]), int(model.wrap_objid[element])
    if kind == _SITE:
        return int(model.site_bodyid[index])
    return int(model.geom_bodyid[index]) if kind in (_SPHERE, _CYLINDER) else -1


def is_string(model, tendon: int) -> bool:
    """Whether a tendon is this module's: no pulleys, all bones of one tree (those of the world belong to any)."""
    bones = {bone_of(model, k) for k in elements(model, tendon)}
    return (
        -1 not in bones and len({int(model.body_rootid[bone]) for bone in bones if velocities_above(model, bone)}) <= 1
    )


class Strings:
    """The pieces of such tendons of a model, and what moves them.

    Parameters
    ----------
    model, data : MuJoCo's.
    tendons : which of them (:func:`is_string`).
    start, column, value : rows of dl/dq of all tendons (:class:`anthro.body.paths.Paths`).
    """

    def __init__(self, model, data, tendons, start, column, value):
        self._model, self._start, self._column = model, start, column
        self._above = [set(velocities_above(model, bone)) for bone in range(model.nbody)]
        self._moved, self._ends = [], [0]
        pieces, wraps, rows = [], [], []
        for tendon in tendons:
            places = elements(model, tendon)
            bones = [bone_of(model, k) for k in places]
            root = max((int(model.body_rootid[bone]) for bone in bones if self._above[bone]), default=0)
            rows.append((start[tendon], start[tendon + 1], tendon))
            k = 0
            while k + 1 < len(places):
                hops = 1 if model.wrap_type[places[k + 1]] == _SITE else 2
                sites = model.wrap_objid[places[k]], model.wrap_objid[places[k + hops]]
                table = tendon, *sites, root, self._list_moving(tendon, bones[k], bones[k + hops])
                if hops == 1:
                    pieces.append(table)
                else:
                    over = places[k + 1]
                    ways = [self._list_moving(tendon, bones[j], bones[j + 1]) for j in (k, k + 1)]
                    side = round(float(model.wrap_prm[over]))
                    is_cylinder = model.wrap_type[over] == _CYLINDER
                    wraps.append((*table, *ways, model.wrap_objid[over], max(side, 0), side >= 0, is_cylinder))
                k += hops
        moved = np.array(self._moved, np.int64).reshape(-1, 3)
        self._tables = (
            np.array(rows, INDEX).reshape(-1, 3),  # first and last entry, tendon
            np.array(pieces, INDEX).reshape(-1, 5),  # tendon, two sites, root, note of what moves it
            np.array(wraps, INDEX).reshape(-1, 11),  # the same, notes of both ends, surface, side, sided, cylinder
            *(data.site_xpos, data.subtree_com, data.geom_xpos, data.geom_xmat, model.geom_size[:, 0].copy()),
            np.array(self._ends, INDEX),
            *(moved[:, 0].astype(INDEX), moved[:, 1].astype(INDEX), moved[:, 2].astype(float), data.cdof),
            *(data.ten_length, value),
        )

    def _list_moving(self, tendon: int, bone: int, other: int) -> int:
        """Note which velocities change the length of a piece from ``bone`` to ``other``; the number of the note."""
        first, last = self._start[tendon : tendon + 2]
        place = {int(self._column[k]): k for k in range(first, last)}
        above, below = self._above[bone], self._above[other]
        self._moved += [(dof, place[dof], 1 if dof in below else -1) for dof in sorted(above ^ below)]
        self._ends.append(len(self._moved))
        return len(self._ends) - 2

    def refresh(self) -> None:
        """Write lengths to ``data.ten_length`` and slopes to ``value``, from MuJoCo's kinematics and joint axes."""
        _measure(*self._tables)


@njit(cache=True, fastmath={"contract"}, error_model="numpy", forceinline=True)
def _piece(p, q, centre, note, ends, dof, entry, sign, axes, value):
    """Length of a piece from p to q; its slopes are added to ``value``.

    A joint axis (angular w, linear v at c) lengthens a piece along the unit vector u by u.v + w.((p - c) x u).
    """
    ux, uy, uz = q[0] - p[0], q[1] - p[1], q[2] - p[2]
    distance = np.sqrt(ux * ux + uy * uy + uz * uz)
    if ends[note] == ends[note + 1]:
        return distance
    scale = 1.0 / max(distance, _SHORTEST)
    ux, uy, uz = ux * scale, uy * scale, uz * scale
    x, y, z = p[0] - centre[0], p[1] - centre[1], p[2] - centre[2]
    mx, my, mz = y * uz - z * uy, z * ux - x * uz, x * uy - y * ux
    for k in range(ends[note], ends[note + 1]):
        axis = axes[dof[k]]
        turn = axis[0] * mx + axis[1] * my + axis[2] * mz
        value[entry[k]] += sign[k] * (turn + axis[3] * ux + axis[4] * uy + axis[5] * uz)
    return distance


@njit(cache=True, forceinline=True)
def _point(points, i):
    return points[i, 0], points[i, 1], points[i, 2]


@njit(cache=True, error_model="numpy")
def _measure(
    rows, pieces, wraps, points, centres, surfaces, frames, radii, ends, dof, entry, sign, axes, length, value
):
    """Sum over the straight pieces, then over what may wrap, in the columns of :class:`Strings`' tables."""
    for i in range(rows.shape[0]):
        value[rows[i, 0] : rows[i, 1]] = 0.0
        length[rows[i, 2]] = 0.0
    for i in range(pieces.shape[0]):
        p, q, c = _point(points, pieces[i, 1]), _point(points, pieces[i, 2]), _point(centres, pieces[i, 3])
        length[pieces[i, 0]] += _piece(p, q, c, pieces[i, 4], ends, dof, entry, sign, axes, value)
    for i in range(wraps.shape[0]):
        tendon, surface, sided, cylinder = wraps[i, 0], wraps[i, 7], wraps[i, 9], wraps[i, 10]
        p, q, c = _point(points, wraps[i, 1]), _point(points, wraps[i, 2]), _point(centres, wraps[i, 3])
        side, centre = _point(points, wraps[i, 8]), _point(surfaces, surface)
        on, come, leave = wrap(p, q, side, sided != 0, centre, frames[surface], radii[surface], cylinder != 0)
        if on < 0.0:
            length[tendon] += _piece(p, q, c, wraps[i, 4], ends, dof, entry, sign, axes, value)
        else:
            length[tendon] += _piece(p, come, c, wraps[i, 5], ends, dof, entry, sign, axes, value) + on
            length[tendon] += _piece(leave, q, c, wraps[i, 6], ends, dof, entry, sign, axes, value)
