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

import math

import mujoco
import numpy as np

from anthro.body import hill
from anthro.body.contact import Touch, World
from anthro.body.model import Body
from anthro.body.paths import Paths
from anthro.body.rows import INDEX
from anthro.body.springs import assemble
from anthro.body.stops import LIMIT_DAMPING, LIMIT_STIFFNESS, Stops, limit_torque, meet_cords, meet_limits
from anthro.body.system import System
from anthro.errors import UserError

__all__ = ["DEFAULT_STEP", "LIMIT_DAMPING", "LIMIT_STIFFNESS", "Simulator", "limit_torque"]

DEFAULT_STEP = 0.005
CORRECTIONS = 4  # most times that the set of pushing stops is settled anew in one step
ROOT = 1  # MuJoCo's first body, after the world
BIAS_CORRECTIONS = 2  # times that Coriolis forces are computed from the step's end velocity
FEW = 0.25  # changes to the system, as a share of its size, up to which it is amended and not factored anew


class Simulator:
    """Steps one body of m hinges, n muscles, k ligaments; nv = m velocities, m + 6 where the root is free.

    A step is :meth:`_assemble`, :meth:`_solve`, :meth:`_advance`, then :meth:`refresh`. MuJoCo's ``data`` is up to date
    after it in what kinematics, composite inertia and ``qfrc_bias`` give, and in ``ten_length``.

    Parameters
    ----------
    body : the loaded body.
    step : time step h in s.
    world : ground and seat that the body's contacts meet; None for empty space.

    Attributes
    ----------
    low, high : (m,) limits of the hinges, rad.
    base_velocity : (3,) m/s of a root that is carried (:meth:`carry`); velocities of joints are beside it.
    """

    def __init__(self, body: Body, step: float = DEFAULT_STEP, world: World | None = None):
        self.body, self.world = body, world
        self.step_seconds = float(step)
        self.model, self.data = body.model, mujoco.MjData(body.model)
        self.low, self.high = np.ascontiguousarray(body.q_range.T)
        m, nv = body.dof_count, self.model.nv
        self._hinges = slice(nv - m, nv)
        self._angles, self._velocity = self.data.qpos[self.model.nq - m :], self.data.qvel
        self._paths = Paths(self.model, self.data)
        is_strut = body.ligament_slack[:, 0] == body.ligament_slack[:, 1]
        # struts are springs as the muscles are, cords are stops
        self._struts, self._cords = np.flatnonzero(is_strut), np.flatnonzero(~is_strut)
        self._touch = None if world is None else Touch(body, world)
        self._stops = self._make_stops()
        contacts = 0 if self._touch is None else len(body.contacts)
        self._system = System(nv, len(self._stops) + 2 * contacts)
        self._start_velocity, self._bias, self._applied = np.zeros((3, nv))
        self._pushed, self._inertia = np.zeros((2, nv))
        self._base, self.base_velocity = None, np.zeros(3)
        self._terms = self._assembled()
        self.reset(self._rest_pose())

    def _assembled(self) -> tuple:
        """What :func:`anthro.body.springs.assemble` needs besides activations."""
        body, data, model, paths, system = self.body, self.data, self.model, self._paths, self._system
        struts = self._struts
        return (
            *(system.lower, system.force, self._applied),
            *(model.M_rowadr, model.M_rownnz, model.M_colind, data.M),
            *(self._angles, self._velocity, self.step_seconds, body.joint_stiffness, body.joint_damping),
            *(paths.start, paths.column, paths.value, paths.length, paths.rate),
            *(body.tendon_length, body.slack_length, body.max_force),
            *((body.muscle_count + struts).astype(INDEX), body.ligament_stiffness[struts]),
            *(body.ligament_damping[struts], body.ligament_slack[struts, 1]),
        )

    def _make_stops(self) -> Stops:
        """One stop for each joint limit, then each cord, then each contact."""
        body, paths, first = self.body, self._paths, self._hinges.start
        hinges = [[first + j] for j in range(body.dof_count)]
        rows = body.muscle_count + self._cords
        cords = [paths.column[paths.start[row] : paths.start[row + 1]] for row in rows]
        contacts = self._touch.columns if self._touch else []
        ends = np.cumsum([0, len(hinges), len(cords), len(contacts)])
        limit_stops, self._cord_stops, self._contact_stops = (slice(*ends[k : k + 2]) for k in range(3))
        world, counts = self.world or World(), np.diff(ends)
        stiffness = LIMIT_STIFFNESS, body.ligament_stiffness[self._cords], world.stiffness
        damping = LIMIT_DAMPING, body.ligament_damping[self._cords], world.damping
        stops = Stops(
            [*hinges, *cords, *contacts],
            *(np.concatenate([np.full(*pair) for pair in zip(counts, of, strict=True)]) for of in (stiffness, damping)),
            self.step_seconds,
        )
        self._limits = self._angles, self.low, self.high, *stops.part(limit_stops)
        low, high = np.ascontiguousarray(body.ligament_slack[self._cords].T)
        slopes = paths.start, paths.value, rows.astype(INDEX)
        self._cord_terms = paths.length, low, high, *slopes, *stops.part(self._cord_stops)
        self._contact_terms = stops.part(self._contact_stops)
        self._contact_load = stops.load[self._contact_stops], stops.active[self._contact_stops]
        return stops

    def _rest_pose(self) -> np.ndarray:
        pose = self.model.qpos0.copy()
        pose[-self.body.dof_count :] = self.body.q_rest
        return pose

    def reset(self, qpos=None, qvel=None, time: float = 0.0) -> None:
        """Set the state, forget pushes, and have a carried root back where it stood.

        Parameters
        ----------
        qpos : (nq,) root pose (x, y, z, quaternion) where the root is free, then angles (m,) rad; rest when None.
        qvel : (nv,) root velocity (linear in the world, angular in the root's frame), then rad/s; zero when None.
        time : s.
        """
        self.data.qpos[:] = self._rest_pose() if qpos is None else qpos
        self.data.qvel[:] = 0.0 if qvel is None else qvel
        self.data.time = time
        self._pushed[:] = self._inertia[:] = self.base_velocity[:] = 0.0
        if self._base is not None:
            self.model.body_pos[ROOT], self._base = self._base, None
        self.refresh()

    def refresh(self) -> None:
        """Recompute everything that follows from position and velocity."""
        model, data, velocity = self.model, self.data, self._velocity
        mujoco.mj_kinematics(model, data)
        mujoco.mj_comPos(model, data)
        mujoco.mj_makeM(model, data)
        mujoco.mj_comVel(model, data)
        mujoco.mj_rne(model, data, 0, data.qfrc_bias)
        self._paths.refresh_positions()
        self._paths.refresh_velocities(velocity)
        self._meet()

    def _meet(self) -> None:
        """Overlaps of the stops, their slopes and rates."""
        meet_limits(*self._limits)
        if len(self._cords):
            meet_cords(*self._cord_terms)
        if self._touch:
            self._touch.refresh_positions(self.data, *self._contact_terms)
            self._touch.refresh_velocities(self._velocity)
        self._stops.refresh_velocities(self._velocity)

    qpos = property(lambda self: self.data.qpos, doc="Position (nq,), a view.")
    qvel = property(lambda self: self.data.qvel, doc="Velocity (nv,), a view.")
    time = property(lambda self: self.data.time, doc="Time in s.")

    joint_angles = property(lambda self: self._angles, doc="Angles of the hinges (m,) rad, a view.")

    @property
    def joint_velocities(self) -> np.ndarray:
        """Velocities of the hinges (m,) rad/s, a view."""
        return self._velocity[self._hinges]

    @property
    def strain(self) -> np.ndarray:
        """Strains (n,) of the fibers, a new array."""
        body = self.body
        return hill.strain(self._paths.length[: body.muscle_count] - body.tendon_length, body.slack_length)

    @property
    def strain_rate(self) -> np.ndarray:
        """Strain rates (n,) 1/s of the fibers, a new array."""
        return self._paths.rate[: self.body.muscle_count] / self.body.slack_length

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

    def effector_position(self, name: str) -> np.ndarray:
        """Position (3,) m of one of the body's effectors, a copy."""
        return self.data.site_xpos[self.body.effector(name)].copy()

    @property
    def centre_of_mass(self) -> np.ndarray:
        """Centre of mass of the whole body (3,) m, a copy."""
        return self.data.subtree_com[0].copy()

    def push(self, force, bone: str) -> None:
        """Apply a world force (3,) N at a bone's centre of mass, or at an effector, until it is changed; zeros end it.

        Its torques are those of the present posture.

        Raises
        ------
        UserError
            There is no bone and no effector of that name.
        """
        jacobian = np.zeros((3, self.model.nv))
        index = mujoco.mj_name2id(self.model, mujoco.mjtObj.mjOBJ_BODY, bone)
        if bone in self.body.effectors:
            mujoco.mj_jacSite(self.model, self.data, jacobian, None, self.body.effectors[bone])
        elif index >= 0:
            mujoco.mj_jacBodyCom(self.model, self.data, jacobian, None, index)
        else:
            raise UserError(f"{self.body.name} has no bone or effector {bone!r}")
        self._pushed[:] = jacobian.T @ np.asarray(force, float)

    def carry(self, displacement, velocity) -> None:
        """Carry the fixed root of a movable body along, without turning it; called before every step of the motion.

        At the step's end it is at a ``displacement`` (3,) m from where it stood at first, with ``velocity`` (3,) m/s.
        In the base's frame each mass m bears -m a; a is the step's mean acceleration, so that no impulse is lost.

        Raises
        ------
        UserError
            The root is free, or there is ground or seat, which would not be carried along.
        """
        if self.body.root_free or self._touch:
            raise UserError(f"{self.body.name}: only a fixed root with nothing around it can be carried")
        if self._base is None:
            self._base = self.model.body_pos[ROOT].copy()
        acceleration = (np.asarray(velocity, float) - self.base_velocity) / self.step_seconds
        jacobian = np.zeros((3, self.model.nv))
        mujoco.mj_jacSubtreeCom(self.model, self.data, jacobian, ROOT)
        self._inertia[:] = -self.model.body_subtreemass[ROOT] * (jacobian.T @ acceleration)
        self.model.body_pos[ROOT] = self._base + displacement
        self.base_velocity[:] = velocity

    def muscle_force(self, activation) -> np.ndarray:
        """Tensions (n,) N at the present strains and the given activations (n,)."""
        return hill.force(activation, self.strain, self.strain_rate, self.body.max_force)

    def ligament_force(self) -> np.ndarray:
        """Tensions (k,) N of the ligaments in the present state; a strut's is negative where it pushes."""
        body, cords = self.body, self._cords
        length, rate = self._paths.length[body.muscle_count :], self._paths.rate[body.muscle_count :]
        struts = body.ligament_stiffness * (length - body.ligament_slack[:, 1]) + body.ligament_damping * rate
        long = length[cords] > body.ligament_slack[cords].mean(axis=1)
        struts[cords] = np.where(long, 1.0, -1.0) * self._stops.force()[self._cord_stops]
        return struts

    def ligament_torque(self) -> np.ndarray:
        """Torques (nv,) N m of the ligaments' tensions in the present state."""
        return -self._paths.pull(self.body.muscle_count, self.ligament_force())

    def ligament_stiffness(self, velocities) -> np.ndarray:
        """Stiffness (k, nv) N m/rad of taut ligaments at the joints of given velocities (k,), moment arms fixed."""
        body, nv = self.body, self.model.nv
        rows = (body.muscle_count + np.arange(body.ligament_count)).astype(INDEX)
        taut = np.ones(body.ligament_count, bool)
        taut[self._cords] = self._stops.force()[self._cord_stops] != 0.0
        slopes = self._paths.gather(rows, np.arange(nv), np.sqrt(body.ligament_stiffness * taut))
        return slopes[velocities] @ slopes.T

    def muscle_torque(self, tension) -> np.ndarray:
        """Torques (nv,) N m of tensions (n,) N of the muscles in the present posture."""
        return -self._paths.pull(0, tension)

    def torque_matrix(self, chosen, place, tension) -> np.ndarray:
        """Torques (d, k) N m of the muscles ``chosen`` (k,), each with its ``tension`` (k,) N, on some velocities.

        ``place`` (nv,) gives a velocity's row, negative for those that are left out.
        """
        return self._paths.gather(chosen, place, -np.asarray(tension, float))

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
        stretch = (self._paths.length[body.muscle_count :] - body.ligament_slack[:, 1])[self._struts]
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
        self._inertia[:] = 0.0
        self.refresh()

    def _assemble(self, activation) -> None:
        """Lower triangle and force of the step's system without the stops."""
        activation = np.ascontiguousarray(activation, float)
        if activation.shape != (self.body.muscle_count,):
            raise UserError(f"{self.body.name} takes {self.body.muscle_count} activations, got {activation.shape}")
        np.add(self._pushed, self._inertia, out=self._applied)
        assemble(activation, *self._terms)

    def _solve(self) -> np.ndarray:
        """Velocity change (nv,) of the step, the pushing stops and Coriolis forces settled with it."""
        system, h, velocity = self._system, self.step_seconds, self._start_velocity
        np.copyto(velocity, self._velocity)
        self._stops.guess()
        info, bias, corrections = self._factorize(), self.data.qfrc_bias, BIAS_CORRECTIONS
        try:
            for remaining in reversed(range(CORRECTIONS)):
                change = system.solve(h, bias)
                for _ in range(corrections):
                    bias = self._bias_at(velocity + change)
                    change = system.solve(h, bias)
                if info or not math.isfinite(change @ change):
                    raise UserError(self._complaint(info))
                if not self._correct(velocity + change) or not remaining:
                    return change
                info, corrections = self._amend(), 1  # the next round begins with this one's Coriolis forces
        finally:
            np.copyto(self._velocity, velocity)

    def _factorize(self) -> int:
        """Factor the system with the stops that push; LAPACK's ``info``."""
        system = self._system
        system.begin()
        self._stops.add(system.factor, system.right)
        if self._touch:
            self._touch.add(system.factor, system.right, self.step_seconds, *self._contact_load)
        return system.factorize()

    def _amend(self) -> int:
        """Put changes of the stops into the factored system; LAPACK's ``info``."""
        count = self._stops.list_changes(self._system.changes, 0)
        if self._touch:
            count = self._touch.list_changes(self._system.changes, count, self.step_seconds, *self._contact_load)
        if count > FEW * self.model.nv:
            return self._factorize()
        self._system.amend(count)
        return 0

    def _bias_at(self, velocity) -> np.ndarray:
        """Gravity and Coriolis forces (nv,) at a velocity (nv,) in the present posture; ``qvel`` is overwritten."""
        np.copyto(self._velocity, velocity)
        mujoco.mj_comVel(self.model, self.data)
        mujoco.mj_rne(self.model, self.data, 0, self._bias)
        return self._bias

    def _correct(self, velocity) -> bool:
        """Compare stops and friction with the step's end velocity (nv,); True when they must be settled anew."""
        switched = self._stops.correct(velocity)
        if self._touch:
            switched |= self._touch.correct(velocity, self._contact_load[1])
        return switched

    def _complaint(self, info: int) -> str:
        """What to tell when a step has no finite solution."""
        broken = ~np.isfinite(self._system.right)
        first = int(np.argmax(broken)) if broken.any() else max(info - 1, 0)
        return f"simulation is not finite at {self.time:.3f} s, first at {self.body.velocity_names[first]}"

    def _advance(self, change) -> None:
        data = self.data
        self._velocity += change
        mujoco.mj_integratePos(self.model, data.qpos, self._velocity, self.step_seconds)
        data.time += self.step_seconds
