"""The teacher in closed loop: it reaches, points, holds and takes a push."""

import numpy as np
import pytest

from anthro.body.simulator import DEFAULT_STEP
from anthro.demos.criterion import TASKS
from anthro.demos.quality import Gauge
from anthro.demos.session import advance, settled
from anthro.motor.system import MotorSystem
from anthro.motor.targets import Targets
from anthro.motor.teacher import Gains, Teacher, TeacherPolicy


@pytest.fixture
def begun(limb, data_spec):
    """Function of a limb and a label rule: its teacher with the gains of its data, the system and its simulator."""

    def begun(name, rule="equilibrium"):
        moved = limb(name)
        patient = Teacher(moved, DEFAULT_STEP, Gains(**data_spec("voluntary", name)["teacher"]), rule)
        simulator, system = moved.body.simulator(), MotorSystem(moved.body, {name: TeacherPolicy(patient)})
        simulator.reset(patient.settled(moved.body.q_rest))
        system.reset(simulator)
        return patient, system, simulator

    return begun


def drawn(patient, share, count, seed):
    targets = Targets(patient, share, np.random.default_rng(seed))
    return [targets.draw()[0] for _ in range(count)]


@pytest.mark.parametrize("name", ["right_arm", "left_leg"])
def test_teacher_reaches_random_targets_one_after_the_other(begun, name):
    """1.5 s each; the last 0.25 s within 3 cm in the mean, as the demo asks."""
    patient, system, simulator = begun(name)
    task = TASKS["position"]
    for target in drawn(patient, task.share, 4, seed=0):
        assert settled(advance(simulator, system, {name: target}, task.seconds)[name]) < task.radius


def test_teacher_points_the_head(begun):
    patient, system, simulator = begun("neck")
    task = TASKS["gaze"]
    errors = [
        settled(advance(simulator, system, {"neck": target}, task.seconds)["neck"])
        for target in drawn(patient, task.share, 5, seed=0)
    ]
    assert np.mean(np.array(errors) < task.radius) >= 0.8


def test_ribs_do_not_chatter_under_the_reflex(begun):
    """Held upright for a second by the teacher, the core's activations come to rest."""
    patient, system, simulator = begun("core")
    target, gauge = patient.limb.feature(simulator.data), Gauge(simulator, patient.limb)
    system.reset(simulator, {"core": patient.holding_state(simulator.joint_angles)[0]})
    advance(simulator, system, {"core": target}, 1.0, gauge)
    assert np.sqrt(np.mean(gauge.change[-20:])) < 1.0  # 1/s; 10 with a tenth of the ribs' damping


class Activations:
    """Keeps the activations of each control step."""

    def __init__(self):
        self.found = []

    def take(self, activation, targets, controller_on=True):
        self.found.append(activation.copy())


@pytest.mark.parametrize("name", ["right_leg", "right_arm", "neck_seated"])
def test_no_joint_chatters_under_the_reflex_of_a_limb_that_moves(begun, name):
    """Activations change on from step to step: correlation 0.9; -0.5 to -0.9 with a third of the foot's damping."""
    patient, system, simulator = begun(name)
    for seed in (0, 2, 8):
        activations = Activations()
        advance(simulator, system, {name: drawn(patient, 0.7, 1, seed)[0]}, 1.5, activations)
        change = np.diff(np.array(activations.found), axis=0)
        assert (change[1:] * change[:-1]).sum() > 0.5 * (change**2).sum()


def test_teacher_bends_the_trunk(begun):
    """Two targets, 3 s each, the head, arms and legs limp: T1 ends within 6 degrees of its orientation."""
    patient, system, simulator = begun("core")
    for target in drawn(patient, 0.4, 2, seed=1):
        error = advance(simulator, system, {"core": target}, 3.0)["core"]
        assert np.rad2deg(settled(error)) < 6.0


def test_teacher_holds_and_comes_back_from_a_push(begun):
    patient, system, simulator = begun("right_arm")
    target = patient.kinematics.feature(patient.limb.body.q_rest + 0.1)
    advance(simulator, system, {"right_arm": target}, 1.5)
    before = simulator.effector_position("hand_r")
    simulator.push((0.0, 20.0, 0.0), "hand_r")
    pushed = advance(simulator, system, {"right_arm": target}, 0.1)["right_arm"]
    simulator.push((0.0, 0.0, 0.0), "hand_r")
    advance(simulator, system, {"right_arm": target}, 1.0)
    assert pushed.max() > 0.005
    assert np.linalg.norm(simulator.effector_position("hand_r") - before) < 0.01


def test_appendix_b_rule_reaches_when_the_teacher_itself_acts(begun):
    patient, system, simulator = begun("right_arm", "appendix_b")
    for target in drawn(patient, 0.7, 2, seed=0):
        assert settled(advance(simulator, system, {"right_arm": target}, 1.5)["right_arm"]) < 0.03


def test_an_unreachable_target_is_approached_without_harm(begun):
    patient, system, simulator = begun("right_arm")
    error = advance(simulator, system, {"right_arm": np.array([3.0, -0.2, 1.2])}, 1.0)["right_arm"]
    assert np.isfinite(error).all() and error[-1] < error[0]
    assert not patient.pose.reached


def test_same_targets_same_bytes(begun):
    ends = []
    for _ in range(2):
        patient, system, simulator = begun("right_arm")
        target = patient.kinematics.feature(patient.limb.body.q_rest + 0.1)
        advance(simulator, system, {"right_arm": target}, 0.5)
        ends.append(simulator.qpos.tobytes() + system.policies["right_arm"].drive.tobytes())
    assert ends[0] == ends[1]
