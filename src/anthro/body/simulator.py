"""Forward dynamics of a muscle-driven body at 5 to 7 ms: linearly implicit Euler.

Zhou et al. 2021, Appendix B, Eq. 3 to 7. The velocity change of a step h solves

    (M + h D + h^2 K) dv = h (f - h K v)

with f all generalized forces at the start of the step, K = -df/dq and D = -df/dv of everything stiff: muscles and
ligaments (J^T diag(k) J over the path Jacobian J = dl/dq, the transposed moment arms), joint springs and dampers,
joint limits, cords and contacts (:mod:`anthro.body.stops`). Coriolis forces c(q, v) are implicit as well, by
iteration: a first solution with c(q, v) gives c(q, v + dv) for the next. Taken at the start of the step they would
feed energy into a chain of many bones. Gravity and the turning of moment arms are those of the start; the scheme is
of first order.
"""

from __future__ import annotations

import mujoco
import numpy as np
from numba import njit
from scipy.linalg.lapack import dpotrf, dpotrs

from anthro.body import hill
from anthro.body.contact import Touch, World
from anthro.body.model import Body
from anthro.body.paths import Paths, add_springs, rates
from anthro.body.stops import LIMIT_DAMPING, LIMIT_STIFFNESS, Stops, limit_torque, meet_limits
from anthro.errors import UserError

__all__ = ["DEFAULT_STEP", "LIMIT_DAMPING", "LIMIT_STIFFNESS", "Simulator", "limit_torque"]

DEFAULT_STEP = 0.005
CORRECTIONS = 4  # most times that the set of pushing stops is settled anew in one step
BIAS_CORRECTIONS = 2  # times that Coriolis forces are computed from the step's end velocity


class Simulator:
    """Steps one body of m hinges, n muscles, k ligaments; nv = m velocities, m + 6 where the root is free.

    A step is :meth:`_assemble`, :meth:`_solve`, :meth:`_advance`, then :meth:`refresh`, which is
    :meth:`_positions` and :meth:`_velocities`.

    Parameters
    ----------
    body : the loaded body.
    step : time step h in s.
    world : ground and seat that the body's contacts meet; None for empty space.

    Attributes
    ----------
    strain, strain_rate : (n,) of the fibers and 1/s; new arrays in every step.
    low, high : (m,) limits of the hinges, rad.
    """

    def __init__(self, body: Body, step: float = DEFAULT_STEP, world: World | None = None):
        self.body, self.world = body, world
        self.step_seconds = float(step)
        self.model, self.data = body.model, mujoco.MjData(body.model)
        self.low, self.high = np.ascontiguousarray(body.q_range.T)
        m, n, nv = body.dof_count, body.muscle_count, self.model.nv
        self._hinges = slice(nv - m, nv)
        self._paths = Paths(self.model, self.data)
        self._path_rate = np.zeros(self.model.ntendon)
        self._tension, self._stiffness, self._damping = np.zeros((3, self.model.ntendon))
        self._muscles, self._ligaments = slice(0, n), slice(n, None)
        is_strut = body.ligament_slack[:, 0] == body.ligament_slack[:, 1]
        self._struts, self._cords = np.flatnonzero(is_strut), np.flatnonzero(~is_strut)
        # struts are springs as the muscles are, cords are stops
        self._stiffness[n:] = np.where(is_strut, body.ligament_stiffness, 0.0)
        self._damping[n:] = np.where(is_strut, body.ligament_damping, 0.0)
        self._touch = None if world is None else Touch(body, world)
        self._stops = self._make_stops()
        self._lower, self._factor = np.zeros((nv, nv)), np.zeros((nv, nv))
        self._force, self._right, self._bias, self._velocity, self._applied = np.zeros((5, nv))
        self._joint_stiffness, self._joint_damping = np.zeros((2, nv))
        self._joint_stiffness[self._hinges] = body.joint_stiffness
        self._joint_damping[self._hinges] = body.joint_damping
        self._angles = np.zeros(nv)
        self._mass_rows = (self.model.M_rowadr, self.model.M_rownnz, self.model.M_colind, self.data.M)
        self.reset(self._rest_pose())

    def _make_stops(self) -> Stops:
        """One stop for each joint limit, then each cord, then each contact."""
        body, first = self.body, self._hinges.start
        hinges = [[first + j] for j in range(body.dof_count)]
        start, column = self._paths.start, self._paths.column
        rows = body.muscle_count + self._cords
        cords = [column[start[row] : start[row + 1]] for row in rows]
        entries = [np.arange(start[row], start[row + 1]) for row in rows]
        self._cord_entries = np.concatenate([*entries, np.empty(0)]).astype(int)
        self._cord_lengths = np.diff(start)[rows]
        contacts = self._touch.columns if self._touch else []
        sizes = np.cumsum([len(hinges), len(cords), len(contacts)])
        self._limit_stops, self._cord_stops, self._contact_stops = (
            slice(0, sizes[0]),
            slice(sizes[0], sizes[1]),
            slice(sizes[1], sizes[2]),
        )
        world = self.world or World()
        return Stops(
            [*hinges, *cords, *contacts],
            np.r_[
                np.full(len(hinges), LIMIT_STIFFNESS),
                body.ligament_stiffness[self._cords],
                np.full(len(contacts), world.stiffness),
            ],
            np.r_[
                np.full(len(hinges), LIMIT_DAMPING),
                body.ligament_damping[self._cords],
                np.full(len(contacts), world.damping),
            ],
        )

    def _rest_pose(self) -> np.ndarray:
        pose = self.model.qpos0.copy()
        pose[-self.body.dof_count :] = self.body.q_rest
        return pose

    def reset(self, qpos=None, qvel=None, time: float = 0.0) -> None:
        """Set the state and forget pushes.

        Parameters
        ----------
        qpos : (nq,) root pose (x, y, z, quaternion) where the root is free, then angles (m,) rad; rest when None.
        qvel : (nv,) root velocity (linear in the world, angular in the root's frame), then rad/s; zero when None.
        time : s.
        """
        self.data.qpos[:] = self._rest_pose() if qpos is None else qpos
        self.data.qvel[:] = 0.0 if qvel is None else qvel
        self.data.time = time
        self._applied[:] = 0.0
        self.refresh()

    def refresh(self) -> None:
        """Recompute everything that follows from position and velocity."""
        self._positions()
        self._velocities()

    def _positions(self) -> None:
        model, data, body = self.model, self.data, self.body
        mujoco.mj_kinematics(model, data)
        mujoco.mj_comPos(model, data)
        mujoco.mj_tendon(model, data)
        mujoco.mj_makeM(model, data)
        self._paths.refresh()
        stops, length = self._stops, data.ten_length
        self.strain = hill.strain(length[self._muscles] - body.tendon_length, body.slack_length)
        self._angles[self._hinges] = self.joint_angles
        meet_limits(self._angles[self._hinges], self.low, self.high, stops.overlap, stops.value)
        if len(self._cords):
            self._meet_cords(length[self._ligaments][self._cords])
        if self._touch:
            self._touch.refresh_positions(data)
            stops.overlap[self._contact_stops] = self._touch.overlap
            first = stops.start[self._contact_stops.start]
            np.negative(self._touch.slope[2], out=stops.value[first:])

    def _meet_cords(self, length) -> None:
        low, high = self.body.ligament_slack[self._cords].T
        long = length - high > low - length
        self._stops.overlap[self._cord_stops] = np.where(long, length - high, low - length)
        first = self._stops.start[self._cord_stops.start]
        sign = np.repeat(np.where(long, 1.0, -1.0), self._cord_lengths)
        self._stops.value[first : first + len(sign)] = sign * self._paths.value[self._cord_entries]

    def _velocities(self) -> None:
        model, data, paths = self.model, self.data, self._paths
        mujoco.mj_comVel(model, data)
        mujoco.mj_rne(model, data, 0, data.qfrc_bias)
        rates(paths.start, paths.column, paths.value, data.qvel, self._path_rate)
        self.strain_rate = self._path_rate[self._muscles] / self.body.slack_length
        self._stops.refresh(data.qvel)
        if self._touch:
            self._touch.refresh_velocities(data.qvel)

    qpos = property(lambda self: self.data.qpos, doc="Position (nq,), a view.")
    qvel = property(lambda self: self.data.qvel, doc="Velocity (nv,), a view.")
    time = property(lambda self: self.data.time, doc="Time in s.")

    @property
    def joint_angles(self) -> np.ndarray:
        """Angles of the hinges (m,) rad, a view."""
        return self.data.qpos[self.model.nq - self.body.dof_count :]

    @property
    def joint_velocities(self) -> np.ndarray:
        """Velocities of the hinges (m,) rad/s, a view."""
        return self.data.qvel[self._hinges]

    @property
    def jacobian(self) -> np.ndarray:
        """Path Jacobian P^T = dl/dq of the muscles (n, nv), m or m/rad, a new array."""
        return self._paths.dense(self.body.muscle_count, self.model.nv)

    @property
    def mass(self) -> np.ndarray:
        """Mass matrix (nv, nv), a new array."""
        mass = np.zeros((self.model.nv, self.model.nv))
        mujoco.mj_fullM(self.model, self.data, mass)
        return mass

    def moment_arms(self) -> np.ndarray:
        """Moment arms (n, m) m: -dl/dq, positive where tension turns the hinge towards larger angles."""
        return -self.jacobian[:, self._hinges]

    @property
    def hand_position(self) -> np.ndarray:
        """Hand's position (3,) m, a copy.

        Raises
        ------
        UserError
            The body has no end effector.
        """
        return self.data.site_xpos[self._hand()].copy()

    @property
    def centre_of_mass(self) -> np.ndarray:
        """Centre of mass of the whole body (3,) m, a copy."""
        return self.data.subtree_com[0].copy()

    def _hand(self) -> int:
        if self.body.hand_site is None:
            raise UserError(f"{self.body.name} has no hand site")
        return self.body.hand_site

    def push(self, force, bone: str | None = None) -> None:
        """Apply a world force (3,) N until it is changed; zeros end it.

        It acts at the hand, or at the centre of mass of ``bone``. Its torques are those of the present posture.

        Raises
        ------
        UserError
            There is no such bone, or no hand.
        """
        jacobian = np.zeros((3, self.model.nv))
        if bone is None:
            mujoco.mj_jacSite(self.model, self.data, jacobian, None, self._hand())
        else:
            index = mujoco.mj_name2id(self.model, mujoco.mjtObj.mjOBJ_BODY, bone)
            if index < 0:
                raise UserError(f"{self.body.name} has no bone {bone!r}")
            mujoco.mj_jacBodyCom(self.model, self.data, jacobian, None, index)
        self._applied[:] = jacobian.T @ np.asarray(force, float)

    def muscle_force(self, activation) -> np.ndarray:
        """Tensions (n,) N at the present strains and the given activations (n,)."""
        return hill.force(activation, self.strain, self.strain_rate, self.body.max_force)

    def ligament_force(self) -> np.ndarray:
        """Tensions (k,) N of the ligaments in the present state; a strut's is negative where it pushes."""
        force = np.zeros(self.body.ligament_count)
        force[self._struts] = self._strut_tension()
        stops = self._cord_stops
        long = self.data.ten_length[self._ligaments][self._cords] > self.body.ligament_slack[self._cords].mean(axis=1)
        force[self._cords] = np.where(long, 1.0, -1.0) * self._stops.force()[stops]
        return force

    def contact_force(self) -> np.ndarray:
        """Forces (contacts, 3) N of the world on the body in the present state; zeros in empty space."""
        force = np.zeros((len(self.body.contacts), 3))
        if self._touch:
            force[:, 2] = self._stops.force()[self._contact_stops]
            force[:, :2] = self._touch.friction(force[:, 2])
        return force

    def joint_torque(self) -> np.ndarray:
        """Torques (m,) N m of joint springs, joint dampers and limits in the present state."""
        q, v = self.joint_angles, self.joint_velocities
        springs = -self.body.joint_stiffness * q - self.body.joint_damping * v
        return springs + limit_torque(q, v, self.low, self.high)

    def energy(self) -> float:
        """Kinetic, gravitational and elastic energy (parallel elements, ligaments, joints, limits, contacts), J."""
        data, body = self.data, self.body
        kinetic = 0.5 * data.qvel @ self.mass @ data.qvel
        gravity = -sum(self.model.body_mass * (data.xipos @ self.model.opt.gravity))
        elastic = hill.passive_energy(self.strain, body.max_force, body.slack_length).sum()
        elastic += 0.5 * body.joint_stiffness @ np.square(self.joint_angles)
        stretch = data.ten_length[self._ligaments][self._struts] - body.ligament_slack[self._struts, 1]
        elastic += 0.5 * body.ligament_stiffness[self._struts] @ np.square(stretch)
        return float(kinetic + gravity + elastic + self._stops.energy())

    def step(self, activation) -> None:
        """Advance by one step with activations (n,) in [0, 1].

        Raises
        ------
        UserError
            The activations do not fit, or they or the state are not finite; the state is kept.
        """
        self._assemble(activation)
        self._advance(self._solve())
        self.refresh()

    def _muscle_terms(self, activation):
        """Tension (N), stiffness (N/m) and damping (N s/m) of the muscles."""
        length, state = self.body.slack_length, (self.strain, self.strain_rate, self.body.max_force)
        stiffness = hill.stiffness(activation, *state) / length
        return hill.force(activation, *state), stiffness, hill.damping(activation, *state) / length

    def _strut_tension(self) -> np.ndarray:
        """Tension (struts,) N, negative where one pushes."""
        rows = self.body.muscle_count + self._struts
        stretch = self.data.ten_length[rows] - self.body.ligament_slack[self._struts, 1]
        return self._stiffness[rows] * stretch + self._damping[rows] * self._path_rate[rows]

    def _assemble(self, activation) -> None:
        """Lower triangle and force of the step's system without the stops."""
        body, data, paths, h = self.body, self.data, self._paths, self.step_seconds
        activation = np.ascontiguousarray(activation, float)
        if activation.shape != (body.muscle_count,):
            raise UserError(f"{body.name} takes {body.muscle_count} activations, got {activation.shape}")
        springs = self._tension, self._stiffness, self._damping
        for row, muscles in zip(springs, self._muscle_terms(activation), strict=True):
            row[self._muscles] = muscles
        if len(self._struts):
            self._tension[body.muscle_count + self._struts] = self._strut_tension()
        _joint_terms(
            self._lower,
            self._force,
            *self._mass_rows,
            self._angles,
            data.qvel,
            self._applied,
            h,
            self._joint_stiffness,
            self._joint_damping,
        )
        add_springs(self._lower, self._force, paths.start, paths.column, paths.value, self._path_rate, h, *springs)

    def _solve(self) -> np.ndarray:
        """Velocity change (nv,) of the step, the pushing stops settled with it."""
        h, stops, velocity = self.step_seconds, self._stops, self.data.qvel
        stops.guess(h)
        for _ in range(CORRECTIONS):
            np.copyto(self._factor, self._lower)
            np.copyto(self._right, self._force)
            stops.add(self._factor, self._right, h)
            if self._touch:
                contacts = self._contact_stops
                self._touch.add(self._factor, self._right, h, stops.load[contacts], stops.active[contacts])
            # LAPACK sees the transpose: its upper triangle
            _, info = dpotrf(self._factor.T, lower=0, clean=0, overwrite_a=1)
            change = self._velocity_change(self.data.qfrc_bias)
            for _ in range(BIAS_CORRECTIONS):
                change = self._velocity_change(self._bias_at(velocity + change))
            if info or not np.isfinite(change).all():
                raise UserError(self._complaint(info))
            if not self._correct(velocity + change):
                break
        return change

    def _velocity_change(self, bias) -> np.ndarray:
        """Solve the factored system under gravity and Coriolis forces ``bias`` (nv,)."""
        return dpotrs(self._factor.T, self.step_seconds * (self._right - bias), lower=0, overwrite_b=1)[0]

    def _bias_at(self, velocity) -> np.ndarray:
        """Gravity and Coriolis forces (nv,) at a velocity (nv,) in the present posture."""
        data = self.data
        np.copyto(self._velocity, data.qvel)
        np.copyto(data.qvel, velocity)
        mujoco.mj_comVel(self.model, data)
        mujoco.mj_rne(self.model, data, 0, self._bias)
        np.copyto(data.qvel, self._velocity)
        return self._bias

    def _correct(self, velocity) -> bool:
        """Compare stops and friction with the step's end velocity (nv,); True when they must be settled anew."""
        switched = self._stops.correct(velocity, self.step_seconds)
        if self._touch:
            switched |= self._touch.correct(velocity, self._stops.active[self._contact_stops])
        return switched

    def _complaint(self, info: int) -> str:
        """What to tell when a step has no finite solution."""
        broken = ~np.isfinite(self._right)
        first = int(np.argmax(broken)) if broken.any() else max(info - 1, 0)
        return f"simulation is not finite at {self.time:.3f} s, first at {self.body.velocity_names[first]}"

    def _advance(self, change) -> None:
        data = self.data
        data.qvel += change
        mujoco.mj_integratePos(self.model, data.qpos, data.qvel, self.step_seconds)
        data.time += self.step_seconds


@njit(cache=True)
def _joint_terms(lower, force, row_start, row_count, columns, mass, q, v, applied, h, stiffness, damping):
    """Begin the system: lower triangle of M, joint springs and dampers, applied forces."""
    lower[:] = 0.0
    for i in range(q.shape[0]):
        for k in range(row_start[i], row_start[i] + row_count[i]):
            lower[i, columns[k]] = mass[k]
        lower[i, i] += h * damping[i] + h * h * stiffness[i]
        force[i] = applied[i] - damping[i] * v[i] - stiffness[i] * (q[i] + h * v[i])
