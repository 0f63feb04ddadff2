"""Inverse kinematics: one pose a target, within the limits, without leaps; positions, gazes and orientations."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from anthro.errors import UserError
from anthro.motor.kinematics import LIMIT_MARGIN, InverseKinematics
from anthro.motor.senses import direction

# limb: share of the ranges in which poses are drawn
SHARES = {"right_arm": 0.7, "left_leg": 0.7, "neck_seated": 0.65, "core": 0.45}
seeds = st.integers(0, 2**32 - 1)


@pytest.fixture(scope="module")
def solvers(limb):
    """The solver of each limb."""
    return {name: InverseKinematics(limb(name)) for name in SHARES}


@pytest.fixture(scope="module")
def kinematics(solvers):
    return solvers["right_arm"]


def target_of(kinematics, seed, share=0.7):
    rng = np.random.default_rng(seed)
    return kinematics.feature(kinematics.limb.random_pose(share, rng))


def offset_at(limb, q, target):
    """The discrepancy (width,) at a pose, by a simulator of its own."""
    simulator = limb.body.simulator()
    simulator.reset(limb.with_angles(simulator.qpos, q))
    return limb.offset(simulator.data, target)


@pytest.mark.parametrize("name", SHARES)
@settings(max_examples=6, deadline=None)
@given(seed=seeds)
def test_targets_are_reached_within_the_limits(solvers, name, seed):
    """To a millimetre or milliradian, 5 % of each range left."""
    kinematics = solvers[name]
    limb, target = kinematics.limb, target_of(kinematics, seed, SHARES[name])
    pose = kinematics.solve(target)
    assert pose.reached and pose.error < 1e-3
    offset = offset_at(limb, pose.q, target)
    assert offset.shape == (limb.width,) and np.linalg.norm(offset) == pytest.approx(pose.error, abs=1e-9)
    margin = LIMIT_MARGIN * (limb.high - limb.low)
    assert (pose.q >= limb.low + margin - 1e-12).all() and (pose.q <= limb.high - margin + 1e-12).all()


@pytest.mark.parametrize("name", SHARES)
@settings(max_examples=3, deadline=None)
@given(seed=seeds)
def test_the_pose_is_a_function_of_the_target_alone(solvers, name, seed):
    """Whatever was solved before, and by a solver of its own, the same bytes come out."""
    kinematics = solvers[name]
    targets = [target_of(kinematics, seed + k, SHARES[name]) for k in range(2)]
    first = [kinematics.solve(target).q.tobytes() for target in targets]
    again = [kinematics.solve(target).q.tobytes() for target in targets[::-1]][::-1]
    fresh = [InverseKinematics(kinematics.limb).solve(target).q.tobytes() for target in targets]
    assert first == again == fresh


@pytest.mark.parametrize("name", SHARES)
def test_the_rest_posture_is_its_own_canonical_pose(solvers, name):
    limb = solvers[name].limb
    rest = np.clip(limb.body.q_rest[limb.driven], limb.low + 0.1 * limb.half_range, limb.high - 0.1 * limb.half_range)
    pose = solvers[name].solve(solvers[name].feature(limb.body.q_rest[limb.driven]))
    np.testing.assert_allclose(pose.q, rest, atol=0.02)


def test_a_canonical_pose_is_the_same_on_every_body(limb, solvers):
    """A target is taken along with the base; the rest of the body does not matter."""
    for name in ("right_arm", "left_leg", "neck_seated"):
        own, other = solvers[name], InverseKinematics(limb(name, "nakada2018"))
        q = own.limb.random_pose(0.6, np.random.default_rng(3))
        poses = [kinematics.solve(kinematics.feature(q)).q for kinematics in (own, other)]
        np.testing.assert_allclose(poses[1], poses[0], atol=1e-4)


def test_a_gaze_is_met_by_azimuth_and_elevation(solvers):
    """30 degrees to the left and 10 up: the nose points there."""
    kinematics = solvers["neck_seated"]
    target = direction(np.deg2rad(30.0), np.deg2rad(10.0))
    pose = kinematics.solve(target)
    simulator = kinematics.limb.body.simulator()
    simulator.reset(kinematics.limb.with_angles(simulator.qpos, pose.q))
    nose = simulator.data.site_xmat[kinematics.limb.site].reshape(3, 3)[:, 0]
    assert pose.reached and nose @ target > np.cos(2e-3)


def test_bending_is_shared_as_ranges_and_reluctance_say(solvers):
    """An upright T1 turned forward: every spinal joint bends forward, the chest less than the loins."""
    from scipy.spatial.transform import Rotation

    kinematics = solvers["core"]
    limb = kinematics.limb
    forward = kinematics.solve(Rotation.from_rotvec([0.0, 0.4, 0.0]).as_matrix())
    neutral = kinematics.solve(np.eye(3))
    assert forward.reached and neutral.reached
    change = dict(zip([limb.body.dof_names[i] for i in limb.driven], forward.q - neutral.q, strict=True))
    spine = [angle for name, angle in change.items() if name.endswith("_flexion") and name[0] in "LT"]
    assert min(spine) > 0.0 or max(spine) < 0.0
    lumbar, thoracic = (
        np.mean([abs(a) for n, a in change.items() if n.endswith("_flexion") and n[0] == region]) for region in "LT"
    )
    assert lumbar > 1.5 * thoracic


def test_a_millimetre_of_target_moves_no_joint_by_a_leap(kinematics):
    rng = np.random.default_rng(11)
    largest = []
    for seed in range(30):
        target, way = target_of(kinematics, seed), rng.normal(size=3)
        near = target + 1e-3 * way / np.linalg.norm(way)
        largest.append(np.abs(kinematics.solve(near).q - kinematics.solve(target).q).max())
    assert max(largest) < 0.1  # rad
    assert np.median(largest) < 0.01


def test_a_joint_path_has_no_leap_along_a_straight_hand_path(kinematics):
    start, end = (target_of(kinematics, seed, 0.5) for seed in (14, 15))
    poses = np.array([kinematics.solve(start + s * (end - start)).q for s in np.linspace(0.0, 1.0, 41)])
    step = np.linalg.norm(end - start) / 40.0
    assert np.abs(np.diff(poses, axis=0)).max() < max(0.1, 30.0 * step)


@pytest.mark.parametrize("target", [[np.nan, 0.0, 1.0], [0.0, np.inf, 1.0], [0.0, 1.0], [], np.eye(3)])
def test_targets_that_are_no_points_are_refused(kinematics, target):
    with pytest.raises(UserError, match=r"right_arm: a target is \(3,\) finite numbers"):
        kinematics.solve(np.array(target, float))


def test_an_orientation_is_a_matrix(solvers):
    with pytest.raises(UserError, match=r"core: a target is \(3, 3\) finite numbers"):
        solvers["core"].solve(np.zeros(3))


def test_an_unreachable_target_is_reported(kinematics):
    """Two metres ahead: the pose stretches the arm towards it."""
    target, limb = np.array([2.0, -0.2, 1.2]), kinematics.limb
    pose = kinematics.solve(target)
    assert not pose.reached and np.isfinite(pose.q).all()
    assert pose.error == pytest.approx(np.linalg.norm(kinematics.feature(pose.q) - target))
    start = np.linalg.norm(kinematics.feature(limb.body.q_rest[limb.driven]) - target)
    assert 1.0 < pose.error < start


def test_turning_the_base_turns_nothing_but_the_target(limb_keys, load_body):
    """A reclining body and its target are turned as one: same pose, same discrepancy."""
    import mujoco
    from scipy.spatial.transform import Rotation

    from anthro.motor.limb import Limb, limb_plan

    by = Rotation.from_euler("y", -40.0, degrees=True)
    for name in ("left_leg", "neck_seated"):
        still, turned = load_body("nakada2018"), load_body("nakada2018").movable()
        turned.model.body_quat[1] = np.roll(by.as_quat(), 1)
        plan = limb_plan(limb_keys(name))
        limbs = [Limb(plan, body) for body in (still, turned)]
        solvers = [InverseKinematics(its) for its in limbs]
        q = limbs[0].random_pose(0.5, np.random.default_rng(1))
        targets = [solver.feature(q) for solver in solvers]
        data = mujoco.MjData(still.model)
        mujoco.mj_kinematics(still.model, data)
        root = data.xpos[1]
        moved = root + by.apply(targets[0] - root) if name == "left_leg" else by.apply(targets[0])
        np.testing.assert_allclose(targets[1], moved, atol=1e-9)
        poses = [solver.solve(target).q for solver, target in zip(solvers, targets, strict=True)]
        np.testing.assert_allclose(poses[1], poses[0], atol=1e-5)
        offsets = []
        for its, target in zip(limbs, targets, strict=True):
            simulator = its.body.simulator()
            offsets.append(its.offset(simulator.data, target))
        np.testing.assert_allclose(offsets[1], offsets[0], atol=1e-9)
