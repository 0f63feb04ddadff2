"""Targets that muscles can hold: what is refused, what is drawn near a pose."""

import numpy as np
import pytest

from anthro.motor.dynamics import effort_problem
from anthro.motor.targets import TRIES, Targets
from anthro.motor.teacher import Gains, StaticPosture, Teacher


@pytest.fixture
def teacher(limb):
    return Teacher(limb("right_leg"), 0.005)


def test_held_targets_lack_less_than_the_plan_allows(limb, teacher):
    """The muscle problem of each canonical pose, solved anew, is met to plan.lack."""
    its, targets = teacher.limb, Targets(teacher, 0.75, np.random.default_rng(0))
    statics, simulator = StaticPosture(its, Gains()), its.body.simulator()
    for _ in range(6):
        target, pose = targets.draw()
        assert pose.error == pytest.approx(np.linalg.norm(teacher.kinematics.feature(pose.q) - target), abs=1e-9)
        q = its.with_angles(its.body.q_rest, pose.q)
        drive, _, _ = statics.drive(q)
        simulator.reset(statics.place(q))
        matrix, torque = effort_problem(simulator, its)
        assert np.abs(matrix @ np.clip(drive, 0.0, 1.0) - torque).max() <= its.plan.lack + 0.05
    assert targets.drawn == 6 + targets.refused


def test_poses_that_muscles_cannot_hold_are_refused(teacher, monkeypatch):
    lacks = iter([5.0, 1.01, 0.99, 0.0])
    monkeypatch.setattr(teacher, "lacks", lambda pose: next(lacks))
    targets = Targets(teacher, 0.75, np.random.default_rng(0))
    targets.draw()
    assert (targets.drawn, targets.refused) == (3, 2)
    targets.draw()
    assert (targets.drawn, targets.refused) == (4, 2)


def test_targets_near_a_pose_are_near(teacher):
    its = teacher.limb
    targets, q = Targets(teacher, 0.75, np.random.default_rng(1)), its.body.q_rest[its.driven]
    there = teacher.kinematics.feature(q)
    near = [
        np.linalg.norm(
            targets.near(
                q,
                0.02,
            )[0]
            - there
        )
        for _ in range(5)
    ]
    far = [np.linalg.norm(targets.draw()[0] - there) for _ in range(5)]
    assert max(near) < 0.1 < np.median(far)


def test_where_nothing_near_is_held_any_target_is_taken(teacher, monkeypatch):
    asked = []

    def lacks(pose):
        asked.append(pose)
        return 0.0 if len(asked) > TRIES else 9.0

    monkeypatch.setattr(teacher, "lacks", lacks)
    targets = Targets(teacher, 0.75, np.random.default_rng(1))
    its = teacher.limb
    _, pose = targets.near(its.body.q_rest[its.driven], 0.01)
    assert len(asked) == TRIES + 1 == targets.drawn and pose is asked[-1]
    assert np.abs(pose.q - asked[0].q).max() > 0.1  # drawn from the whole share


def test_same_stream_same_targets(limb):
    drawn = [Targets(Teacher(limb("left_arm"), 0.005), 0.7, np.random.default_rng(4)).draw()[0] for _ in range(2)]
    assert drawn[0].tobytes() == drawn[1].tobytes()
