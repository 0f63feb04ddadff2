"""The online path is networks only: no inverse kinematics, inverse dynamics or optimisation."""

import ast
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from anthro import registry
from anthro.demos.attempt import Staged, attempt, hold
from anthro.demos.session import Session, advance
from anthro.motor import controller as controller_module
from anthro.motor import dynamics, effort, kinematics, teacher
from anthro.motor.controller import NeuromuscularController
from anthro.motor.kinematics import InverseKinematics
from anthro.motor.reflex import DRIVE_RANGE, reflex_adjustment
from anthro.motor.system import MotorSystem
from anthro.motor.teacher import StaticPosture, Teacher

OFFLINE = ("kinematics", "dynamics", "effort", "teacher", "qp_solvers", "compare_solvers", "rollouts", "postures")
FORBIDDEN = [f"anthro.motor.{name}" for name in OFFLINE]
FORBIDDEN += ["torch", "scipy.optimize", "proxsuite", "osqp", "piqp", "daqp"]
TARGET = np.array([0.2, -0.2, 1.1])
SENSED = {"site_xpos", "site_xmat", "xmat"}  # of MuJoCo's data: where the effector and the limb's base are
LIMBS = ("core", "neck", "right_arm", "left_arm", "right_leg", "left_leg")


def test_the_controller_imports_nothing_of_the_teacher():
    code = "import anthro.motor.controller, anthro.motor.system, sys; print(*sys.modules)"
    source = Path(controller_module.__file__).parents[2]
    found = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True, env={"PYTHONPATH": str(source)}
    )
    modules = found.stdout.split()
    assert "anthro.motor.network" in modules
    assert not [name for name in modules if name in FORBIDDEN or name.startswith("torch.")]


def test_the_controller_imports_nothing_late():
    """No import hides in a function of the modules on the path."""
    folder = Path(controller_module.__file__).parent
    for name in ("controller", "network", "reflex", "limb", "senses", "system"):
        tree = ast.parse((folder / f"{name}.py").read_text())
        inner = [node for f in ast.walk(tree) if isinstance(f, ast.FunctionDef) for node in ast.walk(f)]
        assert not [node for node in inner if isinstance(node, (ast.Import, ast.ImportFrom))]


@pytest.fixture
def load(tiny_nets, limb):
    """Function of inputs and reflex: the right arm's controller of tiny networks."""

    def load(inputs, with_reflex=True):
        name = f"right_arm_voluntary_{inputs}"
        reflex = tiny_nets / "right_arm_reflex" / "weights.h5" if with_reflex else None
        return NeuromuscularController.load(limb("right_arm"), tiny_nets / name / "weights.h5", reflex, inputs)

    return load


def solved(*args, **kwargs):
    raise AssertionError("the online path solved a problem")


def forbid(monkeypatch):
    """Whatever the teacher would solve raises from now on."""
    for owner, names in {
        InverseKinematics: ("solve", "_descend"),
        StaticPosture: ("drive", "moved", "place"),
        Teacher: ("voluntary", "aim", "lacks"),
        effort: ("solve", "minimal_effort"),
        teacher: ("solve", "effort_problem", "pose_acceleration"),
        kinematics: ("_pose_step",),
        dynamics: ("effort_problem", "torque_problem", "pose_acceleration", "required_torque"),
    }.items():
        for name in names:
            monkeypatch.setattr(owner, name, solved)


def systems(limb, policy):
    return MotorSystem(limb.body, {limb.name: policy})


@pytest.mark.parametrize("inputs", registry.INPUTS)
@pytest.mark.parametrize("with_reflex", [True, False])
def test_fifty_steps_solve_nothing(limb, load, monkeypatch, inputs, with_reflex):
    arm = limb("right_arm")
    system, simulator = systems(arm, load(inputs, with_reflex)), arm.body.simulator()
    system.reset(simulator)
    forbid(monkeypatch)
    error = advance(simulator, system, {"right_arm": TARGET}, 50 * simulator.step_seconds)["right_arm"]
    assert len(error) == 50 and np.isfinite(error).all()
    assert simulator.time == pytest.approx(0.25)


@pytest.mark.parametrize("inputs", registry.INPUTS)
def test_the_whole_body_is_moved_by_networks_alone(run_folder, monkeypatch, inputs):
    session = Session.open(run_folder, "whole_fixed")
    system = session.system(list(LIMBS), inputs)
    simulator = session.begin(system)
    forbid(monkeypatch)
    targets = {name: session.limb(name).feature(simulator.data) for name in LIMBS}
    error = advance(simulator, system, targets, 0.1)
    assert error.keys() == set(LIMBS) and all(np.isfinite(one).all() for one in error.values())


def test_attempts_and_holding_solve_nothing(run_folder, monkeypatch):
    """Nor does what is measured of them, nor what the rest of the body does beside the core."""
    monkeypatch.setattr("anthro.demos.attempt.HOLD_SECONDS", 0.1)
    session = Session.open(run_folder, "whole_fixed")
    core = session.limb("core")
    system = Staged(session.body, {"core": session.controller("core")}, session.others("core", 7, "core"))
    simulator = session.begin(system)
    forbid(monkeypatch)
    rest = core.feature(simulator.data)
    assert attempt(simulator, system, core, [rest], "core").distance.shape == (1, 600)
    assert np.isfinite(hold(simulator, system, core, rest)).all()


def test_the_guard_would_notice(limb, monkeypatch):
    patient = Teacher(limb("right_arm"), 0.005)
    forbid(monkeypatch)
    with pytest.raises(AssertionError, match="solved a problem"):
        patient.aim(TARGET)


def test_the_controller_senses_offset_drive_strain_and_strain_rate_only(limb, load):
    """What it reads of a simulator is strains, their rates, and where effector and base are."""
    simulator = limb("right_arm").body.simulator()

    class Data:
        def __getattr__(self, name):
            assert name in SENSED, name
            return getattr(simulator.data, name)

    senses = SimpleNamespace(strain=simulator.strain, strain_rate=simulator.strain_rate, data=Data())
    policy = load("proprioceptive")
    policy.reset(senses)
    assert policy.activation(senses, TARGET).shape == (29,)


def test_equation_1_by_hand(arm, load):
    """a + (da_v + da_r), the networks' outputs added; activations clipped, the drive not."""
    policy, rng = load("paper"), np.random.default_rng(1)
    simulator = arm.simulator()
    drive = rng.uniform(-1.0, 2.0, 29)
    policy.reset(simulator, drive)
    before, rate_before = simulator.strain, simulator.strain_rate
    offset, strain, rate = rng.normal(0.0, 0.1, 3), before + 0.01, rate_before + 0.3
    voluntary = policy.voluntary.predict(np.r_[offset, drive])
    adjustment = policy.reflex.predict(np.r_[strain - before, rate - rate_before])
    activation = policy.control(offset, strain, rate)
    wanted = np.clip(drive + voluntary + adjustment, *DRIVE_RANGE)
    np.testing.assert_allclose(policy.drive, wanted, atol=1e-6)
    np.testing.assert_allclose(activation, np.clip(wanted, 0.0, 1.0), atol=1e-6)


class ExactReflex:
    """Stands in for a perfectly trained reflex network."""

    def predict(self, change):
        return reflex_adjustment(*np.split(change, 2))


class SaysNothing:
    """A voluntary network that has nothing to say."""

    def __init__(self, limb):
        self.n_in, self.n_out = limb.width + limb.size, limb.size

    def predict(self, sensed):
        return np.zeros(self.n_out)


@pytest.mark.parametrize(("name", "change"), [("right_arm", 0.0), ("right_arm", 0.1), ("neck", 0.0)])
def test_the_accumulated_reflex_alone_holds_a_limb(limb, name, change):
    """Without any voluntary command a pose that the muscles can hold stays: what makes the scheme work at all."""
    held = limb(name)
    patient = Teacher(held, 0.005)
    pose = patient.settled(held.with_angles(held.body.q_rest, held.body.q_rest[held.driven] + change))
    simulator = held.body.simulator()
    system = systems(held, NeuromuscularController(held, SaysNothing(held), ExactReflex()))
    simulator.reset(pose)
    system.reset(simulator, {name: patient.holding_state(pose)[0]})
    error = advance(simulator, system, {name: held.feature(simulator.data)}, 1.0)[name]
    assert error[-1] < 1e-3


def test_same_networks_same_bytes(limb, load):
    ends, arm = [], limb("right_arm")
    for _ in range(2):
        policy, simulator = load("proprioceptive"), arm.body.simulator()
        system = systems(arm, policy)
        system.reset(simulator)
        advance(simulator, system, {"right_arm": TARGET}, 0.5)
        ends.append(simulator.qpos.tobytes() + policy.drive.tobytes())
    assert ends[0] == ends[1]


def test_a_limb_on_the_seated_body_moves_as_by_itself(limb, tiny_nets):
    """The torso is welded: what the other limbs do is not felt."""
    ends = []
    for body in ("right_arm", "nakada2018"):
        arm = limb("right_arm", body)
        nets = [tiny_nets / f"right_arm_{role}" / "weights.h5" for role in ("voluntary_paper", "reflex")]
        system, simulator = systems(arm, NeuromuscularController.load(arm, *nets, "paper")), arm.body.simulator()
        system.reset(simulator)
        start = simulator.effector_position("hand_r")  # the seated body is lower
        advance(simulator, system, {"right_arm": start + [0.1, 0.1, 0.1]}, 0.5)
        ends.append(simulator.effector_position("hand_r") - start)
    np.testing.assert_allclose(*ends, atol=1e-6)
