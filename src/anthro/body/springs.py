"""The step's linear system of everything but the stops, assembled in one compiled pass.

System and force are those of :mod:`anthro.body.simulator`: with tension f, its slopes k in length and d in speed, a
path of slopes j = dl/dq adds j j^T (h d + h^2 k) to the matrix and -j (f + h k l') to the force.

Numba's cache watches this file's text alone: count up with each change of what it compiles in,
hill.py and rows.py: 2.
"""

from __future__ import annotations

from numba import njit

from anthro.body import hill
from anthro.body.rows import add_row, add_square


@njit(cache=True, forceinline=True)
def _joints(lower, force, applied, row_start, row_count, columns, mass, q, v, h, stiffness, damping):
    """Begin the system: lower triangle of M, joint springs and dampers, applied forces."""
    lower[:] = 0.0
    first = v.shape[0] - q.shape[0]
    for i in range(v.shape[0]):
        for k in range(row_start[i], row_start[i] + row_count[i]):
            lower[i, columns[k]] = mass[k]
        force[i] = applied[i]
    for j in range(q.shape[0]):
        i = first + j
        lower[i, i] += h * damping[j] + h * h * stiffness[j]
        force[i] -= damping[j] * v[i] + stiffness[j] * (q[j] + h * v[i])


@njit(cache=True, forceinline=True)
def _spring(lower, force, start, column, value, i, rate, h, tension, stiffness, damping):
    """Add the path ``i``."""
    pull = tension + h * stiffness * rate
    if pull != 0.0:
        add_row(force, start, column, value, i, -pull)
    weight = h * damping + h * h * stiffness
    if weight > 0.0:
        add_square(lower, start, column, value, i, weight)


@njit(cache=True, error_model="numpy")
def assemble(
    activation,
    lower,
    force,
    applied,
    row_start,
    row_count,
    columns,
    mass,
    q,
    v,
    h,
    joint_stiffness,
    joint_damping,
    start,
    column,
    value,
    length,
    rate,
    tendon_length,
    slack_length,
    max_force,
    struts,
    strut_stiffness,
    strut_damping,
    strut_length,
):
    """Put inertia, joints, muscles and struts into the system.

    Parameters
    ----------
    activation : (n,) of the muscles, which are the first n paths.
    lower, force : (nv, nv) and (nv,), written; of ``lower`` the lower triangle.
    applied : (nv,) other forces.
    row_start, row_count, columns, mass : MuJoCo's sparse mass matrix.
    q, v : (m,) angles of the hinges, which are the last m velocities, and (nv,) velocities.
    h : step, s.
    joint_stiffness, joint_damping : (m,) N m/rad and N m s/rad.
    start, column, value, length, rate : of all paths (:class:`anthro.body.paths.Paths`).
    tendon_length, slack_length, max_force : (n,) m, m and N of the muscles.
    struts, strut_stiffness, strut_damping, strut_length : paths, N/m, N s/m and rest lengths m of the struts.
    """
    _joints(lower, force, applied, row_start, row_count, columns, mass, q, v, h, joint_stiffness, joint_damping)
    for i in range(activation.shape[0]):
        a, slack, strength = activation[i], slack_length[i], max_force[i]
        e, e_rate = hill.strain(length[i] - tendon_length[i], slack), rate[i] / slack
        tension = hill.force(a, e, e_rate, strength)
        stiffness = hill.stiffness(a, e, e_rate, strength) / slack
        damping = hill.damping(a, e, e_rate, strength) / slack
        _spring(lower, force, start, column, value, i, rate[i], h, tension, stiffness, damping)
    for j in range(struts.shape[0]):
        i, stiffness, damping = struts[j], strut_stiffness[j], strut_damping[j]
        tension = stiffness * (length[i] - strut_length[j]) + damping * rate[i]
        _spring(lower, force, start, column, value, i, rate[i], h, tension, stiffness, damping)
