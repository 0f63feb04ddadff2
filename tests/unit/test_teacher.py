"""The teacher's parts: accelerations, inverse dynamics, the reflex, and the labels."""

import mujoco
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from anthro.body.simulator import LIMIT_STIFFNESS, Simulator
from anthro.errors import UserError
from anthro.motor import reflex
from anthro.motor.dynamics import effort_problem, pose_acceleration, required_torque
from anthro.motor.effort import minimal_effort
from anthro.motor.rollouts import random_pose
from anthro.motor.teacher import STATIC_DRIVE_RANGE, Gains, StaticPosture, Teacher, TeacherPolicy

STEP = 0.005


# -- accelerations and inverse dynamics (Eq. 7) -----------------------------------------------------


def test_pd_acceleration_by_hand():
    """h = gamma = 0.1: k_p = 2 * 0.9 / 0.01 = 180, k_d = 20; 180 * 0.1 - 20 * 0.5 = 8."""
    found = pose_acceleration(np.array([0.2, 0.0]), np.array([0.5, 0.0]), np.array([0.3, 0.0]))
    np.testing.assert_allclose(found, [8.0, 0.0])
    moving = pose_acceleration(0.0, 0.0, 0.0, goal_velocity=1.0)
    assert moving == pytest.approx(20.0)
    assert pose_acceleration(0.0, 0.0, 1.0, step=0.2, reduction=0.5) == pytest.approx(25.0)


@pytest.mark.parametrize("seed", range(3))
def test_required_torque_is_mujocos_inverse_dynamics(arm, seed):
    rng = np.random.default_rng(seed)
    simulator, data = arm.simulator(), mujoco.MjData(arm.model)
    q, v, acceleration = random_pose(arm, 0.9, rng), rng.normal(0.0, 2.0, 7), rng.normal(0.0, 20.0, 7)
    simulator.reset(q, v)
    data.qpos[:], data.qvel[:], data.qacc[:] = q, v, acceleration
    mujoco.mj_inverse(arm.model, data)
    np.testing.assert_allclose(required_torque(simulator, acceleration), data.qfrc_inverse, rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize("seed", range(3))
def test_inverse_dynamics_inverts_forward_dynamics(arm, seed):
    """Activations that solve A a = b give the wanted acceleration in a step of 0.1 us."""
    rng = np.random.default_rng(seed)
    simulator = Simulator(arm, 1e-7)
    velocity = rng.normal(0.0, 0.5, 7)
    simulator.reset(random_pose(arm, 0.5, rng), velocity)
    wanted = rng.normal(0.0, 1.0, 7)
    matrix, torque = effort_problem(simulator, wanted)
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


def test_the_muscle_problem_is_the_muscles_torque(arm):
    """A a plus the passive torque is what the tensions make."""
    rng = np.random.default_rng(3)
    simulator = arm.simulator()
    simulator.reset(random_pose(arm, 0.7, rng), rng.normal(0.0, 1.0, 7))
    activation, wanted = rng.random(29), rng.normal(size=7)
    matrix, torque = effort_problem(simulator, wanted)
    tension = simulator.muscle_force(activation)
    passive = required_torque(simulator, wanted) - torque
    np.testing.assert_allclose(matrix @ activation + passive, -simulator.jacobian.T @ tension, atol=1e-9)


# -- the reflex (Eq. 4, 5) and the drive (Eq. 1) ----------------------------------------------------


def test_reflex_gains_are_the_papers():
    assert (reflex.STRAIN_GAIN, reflex.STRAIN_RATE_GAIN, reflex.SATURATION) == (8.0, 0.05, 2.0)


@pytest.mark.parametrize(
    ("change", "rate_change", "expected"),
    [
        (0.01, 0.0, 0.08),
        (0.01, 1.0, 0.13),
        (0.01, 5.0, 0.18),  # saturated at 2 / s
        (0.0, -5.0, -0.1),
        (-0.02, 1.0, -0.11),
    ],
)
def test_reflex_by_hand(change, rate_change, expected):
    assert reflex.reflex_adjustment(np.array([change]), np.array([rate_change]))[0] == pytest.approx(expected)


@settings(max_examples=50, deadline=None)
@given(seed=st.integers(0, 2**32 - 1))
def test_accumulated_reflex_is_strain_beyond_a_threshold(seed):
    """The sum over any way of strains telescopes: k_p (e - e_0) + k_d (e' - e'_0)."""
    rng = np.random.default_rng(seed)
    strain = rng.uniform(-0.2, 0.2, (60, 29))
    rate = rng.uniform(-0.9, 0.9, (60, 29))  # changes stay under the saturation
    drive = np.full(29, 0.3)
    for change, rate_change in zip(np.diff(strain, axis=0), np.diff(rate, axis=0), strict=True):
        drive = reflex.accumulate(drive, 0.0, reflex.reflex_adjustment(change, rate_change))
    threshold = strain[0] - 0.3 / 8.0
    np.testing.assert_allclose(drive, 8.0 * (strain[-1] - threshold) + 0.05 * (rate[-1] - rate[0]), atol=1e-9)


def test_drive_is_kept_beyond_silence_and_muscles_see_it_clipped():
    drive = reflex.accumulate(np.array([0.0, 0.5, 0.0]), np.array([-0.3, 0.2, 9.0]), np.array([-0.1, 0.6, 0.0]))
    np.testing.assert_allclose(drive, [-0.4, 1.3, reflex.DRIVE_RANGE[1]])
    np.testing.assert_allclose(reflex.activation(drive), [0.0, 1.0, 1.0])


def test_a_stretched_muscle_contracts(arm):
    """Straightening the elbow stretches its flexors, whose reflex pulls it back; the extensors let go."""
    simulator = arm.simulator()
    before = simulator.strain
    q = arm.q_rest.copy()
    q[3] -= 0.2
    simulator.reset(q)
    adjustment = reflex.reflex_adjustment(simulator.strain - before, np.zeros(29))
    index = {name: i for i, name in enumerate(arm.muscle_names)}
    for flexor in ("BIClong_r", "BICshort_r", "BRA_r", "BRD_r"):
        assert adjustment[index[flexor]] > 0.02
    for extensor in ("TRIlong_r", "TRIlat_r", "TRImed_r", "ANC_r"):
        assert adjustment[index[extensor]] < -0.02
    torque = -simulator.jacobian.T @ simulator.muscle_force(np.clip(0.2 + adjustment, 0.0, 1.0))
    relaxed = -simulator.jacobian.T @ simulator.muscle_force(np.full(29, 0.2))
    assert torque[3] > relaxed[3] + 1.0


# -- labels -----------------------------------------------------------------------------------------


@pytest.fixture
def teacher(arm):
    return Teacher(arm, STEP)


def targets(arm, teacher, count, seed):
    rng = np.random.default_rng(seed)
    return [teacher.kinematics.hand(random_pose(arm, 0.7, rng)) for _ in range(count)]


def test_holding_state_balances_gravity(arm):
    statics = StaticPosture(arm, Gains())
    for q in (arm.q_rest, arm.q_rest + 0.1):
        drive, strain, residual = statics.drive(q)
        matrix, torque = statics.problem(q)
        unmet = matrix @ np.clip(drive, 0.0, 1.0) - torque
        assert residual < 0.1 and np.abs(unmet).max() < 0.1  # N m
        assert (drive >= STATIC_DRIVE_RANGE[0]).all() and (drive <= STATIC_DRIVE_RANGE[1]).all()
        assert strain.shape == drive.shape == (29,)


def test_a_held_target_needs_no_adjustment(arm, teacher):
    simulator = arm.simulator()
    for target in targets(arm, teacher, 5, seed=2):
        pose = teacher.aim(target)
        simulator.reset(pose.q)
        label = teacher.voluntary(simulator, teacher.holding_state(pose.q)[0])
        assert np.abs(label).max() < 1e-6


def test_the_label_draws_the_drive_to_the_holding_drive(arm, teacher):
    """leak_rate 8 / s times 5 ms: 4 % of what is missing a step."""
    simulator = arm.simulator()
    pose = teacher.aim(targets(arm, teacher, 1, seed=2)[0])
    simulator.reset(pose.q)
    missing = np.linspace(-0.5, 0.5, 29)
    label = teacher.voluntary(simulator, teacher.holding_state(pose.q)[0] - missing)
    np.testing.assert_allclose(label, 0.04 * missing, atol=1e-6)


def test_the_label_is_bounded_and_of_pose_target_and_drive_alone(arm):
    """Neither velocity nor what was asked before changes it, so that a network can learn it."""
    simulator, rng = arm.simulator(), np.random.default_rng(4)
    teacher, fresh = Teacher(arm, STEP), Teacher(arm, STEP)
    for target in targets(arm, teacher, 6, seed=5):
        q, drive = random_pose(arm, 0.7, rng), rng.uniform(-1.0, 1.0, 29)
        teacher.aim(target)
        simulator.reset(q, rng.normal(0.0, 1.0, 7))
        label = teacher.voluntary(simulator, drive)
        assert np.abs(label).max() <= Gains().max_adjustment
        fresh.aim(target)
        simulator.reset(q)
        np.testing.assert_allclose(fresh.voluntary(simulator, drive), label, atol=1e-6)


def test_appendix_b_labels_by_hand(arm):
    """a_d - a: the label plus the activation gives the accelerations of Eq. 7 back."""
    teacher = Teacher(arm, STEP, rule="appendix_b")
    simulator = arm.simulator()
    near = arm.q_rest + 0.01
    pose = teacher.aim(teacher.kinematics.hand(near))
    drive = np.linspace(-0.5, 1.5, 29)
    wished = teacher.voluntary(simulator, drive) + np.clip(drive, 0.0, 1.0)
    assert (wished >= 0.0).all() and (wished <= 1.0).all()
    wanted = 180.0 * (pose.q - simulator.qpos) - 20.0 * simulator.qvel
    matrix, torque = effort_problem(simulator, wanted)
    np.testing.assert_allclose(matrix @ wished, torque, atol=0.1)  # N m


def test_unknown_rule_is_refused(arm):
    with pytest.raises(UserError, match="unknown label rule 'guess': known are equilibrium, appendix_b"):
        Teacher(arm, STEP, rule="guess")


def test_a_target_that_is_no_point_is_refused(arm, teacher):
    policy = TeacherPolicy(teacher)
    simulator = arm.simulator()
    policy.reset(simulator)
    with pytest.raises(UserError, match="three finite numbers"):
        policy.activation(simulator, np.array([np.nan, 0.0, 1.0]))


def test_aiming_happens_once_a_target(arm, teacher, monkeypatch):
    solved = []
    solve = teacher.kinematics.solve
    monkeypatch.setattr(teacher.kinematics, "solve", lambda target: solved.append(1) or solve(target))
    policy, simulator = TeacherPolicy(teacher), arm.simulator()
    policy.reset(simulator)
    for target in targets(arm, teacher, 2, seed=7):
        for _ in range(5):
            simulator.step(policy.activation(simulator, target))
    assert len(solved) == 2
