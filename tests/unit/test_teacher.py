"""The teacher's parts: the reflex, holding drives, and the labels."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from anthro.errors import UserError
from anthro.motor import reflex
from anthro.motor.dynamics import effort_problem
from anthro.motor.kinematics import Pose
from anthro.motor.limb import SLACK
from anthro.motor.teacher import Gains, StaticPosture, Teacher, TeacherPolicy

STEP = 0.005

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


# -- holding drives ---------------------------------------------------------------------------------


@pytest.mark.parametrize(("name", "share"), [("right_arm", 0.3), ("right_leg", 0.1), ("neck_seated", 0.2)])
def test_holding_drive_balances_gravity(limb, name, share):
    its, rng = limb(name), np.random.default_rng(0)
    statics, simulator, gains = StaticPosture(its, Gains()), its.body.simulator(), Gains()
    for _ in range(2):
        angles = its.near(its.body.q_rest[its.driven], share, rng)
        angles[0] -= 0.35 * (name == "right_leg")  # no muscle lifts a thigh much beyond 85 degrees
        q = its.with_angles(its.body.q_rest, angles)
        drive, strain, lacking = statics.drive(q)
        simulator.reset(statics.place(q))
        matrix, torque = effort_problem(simulator, its)
        unmet = np.abs(matrix @ np.clip(drive, 0.0, 1.0) - torque)
        assert lacking == pytest.approx(unmet[its.slack <= SLACK].max(), abs=1e-3) and lacking < 2.0  # N m
        assert (drive >= gains.drive_range[0]).all() and (drive <= gains.drive_range[1]).all()
        assert strain.shape == drive.shape == (its.size,)


@pytest.mark.parametrize(("name", "degrees"), [("right_arm", 1.0), ("right_leg", 2.0), ("neck_seated", 2.0)])
def test_holding_drive_and_reflex_hold_the_pose(limb, name, degrees):
    """From rest, by the exact stretch reflex about the drive, for half a second."""
    its, rng = limb(name), np.random.default_rng(5)
    statics, simulator = StaticPosture(its, Gains(tone=0.1)), its.body.simulator()
    q = its.with_angles(its.body.q_rest, its.near(its.body.q_rest[its.driven], 0.1, rng))
    drive, strain, _ = statics.drive(q)
    start = statics.place(q)
    limp, held = its.body.simulator(), simulator
    moved = []
    for each, is_held in ((limp, False), (held, True)):
        each.reset(start)
        for _ in range(100):
            stretch = reflex.STRAIN_GAIN * (each.strain - strain) + reflex.STRAIN_RATE_GAIN * each.strain_rate
            each.step(is_held * reflex.activation(drive + stretch))
        moved.append(np.rad2deg(np.abs(each.joint_angles - start)[its.driven]).max())
    assert moved[1] < degrees < 0.3 * moved[0]


def test_angles_beyond_the_ranges_count_as_the_nearest_within(limb):
    its = limb("right_arm")
    statics, far = StaticPosture(its, Gains()), its.body.q_rest.copy()
    far[3] = its.high[3]
    drive, strain, _ = statics.drive(far)
    far[3] += 0.3
    for found, wanted in zip(statics.drive(far)[:2], (drive, strain), strict=True):
        np.testing.assert_allclose(found, wanted, atol=1e-9)


def test_others_load_the_core(limb):
    """An arm that is pulled needs another drive of the core than a limp one."""
    its = limb("core")
    statics, others = StaticPosture(its, Gains()), np.zeros(823)
    limp = statics.drive(its.body.q_rest)[0]
    np.testing.assert_allclose(statics.drive(its.body.q_rest, others)[0], limp, atol=1e-3)
    others[its.body.muscle_names.index("DELT1_r")] = 1.0
    assert np.abs(statics.drive(its.body.q_rest, others)[0] - limp).max() > 0.05


# -- labels -----------------------------------------------------------------------------------------


@pytest.fixture
def teacher(limb):
    return Teacher(limb("right_arm"), STEP)


def targets(teacher, count, seed, share=0.7):
    rng = np.random.default_rng(seed)
    return [teacher.kinematics.feature(teacher.limb.random_pose(share, rng)) for _ in range(count)]


@pytest.mark.parametrize("name", ["right_arm", "right_leg", "neck_seated"])
def test_a_held_target_needs_no_adjustment(limb, name):
    teacher = Teacher(limb(name), STEP)
    simulator = teacher.limb.body.simulator()
    for target in targets(teacher, 3, seed=2, share=0.5):
        pose = teacher.aim(target)
        q = teacher.settled(teacher.limb.with_angles(teacher.limb.body.q_rest, pose.q))
        simulator.reset(q)
        label = teacher.voluntary(simulator, teacher.holding_state(q)[0])
        assert np.abs(label).max() < 5e-3


def test_the_label_draws_the_drive_to_the_holding_drive(arm, teacher):
    """leak_rate 8 / s times 5 ms: 4 % of what is missing a step."""
    simulator = arm.simulator()
    pose = teacher.aim(targets(teacher, 1, seed=2)[0])
    simulator.reset(pose.q)
    missing = np.linspace(-0.5, 0.5, 29)
    label = teacher.voluntary(simulator, teacher.holding_state(pose.q)[0] - missing)
    np.testing.assert_allclose(label, 0.04 * missing, atol=1e-6)


def test_the_label_is_the_thresholds_way_of_one_stride(limb):
    """By hand: a_s - k_p e of a pose one stride nearer, less that of the present one; no leak."""
    its = limb("right_arm")
    gains = Gains(approach_rate=4.0, max_joint_speed=1.0, leak_rate=0.0, max_adjustment=9.0)
    teacher, statics, simulator = Teacher(its, STEP, gains), StaticPosture(its, gains), its.body.simulator()
    here = its.body.q_rest + 0.05
    for far, stride in ((0.4, 1.0 * STEP), (0.01, 4.0 * STEP * 0.01)):
        goal = here.copy()
        goal[:3] += far * np.array([1.0, -0.5, 0.25])
        teacher.aim_at(None, teacher.kinematics.solve(teacher.kinematics.feature(goal))._replace(q=goal))
        ahead = here + (goal - here) * stride / far
        ends = [statics.drive(q)[:2] for q in (here, ahead)]
        threshold = [drive - 8.0 * strain for drive, strain in ends]
        simulator.reset(here)
        label = teacher.voluntary(simulator, np.full(29, 0.3))
        np.testing.assert_allclose(label, threshold[1] - threshold[0], atol=1e-6)


def test_joints_that_are_led_nowhere_have_no_say_in_the_label(limb):
    core = limb("core")
    patient, simulator = Teacher(core, STEP), core.body.simulator()
    simulator.reset(patient.settled(core.body.q_rest))
    drive, _ = patient.holding_state(simulator.joint_angles)
    target = core.feature(simulator.data)
    goal = patient.aim(target).q
    label = patient.voluntary(simulator, drive)
    for led in (False, True):
        patient.aim_at(target, Pose(goal + 0.05 * (core.led == led), 0.0))
        assert np.array_equal(patient.voluntary(simulator, drive), label) == (not led)


@pytest.mark.parametrize("name", ["right_arm", "right_leg"])
def test_the_label_is_bounded_and_of_pose_target_and_drive_alone(limb, name):
    """Neither velocity nor what was asked before changes it, so that a network can learn it."""
    its, rng = limb(name), np.random.default_rng(4)
    simulator, teacher, fresh = its.body.simulator(), Teacher(its, STEP), Teacher(its, STEP)
    exact = not len(its.passive)
    for target in targets(teacher, 4, seed=5, share=0.5):
        q = teacher.settled(its.with_angles(its.body.q_rest, its.random_pose(0.7, rng)))
        drive = rng.uniform(-1.0, 1.0, its.size)
        teacher.aim(target)
        simulator.reset(q, rng.normal(0.0, 1.0, len(q)))
        label = teacher.voluntary(simulator, drive)
        assert np.abs(label).max() <= Gains().max_adjustment
        fresh.aim(target)
        simulator.reset(q)
        np.testing.assert_allclose(fresh.voluntary(simulator, drive), label, atol=1e-6 if exact else 5e-3)


def test_mirrored_limbs_have_mirrored_labels(limb):
    """The left arm's teacher says in the mirror what the right one's says."""
    labels = []
    for name, y in (("right_arm", -0.25), ("left_arm", 0.25)):
        teacher = Teacher(limb(name), STEP)
        simulator = teacher.limb.body.simulator()
        teacher.aim(np.array([0.3, y, 1.2]))
        labels.append(teacher.voluntary(simulator, np.full(29, 0.1)))
    np.testing.assert_allclose(labels[1], labels[0], atol=1e-4)


def test_appendix_b_labels_by_hand(limb):
    """a_d - a: the label plus the activation gives the accelerations of Eq. 7 back."""
    its = limb("right_arm")
    teacher, simulator = Teacher(its, STEP, rule="appendix_b"), its.body.simulator()
    pose = teacher.aim(teacher.kinematics.feature(its.body.q_rest + 0.01))
    drive = np.linspace(-0.5, 1.5, 29)
    wished = teacher.voluntary(simulator, drive) + np.clip(drive, 0.0, 1.0)
    assert (wished >= 0.0).all() and (wished <= 1.0).all()
    wanted = 180.0 * (pose.q - simulator.qpos) - 20.0 * simulator.qvel
    matrix, torque = effort_problem(simulator, its, acceleration=wanted)
    np.testing.assert_allclose(matrix @ wished, torque, atol=0.1)  # N m


def test_unknown_rule_is_refused(limb):
    with pytest.raises(UserError, match="unknown label rule 'guess': known are equilibrium, appendix_b"):
        Teacher(limb("right_arm"), STEP, rule="guess")


@pytest.mark.parametrize("target", [np.array([np.nan, 0.0, 1.0]), np.zeros(2), np.eye(3)])
def test_a_target_that_is_none_is_refused(arm, teacher, target):
    policy, simulator = TeacherPolicy(teacher), arm.simulator()
    policy.reset(simulator)
    with pytest.raises(UserError, match=r"right_arm: a target is \(3,\) finite numbers"):
        policy.activation(simulator, target)


def test_aiming_happens_once_a_target(arm, teacher, monkeypatch):
    solved = []
    solve = teacher.kinematics.solve
    monkeypatch.setattr(teacher.kinematics, "solve", lambda target: solved.append(1) or solve(target))
    policy, simulator = TeacherPolicy(teacher), arm.simulator()
    policy.reset(simulator)
    for target in targets(teacher, 2, seed=7):
        for _ in range(5):
            simulator.step(policy.activation(simulator, target))
    assert len(solved) == 2
