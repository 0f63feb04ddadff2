"""Several limbs on one body: who moves what."""

import numpy as np
import pytest

from anthro.errors import UserError
from anthro.motor.controller import NeuromuscularController
from anthro.motor.limb import Limb, limb_plan
from anthro.motor.system import MotorSystem

LIMBS = ("right_arm", "left_leg", "neck_seated")


@pytest.fixture
def policies(limb, tiny_nets):
    """Function of limbs and body: a controller of random networks for each of them."""

    def load(names=LIMBS, body="nakada2018"):
        return {
            name: NeuromuscularController.load(
                limb(name, body),
                tiny_nets / f"{name}_voluntary_proprioceptive" / "weights.h5",
                tiny_nets / f"{name}_reflex" / "weights.h5",
                "proprioceptive",
            )
            for name in names
        }

    return load


def aims(system, simulator):
    """A target for each limb, a little off where it is."""
    shift = {"position": np.array([0.05, 0.0, 0.05]), "gaze": np.array([0.0, 0.3, 0.1])}
    return {
        name: policy.limb.feature(simulator.data) + shift[policy.limb.plan.senses]
        for name, policy in system.policies.items()
    }


def run(body, policies, targets=None, steps=10):
    """Activations (steps, n) and the simulator after some steps."""
    system, simulator = MotorSystem(body, policies), body.simulator()
    system.reset(simulator, {name: np.full(policy.limb.size, 0.05) for name, policy in system.policies.items()})
    targets = aims(system, simulator) if targets is None else targets
    rows = []
    for _ in range(steps):
        rows.append(system.activation(simulator, targets).copy())
        simulator.step(rows[-1])
    return np.array(rows), simulator


def test_limbs_act_as_they_do_alone(load_body, policies):
    """Each limb's activations are its controller's; muscles of no limb are limp."""
    body = load_body("nakada2018")
    simulator = body.simulator()
    system, alone = MotorSystem(body, policies()), policies()
    system.reset(simulator)
    targets = aims(system, simulator)
    together = system.activation(simulator, targets)
    taken = []
    for name, policy in alone.items():
        policy.reset(simulator)
        np.testing.assert_array_equal(together[policy.limb.muscles], policy.activation(simulator, targets[name]))
        taken.append(policy.limb.muscles)
    assert not np.delete(together, np.concatenate(taken)).any()


def test_limbs_without_a_target_are_limp(load_body, policies):
    rows, _ = run(load_body("nakada2018"), policies(), {"neck_seated": np.array([1.0, 0.2, 0.0]), "left_leg": None})
    limbs = {name: policy.limb.muscles for name, policy in policies().items()}
    assert rows[:, limbs["neck_seated"]].any()
    assert not rows[:, limbs["left_leg"]].any() and not rows[:, limbs["right_arm"]].any()


def test_the_order_of_limbs_does_not_matter(load_body, policies):
    body = load_body("nakada2018")
    rows, simulator = run(body, policies())
    again, other = run(body, policies(LIMBS[::-1]))
    assert rows.tobytes() == again.tobytes() and simulator.qpos.tobytes() == other.qpos.tobytes()


def test_shared_muscles_are_refused(load_body, policies, limb):
    both = policies(("right_arm",)) | {"second": policies(("right_arm",))["right_arm"]}
    with pytest.raises(UserError, match="nakada2018: right_arm, second share muscles"):
        MotorSystem(load_body("nakada2018"), both)


def test_a_controller_of_another_body_is_refused(load_body, policies):
    with pytest.raises(UserError, match="right_arm: its controller is for right_arm, not for nakada2018"):
        MotorSystem(load_body("nakada2018"), policies(("right_arm",), None))


def test_a_moved_copy_of_the_body_is_the_same_body(load_body, limb_keys, policies):
    """Chairs that tilt move a copy; limbs of that copy act as those of the body."""
    moved = load_body("nakada2018").movable()
    moved.model.body_pos[1] += (0.3, 0.0, 0.1)
    shifted = policies(("left_leg",))
    shifted["left_leg"].limb = Limb(limb_plan(limb_keys("left_leg")), moved)
    rows, simulator = run(moved, shifted)
    wanted, still = run(load_body("nakada2018"), policies(("left_leg",)))
    np.testing.assert_allclose(rows, wanted, atol=1e-5)
    np.testing.assert_allclose(simulator.qpos, still.qpos, atol=1e-6)


def test_drives_begin_where_they_are_told(load_body, policies):
    body = load_body("nakada2018")
    system, simulator = MotorSystem(body, policies()), body.simulator()
    system.reset(simulator, {"right_arm": np.full(29, 0.3)})
    drives = {name: policy.drive for name, policy in system.policies.items()}
    assert (drives["right_arm"] == 0.3).all() and not drives["left_leg"].any()


def test_a_network_of_another_limb_is_refused_by_name(limb, tiny_nets):
    weights = tiny_nets / "right_leg_voluntary_paper" / "weights.h5"
    with pytest.raises(UserError, match="weights.h5.* but 32 and 29 are needed"):
        NeuromuscularController.load(limb("right_arm"), weights, None, "paper")
