"""The teacher in closed loop: it reaches, holds and takes a push."""

import numpy as np
import pytest

from anthro.body.simulator import DEFAULT_STEP
from anthro.demos.session import advance
from anthro.motor.rollouts import random_pose
from anthro.motor.teacher import Teacher, TeacherPolicy

SETTLED = 50  # steps, 0.25 s


def targets(arm, teacher, count, seed):
    rng = np.random.default_rng(seed)
    return [teacher.kinematics.hand(random_pose(arm, 0.7, rng)) for _ in range(count)]


@pytest.fixture
def policy(arm):
    return TeacherPolicy(Teacher(arm, DEFAULT_STEP))


@pytest.fixture
def simulator(arm, policy):
    simulator = arm.simulator()
    policy.reset(simulator)
    return simulator


def test_teacher_reaches_random_targets_one_after_the_other(arm, policy, simulator):
    """1.5 s each; the last 0.25 s within 3 cm in the mean, as the demo asks."""
    for target in targets(arm, policy.teacher, 5, seed=0):
        error = advance(simulator, policy, target, 1.5)
        assert error[-SETTLED:].mean() < 0.03


def test_teacher_holds_and_comes_back_from_a_push(arm, policy, simulator):
    target = policy.teacher.kinematics.hand(arm.q_rest + 0.1)
    advance(simulator, policy, target, 1.5)
    before = simulator.hand_position
    simulator.push((0.0, 20.0, 0.0))
    pushed = advance(simulator, policy, target, 0.1)
    simulator.push((0.0, 0.0, 0.0))
    advance(simulator, policy, target, 1.0)
    assert pushed.max() > 0.005
    assert np.linalg.norm(simulator.hand_position - before) < 0.01


def test_appendix_b_rule_reaches_when_the_teacher_itself_acts(arm):
    teacher = Teacher(arm, DEFAULT_STEP, rule="appendix_b")
    policy, simulator = TeacherPolicy(teacher), arm.simulator()
    policy.reset(simulator)
    for target in targets(arm, teacher, 2, seed=0):
        assert advance(simulator, policy, target, 1.5)[-SETTLED:].mean() < 0.03


def test_an_unreachable_target_is_approached_without_harm(arm, policy, simulator):
    target = np.array([3.0, -0.2, 1.2])
    error = advance(simulator, policy, target, 1.0)
    assert np.isfinite(error).all() and error[-1] < error[0]
    assert not policy.teacher.pose.reached


def test_same_targets_same_bytes(arm):
    ends = []
    for _ in range(2):
        policy, simulator = TeacherPolicy(Teacher(arm, DEFAULT_STEP)), arm.simulator()
        policy.reset(simulator)
        advance(simulator, policy, policy.teacher.kinematics.hand(arm.q_rest + 0.1), 0.5)
        ends.append(simulator.qpos.tobytes() + policy.drive.tobytes())
    assert ends[0] == ends[1]
