"""Limbs: what they select of a body, that they see the same on every body, and what they refuse."""

import mujoco
import numpy as np
import pytest

from anthro.body.parts import twin_name
from anthro.errors import UserError
from anthro.motor.limb import SLACK, Limb, limb_plan
from anthro.motor.senses import SENSES

# limb: muscles, driven joints, held ones, yielding ones, components of the discrepancy
COUNTS = {
    "right_arm": (29, 7, 0, 0, 3),
    "left_arm": (29, 7, 0, 0, 3),
    "right_leg": (39, 7, 0, 1, 3),
    "left_leg": (39, 7, 0, 1, 3),
    "neck_seated": (216, 21, 0, 0, 2),
    "neck": (244, 21, 0, 0, 2),
    "core": (443, 63, 49, 0, 3),
}
VIEWS = [
    *((name, "nakada2018") for name in ("right_arm", "left_arm", "right_leg", "left_leg", "neck_seated")),
    *((name, "whole_fixed") for name in ("right_arm", "left_arm", "right_leg", "left_leg", "neck")),
    ("right_arm", "zhou2021"),
]


@pytest.mark.parametrize("name", COUNTS)
def test_counts(limb, name):
    """Nakada et al. 2018, Sec. 3, and Zhou et al. 2021, Sec. 3: 29 and 39 muscles a limb, 216 of the neck, 443."""
    its = limb(name)
    muscles, driven, held, yielding, width = COUNTS[name]
    assert (its.size, len(its.driven), its.width) == (muscles, driven, width)
    assert len(its.passive) == held + yielding and its.torques == driven + held == len(its.slack)
    assert its.is_alone == (its.body.muscle_count == muscles)
    names = its.body.dof_names
    assert not any(names[i].startswith(("rib", "sternum", "patella")) for i in its.driven)
    assert all(names[i].startswith("patella_") for i in its.passive[held:])
    assert len(np.unique(np.concatenate([its.driven, its.passive]))) == driven + held + yielding


def test_the_six_limbs_of_the_whole_body_share_no_muscle_and_leave_none(limb):
    names = ("core", "neck", "right_arm", "left_arm", "right_leg", "left_leg")
    taken = np.concatenate([limb(name, "whole_fixed").muscles for name in names])
    assert sorted(taken) == list(range(823))
    joints = np.concatenate([[*its.driven, *its.passive] for its in (limb(name, "whole_fixed") for name in names)])
    assert sorted(joints) == list(range(163))


@pytest.mark.parametrize("name", COUNTS)
def test_columns_and_rows_are_the_bodys_velocities(limb, name):
    its = limb(name)
    first = its.body.model.nv - its.body.dof_count
    ordered = [*its.columns, *its.passive_columns]
    assert [its.body.velocity_names[i] for i in ordered] == [its.body.dof_names[i - first] for i in ordered]
    np.testing.assert_array_equal(its.rows[ordered], np.arange(len(ordered)))
    assert (np.delete(its.rows, ordered) < 0).all()


def test_soft_joints_and_reluctant_ones(limb):
    core = limb("core")
    names = [core.body.dof_names[i] for i in [*core.driven, *core.passive]]
    for name, slack in zip(names, core.slack, strict=True):
        assert slack == (0.3 if name.startswith(("rib", "sternum", "clavicle", "scapula")) else SLACK)
    bending = core.bending / core.half_range
    for i, share in zip(core.driven, bending, strict=True):
        assert share == pytest.approx(0.5 if core.body.dof_names[i].startswith("T") else 1.0)


def test_the_girdle_is_held_and_led_nowhere(limb):
    core = limb("core")
    names = [core.body.dof_names[i] for i in core.driven]
    assert [n for n, led in zip(names, core.led, strict=True) if not led] == [
        n for n in names if n.startswith(("clavicle", "scapula"))
    ]
    assert limb("right_arm").led.all()


@pytest.mark.parametrize("name", ["neck_seated", "core"])
def test_twins_are_the_other_sides_muscles(limb, name):
    its = limb(name)
    names = [its.body.muscle_names[i] for i in its.muscles]
    assert [names[k] for k in its.twins] == [twin_name(n) if twin_name(n) in names else n for n in names]
    np.testing.assert_array_equal(its.twins[its.twins], np.arange(its.size))
    assert (its.twins != np.arange(its.size)).sum() > 0.9 * its.size


@pytest.mark.parametrize(("name", "body"), VIEWS)
def test_a_limb_sees_on_a_larger_body_what_it_saw_on_its_own(limb, name, body):
    """Same muscles in the same order, same strains and rates at the same angles, same discrepancy from any base."""
    own, other = limb(name), limb(name, body)
    muscles = [[its.body.muscle_names[i] for i in its.muscles] for its in (own, other)]
    joints = [[its.body.dof_names[i] for i in [*its.driven, *its.passive]] for its in (own, other)]
    assert muscles[0] == muscles[1] and joints[0] == joints[1]
    rng, seen = np.random.default_rng(4), []
    angles = own.random_pose(0.8, rng)
    passive, rates = rng.uniform(*own.body.q_range[own.passive].T), rng.normal(size=len(joints[0]))
    shift = rng.normal(size=3)
    for its in (own, other):
        simulator = its.body.simulator()
        qpos, qvel = simulator.qpos.copy(), np.zeros(its.body.model.nv)
        hinges = qpos[its.body.model.nq - its.body.dof_count :]
        hinges[:] = its.with_angles(hinges, angles)
        hinges[its.passive] = passive
        qvel[[*its.columns, *its.passive_columns]] = rates
        simulator.reset(qpos, qvel)
        rotation = simulator.data.xmat[its.base].reshape(3, 3)
        feature = its.feature(simulator.data)
        target = feature + rotation @ shift if its.plan.senses == "position" else rotation @ [1.0, 0.0, 0.0]
        seen.append((*its.strains(simulator), its.offset(simulator.data, target)))
        assert its.distance(simulator.data, target) == pytest.approx(np.linalg.norm(seen[-1][2]))
    for one, two, tolerance in zip(*seen, (1e-7, 1e-5, 1e-9), strict=True):
        np.testing.assert_allclose(two, one, atol=tolerance)


def test_activations_among_the_bodys(limb):
    its = limb("left_leg", "nakada2018")
    activation = its.into(np.full(352, 0.5), np.linspace(0.0, 1.0, 39))
    np.testing.assert_array_equal(activation[its.muscles], np.linspace(0.0, 1.0, 39))
    assert (np.delete(activation, its.muscles) == 0.5).all()


@pytest.mark.parametrize("name", ["right_leg", "neck_seated", "core"])
def test_random_poses_keep_to_their_share(limb, name):
    its, rng = limb(name), np.random.default_rng(0)
    poses = np.array([its.random_pose(0.6, rng) for _ in range(300)])
    shares = (poses - 0.5 * (its.low + its.high)) / its.half_range
    assert np.abs(shares).max() <= 0.6 + 1e-12 and np.abs(shares).max() > 0.55
    near = np.array([its.near(its.high, 0.1, rng) for _ in range(300)])
    assert (near >= its.low).all() and (near <= its.high).all()
    assert np.std((near - its.high) / its.half_range) == pytest.approx(0.1 * np.sqrt(0.5 - 0.5 / np.pi), rel=0.1)


def test_a_spines_joints_bend_together(limb):
    """Joints of a chain have most of their deviation in common; those of an arm have nothing."""
    for name, together in (("core", True), ("neck_seated", True), ("right_arm", False)):
        its, rng = limb(name), np.random.default_rng(0)
        shares = np.array([its.random_pose(1.0, rng) for _ in range(400)]) - 0.5 * (its.low + its.high)
        names = [its.body.dof_names[i] for i in its.driven]
        chain = [k for k, n in enumerate(names) if n.endswith("_flexion") and n[1].isdigit()] if together else [0, 3, 6]
        assert len(chain) > 2
        correlation = np.corrcoef(shares[:, chain].T)[np.triu_indices(len(chain), 1)]
        assert correlation.min() > 0.8 if together else np.abs(correlation).max() < 0.2


def test_mirrored_limbs_mirror_the_discrepancy(limb):
    """The left arm's controller may be the right one's: y of what it senses changes its sign."""
    right, left = limb("right_arm"), limb("left_arm")
    offsets = []
    for its, sign in ((right, 1.0), (left, -1.0)):
        simulator = its.body.simulator()
        simulator.reset(its.body.q_rest)
        offsets.append(its.offset(simulator.data, np.array([0.3, -0.2 * sign, 1.1])))
    np.testing.assert_allclose(offsets[1], offsets[0] * SENSES["position"].mirror, atol=1e-9)


@pytest.mark.parametrize(
    ("change", "told"),
    [
        ({"side": "front"}, "side 'front' or senses 'position' is unknown"),
        ({"senses": "smell"}, "senses 'smell' is unknown"),
        ({"region": "leg"}, "has no right_arm"),
        ({"side": "left"}, "has no right_arm"),
        ({"base": "moon"}, "bone 'moon' are missing"),
        ({"effector": "foot_r"}, "right_arm has no effector 'foot_r'; it has: "),
        ({"flavour": "sweet"}, "limb right_arm: .*flavour"),
    ],
)
def test_what_does_not_fit_is_refused(load_body, limb_keys, change, told):
    with pytest.raises(UserError, match=told):
        Limb(limb_plan(limb_keys("right_arm") | change), load_body("right_arm"))


def test_missing_keys_are_refused(limb_keys):
    keys = limb_keys("core")
    del keys["base"]
    with pytest.raises(UserError, match="limb core: .*base"):
        limb_plan(keys)


def test_every_base_and_effector_is_there(limb):
    for name in COUNTS:
        its = limb(name)
        assert mujoco.mj_id2name(its.body.model, mujoco.mjtObj.mjOBJ_BODY, its.base) == its.plan.base
        assert its.site == its.body.effectors[its.plan.effector]
