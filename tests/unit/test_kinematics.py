"""Inverse kinematics: one pose a target, within the limits, without leaps."""

import numpy as np
import pytest

from anthro.errors import UserError
from anthro.motor.kinematics import LIMIT_MARGIN, InverseKinematics


@pytest.fixture(scope="module")
def kinematics(arm):
    return InverseKinematics(arm)


def random_targets(kinematics, count, seed, share=0.7):
    low, high = kinematics.body.q_range.T
    rng = np.random.default_rng(seed)
    poses = 0.5 * (low + high) + 0.5 * share * (high - low) * rng.uniform(-1.0, 1.0, (count, 7))
    return np.array([kinematics.hand(pose) for pose in poses])


def test_the_hand_is_the_simulators(arm, kinematics):
    simulator = arm.simulator()
    pose = arm.q_rest + 0.2
    simulator.reset(pose)
    np.testing.assert_allclose(kinematics.hand(pose), simulator.hand_position, atol=1e-12)


def test_targets_of_the_middle_70_percent_are_reached_within_a_millimetre(kinematics):
    for target in random_targets(kinematics, 40, seed=5):
        pose = kinematics.solve(target)
        assert pose.reached and pose.error < 1e-3
        np.testing.assert_allclose(np.linalg.norm(kinematics.hand(pose.q) - target), pose.error, atol=1e-12)


def test_poses_keep_a_margin_from_the_limits(arm, kinematics):
    low, high = arm.q_range.T
    margin = LIMIT_MARGIN * (high - low)
    far = np.array([[1.0, -0.2, 1.2], [0.0, 1.0, 1.2], [0.0, -0.2, 3.0]])
    for target in [*random_targets(kinematics, 15, seed=6), *far]:
        q = kinematics.solve(target).q
        assert (q >= low + margin - 1e-12).all() and (q <= high - margin + 1e-12).all()


def test_the_pose_is_a_function_of_the_target_alone(arm, kinematics):
    """Whatever was solved before, and by a solver of its own, the same bytes come out."""
    targets = random_targets(kinematics, 6, seed=8)
    first = [kinematics.solve(target).q.tobytes() for target in targets]
    again = [kinematics.solve(target).q.tobytes() for target in targets[::-1]][::-1]
    fresh = [InverseKinematics(arm).solve(target).q.tobytes() for target in targets]
    assert first == again == fresh


def test_the_rest_hand_has_the_rest_pose(arm, kinematics):
    pose = kinematics.solve(kinematics.hand(arm.q_rest))
    np.testing.assert_allclose(pose.q, arm.q_rest, atol=1e-6)


def test_a_millimetre_of_target_moves_no_joint_by_a_leap(kinematics):
    rng = np.random.default_rng(11)
    largest = []
    for target in random_targets(kinematics, 40, seed=10):
        direction = rng.normal(size=3)
        near = target + 1e-3 * direction / np.linalg.norm(direction)
        largest.append(np.abs(kinematics.solve(near).q - kinematics.solve(target).q).max())
    assert max(largest) < 0.1  # rad
    assert np.median(largest) < 0.01


def test_a_joint_path_has_no_leap_along_a_straight_hand_path(kinematics):
    start, end = random_targets(kinematics, 2, seed=14, share=0.5)
    poses = np.array([kinematics.solve(start + s * (end - start)).q for s in np.linspace(0.0, 1.0, 41)])
    step = np.linalg.norm(end - start) / 40.0
    assert np.abs(np.diff(poses, axis=0)).max() < max(0.1, 30.0 * step)


@pytest.mark.parametrize("target", [[np.nan, 0.0, 1.0], [0.0, np.inf, 1.0], [0.0, 1.0], []])
def test_targets_that_are_no_points_are_refused(kinematics, target):
    with pytest.raises(UserError, match="three finite numbers"):
        kinematics.solve(np.array(target, float))


def test_an_unreachable_target_is_reported(kinematics):
    """Two metres ahead: the pose stretches the arm towards it."""
    target = np.array([2.0, -0.2, 1.2])
    pose = kinematics.solve(target)
    assert not pose.reached and np.isfinite(pose.q).all()
    assert pose.error == pytest.approx(np.linalg.norm(kinematics.hand(pose.q) - target))
    start = np.linalg.norm(kinematics.hand(kinematics.body.q_rest) - target)
    assert 1.0 < pose.error < start
