"""The online path is networks only: no inverse kinematics, inverse dynamics or optimisation."""

import ast
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from anthro.demos import push, reach
from anthro.demos.session import Session, advance
from anthro.motor import controller as controller_module
from anthro.motor import dynamics, effort, kinematics, teacher
from anthro.motor.controller import INPUTS, NeuromuscularController
from anthro.motor.kinematics import InverseKinematics
from anthro.motor.reflex import DRIVE_RANGE, reflex_adjustment
from anthro.motor.teacher import StaticPosture, Teacher

OFFLINE = ("kinematics", "dynamics", "effort", "teacher", "qp_solvers", "compare_solvers", "rollouts", "postures")
FORBIDDEN = [f"anthro.motor.{name}" for name in OFFLINE] + ["torch", "scipy", "proxsuite", "osqp", "piqp", "daqp"]
TARGET = np.array([0.2, -0.2, 1.1])


def test_the_controller_imports_nothing_of_the_teacher():
    code = "import anthro.motor.controller, sys; print(*sys.modules)"
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
    for name in ("controller", "network", "reflex"):
        tree = ast.parse((folder / f"{name}.py").read_text())
        inner = [node for f in ast.walk(tree) if isinstance(f, ast.FunctionDef) for node in ast.walk(f)]
        assert not [node for node in inner if isinstance(node, (ast.Import, ast.ImportFrom))]


@pytest.fixture
def load(tiny_nets, arm):
    def load(inputs, with_reflex=True):
        name = f"right_arm_voluntary_{inputs}"
        reflex = tiny_nets / "right_arm_reflex" / "weights.h5" if with_reflex else None
        return NeuromuscularController.load(tiny_nets / name / "weights.h5", reflex, arm.muscle_count, inputs)

    return load


@pytest.fixture
def forbidden(monkeypatch):
    """Whatever the teacher would solve raises."""

    def solved(*args, **kwargs):
        raise AssertionError("the online path solved a problem")

    monkeypatch.setattr(InverseKinematics, "solve", solved)
    monkeypatch.setattr(InverseKinematics, "_descend", solved)
    monkeypatch.setattr(StaticPosture, "drive", solved)
    monkeypatch.setattr(StaticPosture, "problem", solved)
    monkeypatch.setattr(Teacher, "voluntary", solved)
    for module in (effort, teacher):
        monkeypatch.setattr(module, "solve", solved)
    monkeypatch.setattr(effort, "minimal_effort", solved)
    monkeypatch.setattr(kinematics, "_pose_step", solved)
    for module in (dynamics, teacher):
        monkeypatch.setattr(module, "effort_problem", solved)
        monkeypatch.setattr(module, "pose_acceleration", solved)
    monkeypatch.setattr(dynamics, "required_torque", solved)


@pytest.mark.parametrize("inputs", INPUTS)
@pytest.mark.parametrize("with_reflex", [True, False])
def test_fifty_steps_solve_nothing(arm, load, forbidden, inputs, with_reflex):
    simulator, policy = arm.simulator(), load(inputs, with_reflex)
    policy.reset(simulator)
    error = advance(simulator, policy, TARGET, 50 * simulator.step_seconds)
    assert len(error) == 50 and np.isfinite(error).all()
    assert simulator.time == pytest.approx(0.25)


def test_the_demos_move_the_arm_by_networks_alone(run_folder, forbidden, monkeypatch):
    """What they measure of the networks; targets are hand positions of drawn poses, no problem solved."""
    monkeypatch.setattr(reach, "SECONDS", 0.3)
    monkeypatch.setattr(push, "WATCH_SECONDS", 0.3)
    session = Session.open(run_folder, "right_arm")
    targets = reach.random_targets(session, 2, seed=7)
    for inputs in INPUTS:
        assert reach.reach(session, session.controller(inputs), targets, inputs).shape == (2, 60)
        metrics, _ = push.measure(session, inputs, targets, seed=7)
        assert metrics["pushes"] == 2


def test_the_guard_would_notice(arm, forbidden):
    with pytest.raises(AssertionError, match="solved a problem"):
        Teacher(arm, 0.005).aim(TARGET)


def test_the_controller_senses_offset_drive_strain_and_strain_rate_only(arm, load):
    """What it reads of a simulator is three properties."""
    simulator = arm.simulator()
    allowed = {"strain", "strain_rate", "hand_position"}

    class Senses:
        def __getattr__(self, name):
            assert name in allowed, name
            return getattr(simulator, name)

    policy = load("proprioceptive")
    policy.reset(Senses())
    assert policy.activation(Senses(), TARGET).shape == (29,)


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
        return reflex_adjustment(change[:29], change[29:])


class Silent:
    """A voluntary network that says nothing."""

    n_in, n_out = 32, 29

    def predict(self, sensed):
        return np.zeros(29)


def test_the_accumulated_reflex_alone_holds_the_arm(arm):
    """Without any voluntary command a pose stays: what makes the scheme work at all."""
    hold = Teacher(arm, 0.005)
    for pose in (arm.q_rest, arm.q_rest + 0.1):
        simulator, policy = arm.simulator(), NeuromuscularController(Silent(), ExactReflex())
        simulator.reset(pose)
        policy.reset(simulator, hold.holding_state(pose)[0])
        start = simulator.hand_position
        advance(simulator, policy, start, 1.0)
        assert np.linalg.norm(simulator.hand_position - start) < 0.01


def test_same_networks_same_bytes(arm, load):
    ends = []
    for _ in range(2):
        simulator, policy = arm.simulator(), load("proprioceptive")
        policy.reset(simulator)
        advance(simulator, policy, TARGET, 0.5)
        ends.append(simulator.qpos.tobytes() + policy.drive.tobytes())
    assert ends[0] == ends[1]
