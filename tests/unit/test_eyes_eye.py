"""Eyes in the head: geometry by hand, mirror images, limits, speeds, the main sequence."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from anthro.errors import UserError
from anthro.eyes.eye import MOVERS, RADIUS, TOP_SPEED, Eye, EyeState, MainSequenceMover, PaperMover, mover, towards

STEP = 0.005  # s
LEFT, RIGHT = Eye("left"), Eye("right")
ANGLE = st.floats(-0.7, 0.7)


def saccade(way, degrees):
    """Peak speed and greatest speed of the gaze, degrees a second, and steps until a horizontal goal is reached."""
    state, speeds = EyeState(np.zeros(2)), []
    goal = np.deg2rad([degrees, 0.0])
    for _ in range(200):
        after = way.step(LEFT, state, goal, 0.001)
        speeds.append(np.rad2deg(np.linalg.norm(after.angles - state.angles)) / 0.001)
        state = after
    assert np.allclose(state.angles, goal)
    return max(speeds), np.count_nonzero(speeds)


def test_pupils_are_a_humans_distance_apart_and_mirror_each_other():
    apart = LEFT.pupil(np.zeros(2)) - RIGHT.pupil(np.zeros(2))
    assert apart == pytest.approx([0, 0.0634, 0])
    assert np.linalg.norm(LEFT.pupil(np.zeros(2)) - LEFT.centre) == pytest.approx(0.012)


@given(ANGLE, ANGLE)
def test_an_eye_turns_as_the_other_ones_mirror_image(theta, phi):
    flip = np.diag([1.0, -1.0, 1.0])
    turned = RIGHT.rotation(np.array([-theta, phi]))
    assert np.allclose(flip @ LEFT.rotation(np.array([theta, phi])) @ flip, turned)
    assert np.allclose(turned @ turned.T, np.eye(3)) and np.linalg.det(turned) == pytest.approx(1)
    assert np.allclose(flip @ LEFT.pupil(np.array([theta, phi])), RIGHT.pupil(np.array([-theta, phi])))


def test_theta_turns_left_and_phi_up():
    c, s = np.cos(0.3), np.sin(0.3)
    assert np.allclose(LEFT.rotation(np.array([0.3, 0.0]))[:, 0], [c, s, 0])
    assert np.allclose(LEFT.rotation(np.array([0.0, 0.3]))[:, 0], [c, 0, s])


@given(ANGLE, ANGLE, st.floats(0.1, 5.0))
def test_the_gaze_goes_through_the_point_that_it_is_aimed_at(theta, phi, away):
    angles = np.array([theta, phi])
    point = RIGHT.centre + away * RIGHT.rotation(angles)[:, 0]
    assert np.allclose(RIGHT.angles_to(point), angles)
    ray = (point - RIGHT.pupil(angles)) / (away - RADIUS)
    assert np.allclose(ray, RIGHT.rotation(angles)[:, 0])


def test_limits_are_those_of_people():
    far = np.array([[9.0, 9.0], [-9.0, -9.0]])
    assert np.allclose(np.rad2deg(LEFT.within(far)), [[44.2, 27.9], [-44.9, -47.1]])
    assert np.allclose(np.rad2deg(RIGHT.within(far)), [[44.9, 27.9], [-44.2, -47.1]])


@pytest.mark.parametrize("name", MOVERS)
@given(
    commands=st.lists(st.tuples(st.floats(-3, 3), st.floats(-3, 3)), min_size=1, max_size=30),
    seconds=st.floats(1e-3, 0.02),
)
def test_no_command_drives_an_eye_beyond_its_limits_or_its_speed(name, commands, seconds):
    way = mover(name)
    state = EyeState(np.zeros(2))
    for command in commands:
        after = way.step(RIGHT, state, np.array(command), seconds)
        assert np.linalg.norm(after.angles - state.angles) <= TOP_SPEED * seconds * (1 + 1e-9)
        assert np.allclose(RIGHT.within(after.angles), after.angles)
        turned = RIGHT.rotation(state.angles)[:, 0] @ RIGHT.rotation(after.angles)[:, 0]
        assert np.arccos(np.clip(turned, -1, 1)) <= TOP_SPEED * seconds + 1e-6
        state = after


def test_the_papers_eye_goes_at_900_degrees_a_second():
    state = EyeState(np.zeros(2))
    state = PaperMover().step(LEFT, state, np.deg2rad([40.0, 0.0]), STEP)
    assert np.rad2deg(state.angles) == pytest.approx([4.5, 0])  # 900 * 0.005
    state = PaperMover().step(LEFT, state, np.deg2rad([3.0, 1.0]), STEP)
    assert np.rad2deg(state.angles) == pytest.approx([3, 1])  # within reach: exactly there


@pytest.mark.parametrize(("degrees", "human", "deviation"), [(5, 213, 29), (15, 352, 50), (30, 455, 67)])
def test_peak_speeds_of_the_main_sequence_are_peoples(degrees, human, deviation):
    way = MainSequenceMover()
    peak, milliseconds = saccade(way, degrees)
    assert abs(peak - human) < deviation
    assert np.rad2deg(way.peak_speed(np.deg2rad(degrees))) == pytest.approx(peak, rel=0.01)
    assert milliseconds == pytest.approx(1e3 * 15 / 8 * degrees / peak, abs=2)
    assert saccade(PaperMover(), degrees)[0] == pytest.approx(900)


def test_a_saccade_is_ballistic_and_then_follows_the_next_command():
    way = MainSequenceMover()
    state = way.step(LEFT, EyeState(np.zeros(2)), np.deg2rad([20.0, 0.0]), STEP)
    for _ in range(40):
        state = way.step(LEFT, state, np.deg2rad([-20.0, 0.0]), STEP)
        if state.goal is None:
            break
    assert np.rad2deg(state.angles) == pytest.approx([20, 0])
    state = way.step(LEFT, state, np.deg2rad([-20.0, 0.0]), STEP)
    assert np.rad2deg(state.goal) == pytest.approx([-20, 0])


def test_small_errors_are_pursued_no_faster_than_people_can():
    way = MainSequenceMover()
    state = way.step(LEFT, EyeState(np.zeros(2)), np.deg2rad([0.9, 0.0]), STEP)
    assert state.goal is None and np.rad2deg(state.angles) == pytest.approx([0.45, 0])  # 90 * 0.005


@given(ANGLE, ANGLE, st.floats(0, 0.2))
def test_towards_keeps_its_way_and_its_step(x, y, most):
    start, goal = np.array([0.1, -0.2]), np.array([x, y])
    there = towards(start, goal, most)
    assert np.linalg.norm(there - start) <= most + 1e-12 or np.allclose(there, goal)
    assert np.linalg.norm(goal - there) <= np.linalg.norm(goal - start) + 1e-12


def test_bad_input_is_told():
    with pytest.raises(UserError, match="unknown side"):
        Eye("third")
    with pytest.raises(UserError, match="known: paper, main_sequence"):
        mover("owl")
    for command in (np.array([np.nan, 0.0]), np.zeros(3)):
        with pytest.raises(UserError, match="two finite angles"):
            PaperMover().step(LEFT, EyeState(np.zeros(2)), command, STEP)
