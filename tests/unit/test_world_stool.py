"""A stool that is shaken: its motion, and the inertial forces that a carried body bears."""

import mujoco
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import solve_ivp
from test_simulator_world import add_bone, as_body

from anthro.errors import UserError
from anthro.world.stool import HORIZONTAL, PAPER, VERTICAL, Shaking, Stool

LENGTH, MASS = 0.5, 2.0
GRAVITY = 9.81


def pendulum(links=1, root_free=False):
    """Links that hang from a hip and swing forwards, each a point mass nearly, without springs or dampers."""
    spec = mujoco.MjSpec()
    spec.compiler.degree = False
    hip = add_bone(spec.worldbody, "hip", (0.1, 0.0, 1.0), 1.0)
    if root_free:
        hip.add_freejoint(name="root")
    parent, place = hip, (0.0, 0.0, 0.0)
    for k in range(links):
        parent = add_bone(parent, f"link{k}", place, MASS, inertia=1e-6)
        parent.ipos = (0.0, 0.0, -LENGTH)
        parent.add_joint(name=f"swing{k}", type=mujoco.mjtJoint.mjJNT_HINGE, axis=(0.0, 1.0, 0.0))
        place = (0.0, 0.0, -LENGTH)
    free = {"joint_stiffness": np.zeros(links), "joint_damping": np.zeros(links)}
    return as_body(spec, q_range=np.tile([-7.0, 7.0], (links, 1)), **free).movable()


def swing(shaking, step, seconds, start=0.3):
    """Angle of a pendulum on a shaken stool after some seconds, simulated."""
    simulator = pendulum().simulator(step)
    simulator.reset(np.array([start]))
    stool = Stool(simulator, shaking)
    for _ in range(round(seconds / step)):
        stool.shake()
        simulator.step(np.zeros(0))
    return float(simulator.joint_angles[0])


def exact_swing(shaking, seconds, start=0.3):
    """The same by the pendulum's equation about an accelerated pivot: l a'' = -(g + z'') sin a + x'' cos a."""

    def rate(time, state):
        h = 1e-5
        x, _, z = (shaking.velocity(time + h) - shaking.velocity(max(time - h, 0.0))) / (h + min(time, h))
        return state[1], (-(GRAVITY + z) * np.sin(state[0]) + x * np.cos(state[0])) / LENGTH

    return solve_ivp(rate, (0.0, seconds), (start, 0.0), rtol=1e-9, atol=1e-10, max_step=0.005).y[0, -1]


@pytest.mark.parametrize("direction", [VERTICAL, HORIZONTAL, (1.0, 0.0, 1.0)])
def test_a_pendulum_on_a_shaken_stool_swings_as_about_an_accelerated_pivot(direction):
    shaking = Shaking(*PAPER["10 cm at 3.75 Hz"], direction)
    exact = exact_swing(shaking, 1.5)
    still = exact_swing(Shaking(0.0, 3.75), 1.5)
    errors = [abs(swing(shaking, step, 1.5) - exact) for step in (2e-3, 1e-3)]
    assert errors[1] < 0.05 * abs(exact - still)
    assert errors[1] < 0.6 * errors[0]  # of first order


def test_a_base_that_falls_makes_weightless_and_one_that_rises_as_gravity_doubles_weight():
    for factor, wanted in ((-1.0, 0.0), (1.0, 2.0)):
        simulator = pendulum().simulator(0.005)
        simulator.reset(np.array([0.3]))
        simulator.carry((0.0, 0.0, 0.0), (0.0, 0.0, factor * GRAVITY * 0.005))
        simulator.step(np.zeros(0))
        fall = -GRAVITY * np.sin(0.3) / LENGTH * 0.005
        assert simulator.qvel[0] == pytest.approx(wanted * fall, rel=1e-3, abs=1e-12)


@given(st.lists(st.floats(-30.0, 30.0), min_size=3, max_size=3))
def test_an_evenly_accelerated_base_is_another_gravity(acceleration):
    carried, heavy = pendulum(3).simulator(0.005), pendulum(3).simulator(0.005)
    heavy.model.opt.gravity[:] = np.array([0.0, 0.0, -GRAVITY]) - acceleration
    for simulator in (carried, heavy):
        simulator.reset(np.array([0.3, -0.4, 0.5]))
    for k in range(1, 21):
        time, a = 0.005 * k, np.array(acceleration)
        carried.carry(0.5 * a * time**2, a * time)
        for simulator in (carried, heavy):
            simulator.step(np.zeros(0))
    np.testing.assert_allclose(carried.joint_angles, heavy.joint_angles, atol=1e-9)
    moved = carried.data.xpos - heavy.data.xpos
    np.testing.assert_allclose(moved[1:], np.tile(0.5 * a * time**2, (len(moved) - 1, 1)), atol=1e-8)


def test_shaking_starts_gently_and_reaches_its_amplitude():
    shaking = Shaking(0.10, 3.75, (0.0, 0.0, 2.0))
    np.testing.assert_allclose(shaking.displacement(0.0), 0.0)
    np.testing.assert_allclose(shaking.velocity(0.0), 0.0)
    quarter = 4.25 / 3.75  # s: four periods and a quarter, past the first second
    np.testing.assert_allclose(shaking.displacement(quarter), (0.0, 0.0, 0.10))
    np.testing.assert_allclose(shaking.velocity(4.0 / 3.75), (0.0, 0.0, 0.10 * 2.0 * np.pi * 3.75))
    np.testing.assert_allclose(shaking.displacement(0.5), (0.0, 0.0, 0.05 * np.sin(2.0 * np.pi * 3.75 * 0.5)))


@given(st.floats(0.0, 3.0), st.floats(0.0, 1.0), st.floats(0.1, 8.0), st.floats(0.2, 2.0))
def test_its_velocity_is_the_slope_of_its_displacement(time, amplitude, frequency, ease):
    shaking, h = Shaking(amplitude, frequency, (1.0, -2.0, 0.5), ease), 1e-6
    slope = (shaking.displacement(time + h) - shaking.displacement(time - h)) / (2.0 * h)
    np.testing.assert_allclose(shaking.velocity(time), slope, atol=1e-6 + 1e-6 * amplitude * frequency**3)


def test_a_reset_puts_the_root_back_and_ends_its_motion():
    simulator = pendulum().simulator(0.005)
    stool = Stool(simulator, Shaking(0.1, 3.75, HORIZONTAL, ease=0.1))
    for _ in range(50):
        stool.shake()
        simulator.step(np.zeros(0))
    np.testing.assert_allclose(simulator.data.xpos[1], stool.pose(simulator.time)[:3])
    np.testing.assert_allclose(simulator.base_velocity, stool.shaking.velocity(simulator.time))
    simulator.reset()
    np.testing.assert_allclose(simulator.data.xpos[1], (0.1, 0.0, 1.0))
    assert not simulator.base_velocity.any()
    np.testing.assert_allclose(stool.pose(0.0), (0.1, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0))
    assert stool.pose(np.linspace(0.0, 1.0, 5)).shape == (5, 7)


@pytest.mark.parametrize(
    "numbers",
    [(-0.1, 3.0), (0.1, 0.0), (np.nan, 3.0), (0.1, 3.0, (0, 0, 0)), (0.1, 3.0, (1, 0)), (0.1, 3.0, VERTICAL, 0)],
)
def test_a_shaking_that_is_none_is_refused(numbers):
    with pytest.raises(UserError, match="shaking"):
        Shaking(*numbers)


def test_a_free_root_is_not_carried():
    simulator = pendulum(root_free=True).simulator()
    with pytest.raises(UserError, match="fixed root"):
        Stool(simulator, Shaking(0.1, 3.75)).shake()
