"""What the rest of the body does beside one limb."""

import numpy as np
import pytest

from anthro.motor.others import Company, Others
from anthro.motor.reflex import STRAIN_GAIN

COMPANY = Company(pose_share=0.4, travel_seconds=(0.05, 0.05), tone=0.05)


@pytest.fixture
def beside(limb):
    """Function of the company: others beside the right leg of the seated body, and a simulator."""

    def make(company, seed=0):
        its = limb("right_leg", "nakada2018")
        return Others(its, company, np.random.default_rng(seed)), its.body.simulator()

    return make


def rest_of(others):
    return np.setdiff1d(np.arange(others.limb.body.muscle_count), others.limb.muscles)


def test_a_limb_that_is_alone_has_no_others(limb):
    others = Others(limb("right_leg"), COMPANY, np.random.default_rng(0))
    simulator = limb("right_leg").body.simulator()
    others.begin(simulator)
    assert not others.activation(simulator).any()


def test_postures_leave_the_limb_at_rest(beside):
    others, _ = beside(COMPANY)
    its = others.limb
    own = np.concatenate([its.driven, its.passive])
    elsewhere = np.setdiff1d(np.arange(its.body.dof_count), own)
    poses = np.array([others.pose() for _ in range(200)])
    np.testing.assert_array_equal(poses[:, own], np.tile(its.body.q_rest[own], (200, 1)))
    low, high = its.body.q_range[elsewhere].T
    away = poses[:, elsewhere] - its.body.q_rest[elsewhere]
    assert (poses[:, elsewhere] >= low).all() and (poses[:, elsewhere] <= high).all()
    assert np.abs(away / (0.5 * (high - low))).max() == pytest.approx(0.4, abs=0.01)
    still, _ = beside(None)
    np.testing.assert_array_equal(still.pose(), its.body.q_rest)


def test_postures_keep_the_limb_where_it_is(beside):
    others, _ = beside(COMPANY)
    its = others.limb
    own = np.concatenate([its.driven, its.passive])
    elsewhere = np.setdiff1d(np.arange(its.body.dof_count), own)
    present = its.body.q_rest + np.linspace(0.01, 0.2, its.body.dof_count)
    poses = np.array([others.pose(present) for _ in range(200)])
    np.testing.assert_array_equal(poses[:, own], np.tile(present[own], (200, 1)))
    low, high = its.body.q_range[elsewhere].T
    away = np.abs(poses[:, elsewhere] - its.body.q_rest[elsewhere]) / (0.5 * (high - low))
    assert away.max() == pytest.approx(0.4, abs=0.01)


def test_thresholds_travel_to_where_the_limb_is_now(beside):
    """The limb bent away from its rest after the start: the thresholds end at strains of the bent limb."""
    others, simulator = beside(COMPANY)
    twin = Others(others.limb, COMPANY, np.random.default_rng(0))
    twin.rng.uniform(0.05, 0.05)
    others.begin(simulator)
    q = simulator.qpos.copy()
    q[others.limb.body.dof_names.index("knee_flexion_r")] += 0.4
    simulator.reset(q)
    for _ in range(10):
        last = others.activation(simulator)
    scratch = others.limb.body.simulator()
    scratch.reset(twin.pose(simulator.joint_angles))
    rest = rest_of(others)
    wanted = np.clip(0.05 + STRAIN_GAIN * (simulator.strain - scratch.strain)[rest], 0.0, 1.0)
    np.testing.assert_allclose(last[rest], wanted, atol=1e-9)


def test_thresholds_travel_from_one_postures_strains_to_the_next(beside):
    """Ten steps of 5 ms each way: the body held still, activations are a tone and a stretch beyond the threshold."""
    others, simulator = beside(COMPANY)
    twin = np.random.default_rng(0)  # draws what they draw
    rest = rest_of(others)
    others.begin(simulator)
    here = simulator.strain
    threshold = here.copy()
    scratch = others.limb.body.simulator()
    for _ in range(2):
        twin.uniform(0.05, 0.05)
        copy = Others(others.limb, COMPANY, twin)
        scratch.reset(copy.pose())
        goal, start = scratch.strain, threshold
        for step in range(1, 11):
            threshold = start + step / 10.0 * (goal - start)
            wanted = np.clip(0.05 + STRAIN_GAIN * (here - threshold)[rest], 0.0, 1.0)
            np.testing.assert_allclose(others.activation(simulator)[rest], wanted, atol=1e-9)


def test_the_limbs_own_activations_are_not_touched(beside):
    others, simulator = beside(COMPANY)
    others.begin(simulator)
    its = others.limb
    mine = np.linspace(0.2, 0.9, its.size)
    its.into(others.activation(simulator), mine)
    for _ in range(3):
        activation = others.activation(simulator)
        np.testing.assert_array_equal(activation[its.muscles], mine)
        assert (activation >= 0.0).all() and (activation <= 1.0).all()


def test_without_company_the_others_hold_by_their_reflex_alone(beside):
    """No tone: silent where they are, and they contract when they are stretched."""
    others, simulator = beside(None)
    others.begin(simulator)
    rest = rest_of(others)
    assert not others.activation(simulator)[rest].any()
    before = simulator.strain
    q = simulator.qpos.copy()
    q[others.limb.body.dof_names.index("elbow_flexion_r")] -= 0.3
    simulator.reset(q)
    wanted = np.clip(STRAIN_GAIN * (simulator.strain - before)[rest], 0.0, 1.0)
    np.testing.assert_allclose(others.activation(simulator)[rest], wanted, atol=1e-12)
    assert wanted.max() > 0.05


def test_beginning_again_forgets_where_the_thresholds_were(beside):
    others, simulator = beside(COMPANY)
    others.begin(simulator)
    for _ in range(15):
        others.activation(simulator)
    others.company = None
    others.begin(simulator)
    assert not others.activation(simulator)[rest_of(others)].any()
