"""Forward dynamics: order of convergence, energy, limits, and MuJoCo's own accelerations."""

import time
from dataclasses import replace

import mujoco
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from anthro.body import hill
from anthro.body.postures import PostureSampler
from anthro.body.simulator import LIMIT_DAMPING, LIMIT_STIFFNESS, Simulator, limit_torque
from anthro.errors import UserError

OFF = np.zeros(29)


def random_pose(arm, rng, share=1.0):
    low, high = arm.q_range.T
    return 0.5 * (low + high) + 0.5 * share * (high - low) * rng.uniform(-1.0, 1.0, 7)


def slack_arm(arm):
    """The same bones with tendons so long that no fiber is ever stretched."""
    return replace(arm, tendon_length=arm.tendon_length + 0.5)


def rollout(arm, step, seconds, activation):
    simulator = arm.simulator(step)
    for _ in range(round(seconds / step)):
        simulator.step(activation)
    return simulator.qpos.copy()


@pytest.mark.parametrize("seconds", [0.21, 0.49])
def test_first_order_convergence(arm, seconds):
    """Errors at 7, 3.5 and 1.75 ms against 0.1 ms halve with the step."""
    activation = 0.15 * np.random.default_rng(3).random(29)
    reference = rollout(arm, 1e-4, seconds, activation)
    steps = (7e-3, 3.5e-3, 1.75e-3)
    error = [np.linalg.norm(rollout(arm, step, seconds, activation) - reference) for step in steps]
    assert error[0] < 0.02  # rad, over all joints
    assert 1.6 < error[0] / error[1] < 2.6 and 1.6 < error[1] / error[2] < 2.6


def energy_growth(simulator, steps):
    """The most that energy rose above what it had been before, J."""
    lowest, growth = simulator.energy(), 0.0
    for _ in range(steps):
        simulator.step(OFF)
        energy = simulator.energy()
        growth, lowest = max(growth, energy - lowest), min(lowest, energy)
    return float(growth)


@settings(max_examples=8, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), speed=st.sampled_from([0.0, 2.0]), step=st.sampled_from([0.005, 0.007]))
def test_energy_never_grows_with_muscles_off(arm, seed, speed, step):
    """Tolerance 1e-6 J of about 45; poses in the middle 80 %, where no path jumps."""
    rng = np.random.default_rng(seed)
    simulator = arm.simulator(step)
    simulator.reset(random_pose(arm, rng, 0.8), rng.normal(0.0, speed, 7))
    assert energy_growth(simulator, 200) < 1e-6


def test_energy_never_grows_from_beyond_the_limits(arm):
    rng = np.random.default_rng(4)
    for _ in range(4):
        simulator = arm.simulator()
        simulator.reset(random_pose(arm, rng, 0.8), rng.normal(0.0, 2.0, 7))
        joint = rng.integers(1, 7)
        simulator.qpos[joint] = arm.q_range[joint, 1] + 0.15
        simulator.refresh()
        assert energy_growth(simulator, 200) < 1e-6


@pytest.mark.parametrize("step", [0.005, 0.007])
@pytest.mark.parametrize("joint", range(7))
@pytest.mark.parametrize("side", [0, 1])
def test_a_joint_that_runs_into_its_limit_gains_no_energy(arm, step, joint, side):
    """From 10 mrad within the limit at 5 rad/s towards it, so that the first step already enters."""
    simulator = arm.simulator(step)
    pose, velocity, outward = arm.q_rest.copy(), np.zeros(7), 2.0 * side - 1.0
    pose[joint] = arm.q_range[joint, side] - 0.01 * outward
    velocity[joint] = 5.0 * outward
    simulator.reset(pose, velocity)
    assert energy_growth(simulator, 40) < 1e-6


def test_energy_never_grows_near_where_the_deltoid_slips_over_its_wrap(arm):
    growth = 0.0
    for seed in range(12):
        rng = np.random.default_rng(seed)
        simulator = arm.simulator()
        raised = np.deg2rad([rng.uniform(75, 90), rng.uniform(55, 75), rng.uniform(-45, -25), 20, 0, 0, 0])
        simulator.reset(raised, np.r_[rng.normal(0.0, 1.0, 3), np.zeros(4)])
        growth = max(growth, energy_growth(simulator, 60))
    assert growth < 1e-6


def limit_excess(arm, seed, draw):
    """The furthest that a joint went over its limit in 5 s, degrees; activations change every 0.1 s."""
    rng, simulator, worst = np.random.default_rng(seed), arm.simulator(), 0.0
    low, high = arm.q_range.T
    for k in range(1000):
        if k % 20 == 0:
            activation = draw(rng)
        simulator.step(activation)
        worst = max(worst, np.maximum(simulator.qpos - high, low - simulator.qpos).max())
    return np.rad2deg(worst)


@pytest.mark.parametrize("seed", range(3))
def test_limit_springs_hold_random_activations(arm, seed):
    assert limit_excess(arm, seed, lambda rng: rng.random(29)) < 10.0


def test_limit_springs_hold_full_activations(arm):
    assert limit_excess(arm, 1, lambda rng: np.round(rng.random(29))) < 10.0


def test_limits_push_back_and_never_pull():
    low, high = np.full(4, -1.0), np.full(4, 1.0)
    q = np.array([0.0, 1.1, -1.1, 1.1])
    torque = limit_torque(q, np.array([5.0, 0.0, 0.0, -50.0]), low, high)
    np.testing.assert_allclose(torque, [0.0, -0.1 * LIMIT_STIFFNESS, 0.1 * LIMIT_STIFFNESS, 0.0])
    moving = limit_torque(q, np.full(4, 1.0), low, high)
    assert moving[1] == pytest.approx(-0.1 * LIMIT_STIFFNESS - LIMIT_DAMPING)


@pytest.mark.filterwarnings("ignore:invalid value encountered")
@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_activations_that_are_no_numbers_are_refused(arm, bad):
    simulator = arm.simulator()
    activation = np.full(29, 0.1)
    activation[5] = bad
    before = simulator.qpos.copy()
    with pytest.raises(UserError, match=r"not finite at 0\.000 s, first at "):
        simulator.step(activation)
    np.testing.assert_array_equal(simulator.qpos, before)


@pytest.mark.parametrize("wrong", [np.zeros(28), np.zeros(30), np.zeros((29, 1)), 0.1])
def test_activations_that_do_not_fit_are_refused(arm, wrong):
    with pytest.raises(UserError, match="takes 29 activations"):
        arm.simulator().step(wrong)


def test_a_velocity_that_is_no_number_names_the_joint_and_keeps_the_state(arm):
    simulator = arm.simulator()
    for _ in range(3):
        simulator.step(OFF)
    simulator.qvel[6] = np.nan
    before = simulator.qpos.copy()
    with pytest.raises(UserError, match=r"not finite at 0\.015 s, first at"):
        simulator.step(OFF)
    np.testing.assert_array_equal(simulator.qpos, before)


@pytest.mark.parametrize("seed", range(5))
def test_jacobian_is_the_path_lengths_slope(arm, seed):
    pose = random_pose(arm, np.random.default_rng(seed), 0.7)
    simulator = arm.simulator()
    simulator.reset(pose)
    step = 1e-6
    for joint in range(7):
        postures = np.tile(pose, (2, 1))
        postures[:, joint] += (-step, step)
        low, high = map(PostureSampler(arm.model).lengths, postures)
        np.testing.assert_allclose(simulator.jacobian[:, joint], (high - low) / (2.0 * step), atol=2e-6)


def test_moment_arms_are_the_negative_slopes_and_hinges_are_views(arm):
    """Their sign is that of a torque; angles and velocities of the hinges are views."""
    simulator = arm.simulator()
    np.testing.assert_array_equal(simulator.moment_arms(), -simulator.jacobian)
    assert simulator.joint_angles.shape == simulator.joint_velocities.shape == (7,)
    assert np.shares_memory(simulator.joint_angles, simulator.qpos)
    assert np.shares_memory(simulator.joint_velocities, simulator.qvel)


@pytest.mark.parametrize("seed", range(3))
def test_torques_of_muscles_are_the_jacobians_products(arm, seed):
    """Each muscle alone, some of them, all; rows in any order, some left out."""
    rng, simulator = np.random.default_rng(seed), arm.simulator()
    simulator.reset(random_pose(arm, rng, 0.7), rng.normal(size=7))
    path, tension = simulator.jacobian, rng.uniform(0.0, 500.0, 29)
    np.testing.assert_allclose(simulator.muscle_torque(tension), -path.T @ tension, atol=1e-12)
    chosen = rng.permutation(29)[:11]
    place = np.array([2, -1, 0, -1, 3, 1, -1])
    matrix = simulator.torque_matrix(chosen, place, tension[chosen])
    wanted = -(path[chosen] * tension[chosen, None]).T[[2, 5, 0, 4]]
    assert matrix.shape == (4, 11)
    np.testing.assert_allclose(matrix, wanted, atol=1e-12)


def test_a_push_at_an_effector_is_the_force_times_its_way(arm):
    """Virtual work: applied torque along a joint is F . dp/dq, by finite differences."""
    rng, simulator, small = np.random.default_rng(1), arm.simulator(), 1e-6
    pose, force = random_pose(arm, rng, 0.7), np.array([3.0, -4.0, 12.0])
    slopes = []
    for joint in range(7):
        ends = []
        for sign in (-1.0, 1.0):
            moved = pose.copy()
            moved[joint] += sign * small
            simulator.reset(moved)
            ends.append(simulator.effector_position("finger_r"))
        slopes.append((ends[1] - ends[0]) / (2.0 * small))
    simulator.reset(pose)
    simulator.push(force, "finger_r")
    np.testing.assert_allclose(simulator._pushed, np.array(slopes) @ force, atol=1e-6)


@pytest.mark.parametrize("seed", range(5))
def test_strain_rate_is_the_strains_slope(arm, seed):
    rng = np.random.default_rng(seed)
    simulator = arm.simulator()
    pose, velocity, step = random_pose(arm, rng, 0.7), rng.normal(0.0, 1.0, 7), 1e-6
    strains = []
    for sign in (-1.0, 1.0):
        simulator.reset(pose + sign * step * velocity)
        strains.append(simulator.strain)
    simulator.reset(pose, velocity)
    np.testing.assert_allclose(simulator.strain_rate, (strains[1] - strains[0]) / (2.0 * step), atol=1e-4)


@pytest.mark.parametrize("seed", range(5))
def test_acceleration_without_muscles_is_mujocos(arm, seed):
    """A step of 1 us with slack fibers against qacc of mj_forward, joint damping included."""
    rng = np.random.default_rng(seed)
    simulator = Simulator(slack_arm(arm), 1e-6)
    velocity = rng.normal(0.0, 3.0, 7)
    simulator.reset(random_pose(arm, rng, 0.9), velocity)
    assert not hill.force(OFF, simulator.strain, simulator.strain_rate, arm.max_force).any()
    data = mujoco.MjData(arm.model)
    data.qpos[:], data.qvel[:] = simulator.qpos, velocity
    mujoco.mj_forward(arm.model, data)
    simulator.step(OFF)
    acceleration = (simulator.qvel - velocity) / 1e-6
    np.testing.assert_allclose(acceleration, data.qacc, rtol=1e-3, atol=1e-3 * np.abs(data.qacc).max())


@pytest.mark.parametrize("seed", range(3))
def test_acceleration_with_muscles_is_mujocos_under_the_same_torque(arm, seed):
    rng = np.random.default_rng(seed)
    simulator = Simulator(arm, 1e-7)
    activation = rng.random(29)
    simulator.reset(random_pose(arm, rng, 0.7))
    data = mujoco.MjData(arm.model)
    data.qpos[:] = simulator.qpos
    data.qfrc_applied[:] = -simulator.jacobian.T @ simulator.muscle_force(activation)
    mujoco.mj_forward(arm.model, data)
    simulator.step(activation)
    acceleration = simulator.qvel / 1e-7
    np.testing.assert_allclose(acceleration, data.qacc, rtol=1e-3, atol=1e-3 * np.abs(data.qacc).max())


@pytest.mark.parametrize("seed", range(4))
def test_a_step_is_equation_7_of_the_paper(arm, seed):
    """(M + h D + h^2 K) dv = h (f - h K v), slopes by finite differences, one joint beyond its limit.

    Coriolis forces are those of the end velocity, found from the start's in two rounds.
    """
    rng, h, small = np.random.default_rng(seed), 0.006, 1e-6
    simulator = arm.simulator(h)
    q, v, activation = random_pose(arm, rng, 0.7), rng.normal(0.0, 0.5, 7), rng.random(29)
    q[3], v[3] = arm.q_range[3, 1] + 0.05, 0.3
    simulator.reset(q, v)
    e, rate, path, strength = simulator.strain, simulator.strain_rate, simulator.jacobian.copy(), arm.max_force

    def tension(e, rate):
        return hill.force(activation, e, rate, strength)

    per_strain = (tension(e + small, rate) - tension(e - small, rate)) / (2.0 * small)
    per_rate = (tension(e, rate + small) - tension(e, rate - small)) / (2.0 * small)
    limit = np.diag([0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0])
    stiffness = path.T @ np.diag(per_strain / arm.slack_length) @ path + LIMIT_STIFFNESS * limit
    damping = path.T @ np.diag(per_rate / arm.slack_length) @ path + LIMIT_DAMPING * limit + np.diag(arm.joint_damping)
    spring = limit_torque(q, v, *arm.q_range.T)
    force = spring - path.T @ tension(e, rate) - arm.joint_damping * v
    system = simulator.mass + h * damping + h * h * stiffness
    data, bias, change = mujoco.MjData(arm.model), np.zeros(7), np.zeros(7)
    data.qpos[:] = q
    for _ in range(3):
        data.qvel[:] = v + change
        mujoco.mj_forward(arm.model, data)
        mujoco.mj_rne(arm.model, data, 0, bias)
        change = np.linalg.solve(system, h * (force - bias - h * stiffness @ v))
    simulator.step(activation)
    np.testing.assert_allclose(simulator.qvel - v, change, rtol=1e-5, atol=1e-6)
    np.testing.assert_allclose(simulator.qpos, q + h * simulator.qvel, atol=1e-12)


def test_a_push_accelerates_the_hand_along_it(arm):
    still, pushed = Simulator(slack_arm(arm), 1e-4), Simulator(slack_arm(arm), 1e-4)
    pushed.push((0.0, 0.0, 20.0), "hand_r")
    for simulator in (still, pushed):
        for _ in range(50):
            simulator.step(OFF)
    assert pushed.effector_position("hand_r")[2] > still.effector_position("hand_r")[2]
    pushed.push((0.0, 0.0, 0.0), "hand_r")
    pushed.reset(arm.q_rest)
    still.reset(arm.q_rest)
    still.step(OFF)
    pushed.step(OFF)
    np.testing.assert_array_equal(still.qpos, pushed.qpos)


def test_same_activations_same_bytes(arm):
    ends = []
    for _ in range(2):
        rng, simulator = np.random.default_rng(9), arm.simulator()
        for _ in range(200):
            simulator.step(rng.random(29))
        ends.append(simulator.qpos.tobytes() + simulator.qvel.tobytes() + simulator.strain.tobytes())
    assert ends[0] == ends[1]


def test_reset_forgets_everything(arm):
    fresh, used = arm.simulator(), arm.simulator()
    for _ in range(50):
        used.step(np.full(29, 0.3))
    used.reset(arm.q_rest)
    for simulator in (fresh, used):
        simulator.step(np.full(29, 0.1))
    assert fresh.qpos.tobytes() == used.qpos.tobytes() and fresh.time == used.time


def test_time_and_hand_are_reported(arm):
    simulator = arm.simulator(0.007)
    for _ in range(10):
        simulator.step(OFF)
    assert simulator.time == pytest.approx(0.07)
    place = simulator.effector_position("hand_r")
    place[:] = 0.0
    assert simulator.effector_position("hand_r").any()


def test_simulation_is_much_faster_than_real_time(arm):
    """The bar is 30 times on a core of its own; a busy one must still give ten in its best of five."""
    simulator, activation = arm.simulator(), np.full(29, 0.1)
    best = np.inf
    for _ in range(5):
        started = time.perf_counter()
        for _ in range(100):
            simulator.step(activation)
        best = min(best, time.perf_counter() - started)
    assert 100 * simulator.step_seconds / best > 10.0
