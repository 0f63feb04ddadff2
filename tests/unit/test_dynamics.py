"""Inverse dynamics and the muscle problem: against MuJoCo, against energies, and joints that yield."""

import mujoco
import numpy as np
import pytest

from anthro.body import hill
from anthro.body.simulator import LIMIT_STIFFNESS, Simulator
from anthro.motor.dynamics import (
    Yielding,
    effort_problem,
    pose_acceleration,
    required_torque,
    torque_problem,
)
from anthro.motor.effort import minimal_effort
from anthro.motor.teacher import Gains, StaticPosture

STEP = 1e-5  # rad, of finite differences
QUADRICEPS = ("recfem_r", "vasint_r", "vaslat_r", "vasmed_r")


def test_pd_acceleration_by_hand():
    """h = gamma = 0.1: k_p = 2 * 0.9 / 0.01 = 180, k_d = 20; 180 * 0.1 - 20 * 0.5 = 8 (Eq. 7)."""
    found = pose_acceleration(np.array([0.2, 0.0]), np.array([0.5, 0.0]), np.array([0.3, 0.0]))
    np.testing.assert_allclose(found, [8.0, 0.0])
    moving = pose_acceleration(0.0, 0.0, 0.0, goal_velocity=1.0)
    assert moving == pytest.approx(20.0)
    assert pose_acceleration(0.0, 0.0, 1.0, step=0.2, reduction=0.5) == pytest.approx(25.0)


@pytest.mark.parametrize("name", ["right_arm", "left_leg", "neck_seated"])
@pytest.mark.parametrize("seed", range(2))
def test_required_torque_is_mujocos_inverse_dynamics(limb, name, seed):
    """Ligaments are tendon springs there; at rest, for MuJoCo damps cords at any length."""
    its, rng = limb(name), np.random.default_rng(seed)
    simulator, data = its.body.simulator(), mujoco.MjData(its.body.model)
    q = its.with_angles(its.body.q_rest, its.random_pose(0.9, rng))
    v = rng.normal(0.0, 2.0, len(q)) * (its.body.ligament_count == 0)
    acceleration = rng.normal(0.0, 20.0, len(q))
    simulator.reset(q, v)
    data.qpos[:], data.qvel[:], data.qacc[:] = q, v, acceleration
    mujoco.mj_inverse(its.body.model, data)
    wanted = data.qfrc_inverse
    np.testing.assert_allclose(required_torque(simulator, acceleration), wanted, rtol=1e-8, atol=1e-7)
    still = required_torque(simulator, None)
    np.testing.assert_allclose(still, required_torque(simulator, np.zeros(len(q))), atol=1e-12)


@pytest.mark.parametrize("name", ["right_leg", "neck_seated", "core"])
def test_static_torque_is_the_slope_of_all_energy(limb, name):
    """Gravity, ligaments, joint springs and fibers' parallel elements, on driven and passive joints."""
    its, rng = limb(name), np.random.default_rng(1)
    simulator = its.body.simulator()
    q = its.with_angles(its.body.q_rest, its.random_pose(0.6, rng))
    q = StaticPosture(its, Gains()).place(q)
    simulator.reset(q)
    matrix, torque = torque_problem(simulator, its)
    joints = np.concatenate([its.driven, its.passive])
    assert matrix.shape == (len(joints), its.size) and torque.shape == (len(joints),)
    some = rng.permutation(len(joints))[:12]
    for row in some:
        energies = []
        for sign in (-1.0, 1.0):
            moved = q.copy()
            moved[joints[row]] += sign * STEP
            simulator.reset(moved)
            energies.append(simulator.energy())
        slope = (energies[1] - energies[0]) / (2.0 * STEP)
        np.testing.assert_allclose(torque[row], slope, rtol=1e-3, atol=2e-2)


@pytest.mark.parametrize("seed", range(3))
def test_inverse_dynamics_inverts_forward_dynamics(limb, seed):
    """Activations that solve A a = b give the wanted acceleration in a step of 0.1 us."""
    its, rng = limb("right_arm"), np.random.default_rng(seed)
    simulator = Simulator(its.body, 1e-7)
    velocity = rng.normal(0.0, 0.5, 7)
    simulator.reset(its.random_pose(0.5, rng), velocity)
    wanted = rng.normal(0.0, 1.0, 7)
    matrix, torque = effort_problem(simulator, its, acceleration=wanted)
    found = minimal_effort(matrix, torque, 0.05)
    assert found.residual < 1e-4
    simulator.step(found.activation)
    np.testing.assert_allclose((simulator.qvel - velocity) / 1e-7, wanted, atol=0.05)


def test_inverse_dynamics_sees_the_limit_springs(arm):
    simulator = arm.simulator()
    q = arm.q_rest.copy()
    q[3] = arm.q_range[3, 1] + 0.1
    simulator.reset(q)
    beyond = required_torque(simulator, np.zeros(7))
    gravity = simulator.data.qfrc_bias
    np.testing.assert_allclose(beyond - gravity, [0, 0, 0, 0.1 * LIMIT_STIFFNESS, 0, 0, 0], atol=1e-9)


@pytest.mark.parametrize(("name", "body"), [("right_arm", None), ("neck_seated", "nakada2018"), ("core", None)])
def test_the_muscle_problem_is_the_muscles_torque(limb, name, body):
    """A a plus what b leaves out is the torque of all tensions; muscles of others pull with their activations."""
    its, rng = limb(name, body), np.random.default_rng(3)
    simulator, nv = its.body.simulator(), its.body.model.nv
    q = its.with_angles(its.body.q_rest, its.random_pose(0.5, rng))
    simulator.reset(q, rng.normal(0.0, 0.3, nv))
    activation, wanted = rng.random(its.body.muscle_count), rng.normal(size=nv)
    joints = np.concatenate([its.columns, its.passive_columns])
    tension = simulator.muscle_force(activation)
    matrix, torque = torque_problem(simulator, its, activation, wanted)
    made = matrix @ activation[its.muscles] + (required_torque(simulator, wanted)[joints] - torque)
    np.testing.assert_allclose(made, (-simulator.jacobian.T @ tension)[joints], rtol=1e-9, atol=1e-8)


def test_the_own_activations_among_those_of_others_do_not_count(limb):
    its, rng = limb("right_leg", "nakada2018"), np.random.default_rng(0)
    simulator = its.body.simulator()
    others = rng.random(352)
    changed = its.into(others.copy(), rng.random(39))
    for first, second in zip(
        torque_problem(simulator, its, others), torque_problem(simulator, its, changed), strict=True
    ):
        np.testing.assert_array_equal(first, second)
    alone = torque_problem(simulator, its)[1]
    np.testing.assert_array_equal(alone, torque_problem(simulator, its, its.into(np.zeros(352), others[:39]))[1])


def test_active_forces_of_others_are_subtracted(limb):
    """An arm's pull on the shoulder girdle is the core's to bear, with the lever of its path there."""
    its = limb("core")
    simulator, other = its.body.simulator(), its.body.muscle_names.index("DELT1_r")
    others = np.zeros(823)
    others[other] = 0.5
    joints = np.concatenate([its.columns, its.passive_columns])
    strength = hill.active_force(simulator.strain, simulator.strain_rate, its.body.max_force)[other]
    change = torque_problem(simulator, its)[1] - torque_problem(simulator, its, others)[1]
    np.testing.assert_allclose(change, -0.5 * strength * simulator.jacobian[other, joints], atol=1e-9)
    assert np.abs(change).max() > 0.1


def ligament_gradient(body, simulator):
    """Torques (m,) N m of ligaments and joint springs, by the tables."""
    torque = simulator.ligament_torque()[-body.dof_count :]
    return torque - body.joint_stiffness * simulator.joint_angles


def slack_energy(body, simulator):
    """Energy of ligaments and joint springs, J."""
    low, high = body.ligament_slack.T
    length = simulator.data.ten_length[body.muscle_count :]
    stretched = 0.5 * body.ligament_stiffness @ np.square(length - np.clip(length, low, high))
    return stretched + 0.5 * body.joint_stiffness @ np.square(simulator.joint_angles)


@pytest.mark.parametrize(("name", "most"), [("right_leg", 2.0), ("core", 4.0)])
def test_passive_joints_come_to_rest_within_their_ranges(limb, name, most):
    """Where a joint stands within its range, hardly anything turns it; at an end, it is turned against the end.

    A patellar ligament of 300 N m/rad turns the patella by 1.2 N m for the 4 mrad that count as settled.
    """
    its, rng = limb(name), np.random.default_rng(2)
    statics, simulator = StaticPosture(its, Gains()), its.body.simulator()
    low, high = its.body.q_range[its.passive].T
    for _ in range(3):
        start = its.with_angles(its.body.q_rest, its.random_pose(0.6, rng))
        q = statics.place(start.copy())
        np.testing.assert_array_equal(np.delete(q, its.passive), np.delete(start, its.passive))
        simulator.reset(q)
        angle, torque = q[its.passive], ligament_gradient(its.body, simulator)[its.passive]
        assert (angle >= low).all() and (angle <= high).all()
        outward = np.where(angle >= high, 1.0, 0.0) - np.where(angle <= low, 1.0, 0.0)
        assert np.abs(torque[outward == 0.0]).max() < most  # N m
        assert (torque * outward >= -most).all()
        energy = slack_energy(its.body, simulator)
        for _ in range(20):
            away = np.clip(angle + 0.03 * rng.normal(size=len(angle)), low, high)
            q[its.passive] = away
            simulator.reset(q)
            assert slack_energy(its.body, simulator) > energy - 5e-3


@pytest.mark.parametrize("name", ["right_leg", "core"])
def test_what_was_settled_before_hardly_changes_the_holding_drive(limb, name):
    """A label is learnable if the same pose has the same drive; ropes that tauten must not throw ribs to and fro."""
    its, rng = limb(name), np.random.default_rng(0)
    used, gaps = StaticPosture(its, Gains()), []
    for _ in range(8):
        q = its.with_angles(its.body.q_rest, its.random_pose(0.4, rng))
        gaps.append(np.abs(used.drive(q)[0] - StaticPosture(its, Gains()).drive(q)[0]).max())
    assert np.median(gaps) < 0.1 and max(gaps) < 1.0


def test_resting_and_following_agree(limb):
    """A joint that follows goes to where it would come to rest."""
    its = limb("right_leg")
    statics, simulator = StaticPosture(its, Gains()), its.body.simulator()
    change = np.zeros(7)
    change[[its.body.dof_names[i] for i in its.driven].index("knee_flexion_r")] = 0.01
    for knee in (0.5, 1.0, 1.5):
        q = its.body.q_rest.copy()
        q[its.body.dof_names.index("knee_flexion_r")] = knee
        q = statics.place(q)
        simulator.reset(q)
        followed = q[its.passive] + Yielding(simulator, its).following(change)
        beyond = statics.place(its.with_angles(q, q[its.driven] + change))
        np.testing.assert_allclose(followed, beyond[its.passive], atol=1e-3)
        assert abs(beyond[its.passive] - q[its.passive])[0] > 2e-3


def test_the_quadriceps_reaches_the_knee_through_the_patella(limb):
    """The condensed lever of each head is the slope of its length along the knee, the patella settled each time."""
    its = limb("right_leg")
    body, statics, simulator = its.body, StaticPosture(its, Gains()), its.body.simulator()
    names = [body.dof_names[i] for i in its.driven]
    knee, rows = names.index("knee_flexion_r"), [body.muscle_names.index(name) for name in QUADRICEPS]
    for angle in np.deg2rad([30.0, 60.0, 90.0]):
        angles, lengths = body.q_rest[its.driven].copy(), []
        for way in (-0.02, 0.02):
            angles[knee] = angle + way
            simulator.reset(statics.place(its.with_angles(body.q_rest, angles)))
            lengths.append(simulator.data.ten_length[rows].copy())
        slope = (lengths[1] - lengths[0]) / 0.04
        angles[knee] = angle
        simulator.reset(statics.place(its.with_angles(body.q_rest, angles)))
        matrix, _ = effort_problem(simulator, its)
        strength = hill.active_force(simulator.strain, simulator.strain_rate, body.max_force)[rows]
        np.testing.assert_allclose(matrix[knee, rows] / strength, -slope, rtol=0.03, atol=5e-4)
        straight, _ = torque_problem(simulator, its)
        assert (matrix[knee, rows] < 0.0).all()  # it extends the knee
        assert (straight[-1, rows] != 0.0).all()  # and pulls at the patella


def test_ribs_are_held_and_patellae_are_not(limb):
    core, leg = limb("core"), limb("right_leg")
    for its, rows in ((core, 63 + 49), (leg, 7)):
        matrix, torque = effort_problem(its.body.simulator(), its)
        assert matrix.shape == (rows, its.size) and torque.shape == (rows,)
