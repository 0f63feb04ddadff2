"""What a limb senses on a body whose other joints move too, and how fast it corrects."""

import numpy as np
import pytest

from anthro.motor.carried import CarriedController
from anthro.motor.controller import NeuromuscularController


@pytest.fixture
def neck(limb):
    return limb("neck", "whole_fixed")


class Says:
    """In place of a network: one answer for each muscle."""

    def __init__(self, inputs, outputs, value):
        self.n_in, self._answer = inputs, np.full(outputs, value)

    def predict(self, x):
        assert len(x) == self.n_in
        return self._answer


def made(kind, limb, pace=1.0):
    return kind(limb, Says(limb.width + 2 * limb.size, limb.size, 0.04), Says(2 * limb.size, limb.size, 0.01), pace)


def test_the_limbs_own_joints_tell_its_strains(neck):
    """Moved by its own joints alone, it senses what its muscles do; moved by others too, it senses the same."""
    body, rng = neck.body, np.random.default_rng(0)
    own = np.concatenate([neck.driven, neck.passive])
    other = np.setdiff1d(np.arange(body.dof_count), own)
    q, v = body.q_rest.copy(), np.zeros(body.dof_count)
    q[own] += 0.1 * rng.normal(size=len(own))
    v[own] = rng.normal(size=len(own))
    simulator, controller = body.simulator(), made(CarriedController, neck)
    simulator.reset(q, v)
    alone = neck.strains(simulator)
    np.testing.assert_array_equal(controller.strains(simulator), alone)
    q[other] += 0.05 * rng.normal(size=len(other))
    v[other] = rng.normal(size=len(other))
    simulator.reset(q, v)
    np.testing.assert_array_equal(controller.strains(simulator), alone)
    assert np.abs(neck.strains(simulator)[0] - alone[0]).max() > 0.01
    assert np.abs(neck.strains(simulator)[1] - alone[1]).max() > 0.1


@pytest.mark.parametrize("kind", [NeuromuscularController, CarriedController])
@pytest.mark.parametrize("pace", [1.0, 0.25])
def test_the_pace_slows_the_voluntary_network_alone(neck, kind, pace):
    simulator, controller = neck.body.simulator(), made(kind, neck, pace)
    controller.reset(simulator, np.full(neck.size, 0.3))
    controller.activation(simulator, neck.feature(simulator.data))
    np.testing.assert_allclose(controller.drive, 0.3 + pace * 0.04 + 0.01)
