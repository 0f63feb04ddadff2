"""Training pairs: shapes, mirrored twins, repeatability, students, bad input, a full disk."""

import errno
import os

import h5py
import numpy as np
import pytest

from anthro.errors import UserError
from anthro.files import digest, read_shard, write_json
from anthro.motor import synthesize, synthesize_reflex
from anthro.motor.controller import NeuromuscularController
from anthro.motor.network import FeedForward
from anthro.motor.reflex import DRIVE_RANGE, reflex_adjustment

REACH = 2.0  # m, no hand is further from a target
PAPER, PROPRIOCEPTIVE, REFLEX = (
    f"{name}/weights.h5"
    for name in ("right_arm_voluntary_paper", "right_arm_voluntary_proprioceptive", "right_arm_reflex")
)
MAINS = {"voluntary": synthesize.main, "reflex": synthesize_reflex.main}


@pytest.fixture
def shard(tmp_path, body_folder, data_spec):
    """Function of role, the shard's name and number, more arguments, the limb: the command line of a small shard."""

    def arguments(role, name="shard0000.h5", number=0, *more, limb="right_arm", pairs=60):
        spec = data_spec(role, limb, pairs=pairs)
        write_json(tmp_path / f"{limb}_{role}.json", spec)
        given = ["--spec", tmp_path / f"{limb}_{role}.json", "--body", body_folder(spec["limb"]["body"])]
        return [str(argument) for argument in [*given, "--out", tmp_path / name, "--shard", number, *more]]

    return arguments


@pytest.fixture
def voluntary(shard):
    return lambda *given, **more: shard("voluntary", *given, **more)


@pytest.fixture
def reflexive(shard):
    return lambda *given, **more: shard("reflex", *given, **more)


def assert_voluntary(columns, spec, width, muscles):
    widths = {"offset": width, "drive": muscles, "strain": muscles, "voluntary": muscles}
    assert {n: values.shape for n, values in columns.items()} == {n: (spec["pairs"], w) for n, w in widths.items()}
    assert all(values.dtype == np.float32 and np.isfinite(values).all() for values in columns.values())
    assert np.linalg.norm(columns["offset"], axis=1).max() < REACH
    assert np.abs(columns["voluntary"]).max() <= np.float32(spec["teacher"]["max_adjustment"])
    assert np.abs(columns["voluntary"]).max() > 1e-3
    assert columns["drive"].min() >= DRIVE_RANGE[0] and columns["drive"].max() <= DRIVE_RANGE[1]


def test_voluntary_shard(tmp_path, voluntary, data_spec):
    assert synthesize.main(voluntary()) == 0
    columns, attrs = read_shard(tmp_path / "shard0000.h5")
    assert_voluntary(columns, data_spec("voluntary"), 3, 29)
    assert attrs["spec_digest"] == digest(data_spec("voluntary")) and attrs["round"] == 0
    assert attrs["targets_drawn"] > attrs["targets_refused"] >= 0 and attrs["falls"] == 0
    assert len(np.unique(columns["offset"], axis=0)) == 60


@pytest.mark.parametrize(("limb", "width", "muscles"), [("left_leg", 3, 39), ("neck_seated", 2, 216)])
def test_shards_of_other_limbs(tmp_path, shard, data_spec, limb, width, muscles):
    for role, main in MAINS.items():
        assert main(shard(role, f"{role}.h5", limb=limb, pairs=12)) == 0
    columns, _ = read_shard(tmp_path / "voluntary.h5")
    assert_voluntary(columns, data_spec("voluntary", limb, pairs=12), width, muscles)
    columns, _ = read_shard(tmp_path / "reflex.h5")
    assert all(values.shape == (12, muscles) for values in columns.values())


def test_core_shards(tmp_path, shard, data_spec, monkeypatch):
    """Few pairs of the core beside a moving head, arms and legs; every other one is the mirror of the one before."""
    spec = data_spec("voluntary", "core", pairs=4)
    spec["postures"]["targets"] = 1
    spec["rollout"] |= {"seconds_per_target": 0.05}
    monkeypatch.setattr(synthesize, "read_json", lambda path: spec)
    for role, main in MAINS.items():
        assert main(shard(role, f"{role}.h5", limb="core", pairs=4)) == 0
    columns, attrs = read_shard(tmp_path / "voluntary.h5")
    assert_voluntary(columns, spec, 3, 443)
    assert attrs["targets_drawn"] >= 1
    columns, _ = read_shard(tmp_path / "reflex.h5")
    assert columns["reflex"].shape == (4, 443)


@pytest.mark.parametrize(("name", "signs"), [("neck_seated", (-1.0, 1.0)), ("neck", (-1.0, 1.0))])
def test_a_midline_limbs_pairs_come_with_their_mirror_images(limb, data_spec, name, signs):
    """Azimuth changes its sign, muscles change sides; nothing else changes."""
    its = limb(name)
    columns, _ = synthesize.synthesize(data_spec("voluntary", name, pairs=10), its, 0, 0, [])
    assert not np.array_equal(its.twins, np.arange(its.size))
    np.testing.assert_array_equal(columns["offset"][1::2], columns["offset"][::2] * np.float32(signs))
    for column in ("drive", "strain", "voluntary"):
        np.testing.assert_array_equal(columns[column][1::2], columns[column][::2][:, its.twins])
    reflexes = synthesize_reflex.synthesize(data_spec("reflex", name, pairs=10), its, 0)
    for values in reflexes.values():
        np.testing.assert_array_equal(values[1::2], values[::2][:, its.twins])


def test_the_teacher_labels_the_mirrored_state_with_the_mirrored_label(limb, data_spec):
    """What the mirror says of a state is what the teacher says of the mirrored state."""
    from anthro.motor.teacher import Gains, Teacher

    its, spec = limb("neck_seated"), data_spec("voluntary", "neck_seated")
    names = [its.body.dof_names[i] for i in its.driven]
    mirror = np.array([-1.0 if name.endswith(("_lateral", "_axial")) else 1.0 for name in names])
    rng, labels, offsets = np.random.default_rng(3), [], []
    angles, goal = its.random_pose(0.4, rng), its.random_pose(0.4, rng)
    drive = rng.uniform(0.0, 0.3, its.size)
    for sign, order in ((np.ones(len(names)), slice(None)), (mirror, its.twins)):
        teacher, simulator = Teacher(its, 0.005, Gains(**spec["teacher"])), its.body.simulator()
        target = teacher.kinematics.feature(sign * goal)
        teacher.aim(target)
        simulator.reset(its.with_angles(its.body.q_rest, sign * angles))
        labels.append(teacher.voluntary(simulator, drive[order]))
        offsets.append(its.offset(simulator.data, target))
    np.testing.assert_allclose(offsets[1], offsets[0] * its.sense.mirror, atol=1e-6)
    np.testing.assert_allclose(labels[1], labels[0][its.twins], atol=2e-3)


def test_reflex_shard_is_equations_4_and_5(tmp_path, reflexive, data_spec):
    assert synthesize_reflex.main(reflexive()) == 0
    columns, attrs = read_shard(tmp_path / "shard0000.h5")
    assert set(columns) == {"strain_change", "strain_rate_change", "reflex"}
    assert all(values.shape == (60, 29) and values.dtype == np.float32 for values in columns.values())
    wanted = reflex_adjustment(columns["strain_change"], columns["strain_rate_change"])
    np.testing.assert_allclose(columns["reflex"], wanted, atol=1e-6)
    assert np.abs(columns["strain_rate_change"]).max() > 0.01
    assert attrs["spec_digest"] == digest(data_spec("reflex"))


@pytest.mark.parametrize("role", MAINS)
def test_same_seed_same_bytes_and_shards_differ(tmp_path, shard, role):
    for name, number in (("a.h5", 0), ("b.h5", 0), ("c.h5", 1)):
        MAINS[role](shard(role, name, number))
    assert (tmp_path / "a.h5").read_bytes() == (tmp_path / "b.h5").read_bytes()
    first, _ = read_shard(tmp_path / "a.h5")
    other, _ = read_shard(tmp_path / "c.h5")
    for name in first:
        assert not np.array_equal(first[name], other[name])


def test_rounds_and_seeds_differ(limb, data_spec):
    spec = data_spec("voluntary", pairs=3)
    offsets = [
        synthesize.synthesize(spec | {"seed": seed}, limb("right_arm"), number, 0, [])[0]["offset"]
        for seed, number in ((7, 0), (7, 1), (8, 0))
    ]
    assert not np.array_equal(offsets[0], offsets[1]) and not np.array_equal(offsets[0], offsets[2])


@pytest.mark.parametrize("name", ["right_arm", "right_leg"])
def test_a_shorter_shard_is_the_beginning_of_a_longer_one(limb, data_spec, name):
    """Memory is constant: pairs are made one after the other, and how many changes none of them."""
    short, long = (
        synthesize.synthesize(data_spec("voluntary", name, pairs=n), limb(name), 0, 0, [])[0] for n in (20, 60)
    )
    for column, values in short.items():
        np.testing.assert_array_equal(values, long[column][:20])


@pytest.mark.parametrize("share", [0.0, 1.0])
def test_pairs_of_rollouts_or_of_single_states_alone(limb, data_spec, share):
    spec = data_spec("voluntary", pairs=40, posture_share=share)
    columns, _ = synthesize.synthesize(spec, limb("right_arm"), 0, 0, [])
    assert all(np.isfinite(values).all() for values in columns.values())
    assert np.abs(columns["voluntary"]).max() > 1e-3
    assert np.linalg.norm(columns["offset"], axis=1).min() < 0.3


def test_an_episode_ends_where_balance_is_lost(limb, data_spec):
    """A support that ends under the body at rest: each episode is one step, and counted."""
    spec = data_spec("voluntary", pairs=4, posture_share=0.0, support=[5.0, 6.0, 5.0, 6.0, 0.0])
    spec["rollout"]["record_every"] = 1
    _, report = synthesize.synthesize(spec, limb("right_arm"), 0, 0, [])
    assert report["falls"] == 3  # the fourth pair is recorded before its step


def test_students_lead_and_the_teacher_labels(tmp_path, tiny_nets, voluntary):
    students = ["--round", "1", "--students", tiny_nets / PAPER, tiny_nets / PROPRIOCEPTIVE]
    for name in ("a.h5", "b.h5"):
        assert synthesize.main(voluntary(name, 0, *students, "--reflex", tiny_nets / REFLEX)) == 0
    assert (tmp_path / "a.h5").read_bytes() == (tmp_path / "b.h5").read_bytes()
    columns, attrs = read_shard(tmp_path / "a.h5")
    assert attrs["round"] == 1 and columns["voluntary"].shape == (60, 29)
    assert all(np.isfinite(values).all() for values in columns.values())


def test_the_input_variant_follows_from_a_students_width(limb, tiny_nets):
    arm, nets = limb("right_arm"), [tiny_nets / PAPER, tiny_nets / PROPRIOCEPTIVE]
    students = synthesize.load_students(arm, nets, tiny_nets / REFLEX)
    assert [student.proprioceptive for student in students] == [False, True]
    assert all(isinstance(student, NeuromuscularController) and student.limb is arm for student in students)
    assert synthesize.load_students(arm, [], None) == []
    with pytest.raises(UserError, match="--students needs --reflex"):
        synthesize.load_students(arm, nets, None)


def test_students_without_reflex_are_refused(tmp_path, tiny_nets, voluntary, refusal):
    line = refusal(synthesize.main, voluntary("out.h5", 0, "--students", tiny_nets / PAPER))
    assert "--students needs --reflex" in line
    assert not (tmp_path / "out.h5").exists()


@pytest.mark.parametrize(("inputs", "outputs"), [(40, 29), (31, 29), (32, 28), (100, 29)])
def test_weights_of_another_shape_are_refused_by_name(tmp_path, tiny_nets, voluntary, refusal, inputs, outputs):
    path = tmp_path / "other.h5"
    FeedForward([np.zeros((outputs, inputs))], [np.zeros(outputs)]).save(path)
    arguments = voluntary("out.h5", 0, "--students", path, "--reflex", tiny_nets / REFLEX)
    assert "other.h5" in refusal(synthesize.main, arguments)
    arguments = voluntary("out.h5", 0, "--students", tiny_nets / PAPER, "--reflex", path)
    assert "other.h5" in refusal(synthesize.main, arguments)
    assert not (tmp_path / "out.h5").exists()


def test_truncated_weights_are_refused_by_name(tmp_path, tiny_nets, voluntary, refusal):
    path = tmp_path / "cut.h5"
    path.write_bytes((tiny_nets / PAPER).read_bytes()[:-500])
    arguments = voluntary("out.h5", 0, "--students", path, "--reflex", tiny_nets / REFLEX)
    assert "cut.h5" in refusal(synthesize.main, arguments)


def test_a_body_of_another_limb_is_refused(body_folder, voluntary, refusal):
    """The left arm's body has no right arm."""
    arguments = voluntary()
    arguments[3] = str(body_folder("left_arm"))
    assert "left_arm has no right_arm" in refusal(synthesize.main, arguments)


def test_missing_spec_or_body_is_refused_by_name(tmp_path, voluntary, reflexive, refusal):
    for main, arguments in ((synthesize.main, voluntary()), (synthesize_reflex.main, reflexive())):
        no_spec = ["--spec", tmp_path / "none.json", *arguments[2:]]
        assert "none.json" in refusal(main, no_spec)
        no_body = [*arguments[:2], "--body", tmp_path / "nobody", *arguments[4:]]
        assert "nobody" in refusal(main, no_body)


def full_disk(*args, **kwargs):
    raise OSError(errno.ENOSPC, "No space left on device")


@pytest.mark.parametrize("where", ["open", "write", "rename"])
@pytest.mark.parametrize("role", MAINS)
def test_full_disk_loses_nothing_that_was_finished(tmp_path, shard, refusal, monkeypatch, where, role):
    main, calls = MAINS[role], [shard(role, f"shard000{number}.h5", number, pairs=20) for number in (0, 1)]
    main(calls[0])
    whole = (tmp_path / "shard0000.h5").read_bytes()
    before = sorted(tmp_path.iterdir())
    target, name = {
        "open": (h5py, "File"),
        "write": (h5py.Group, "create_dataset"),
        "rename": (os, "replace"),
    }[where]
    monkeypatch.setattr(target, name, full_disk)
    for number, call in enumerate(calls):
        line = refusal(main, call)
        assert f"shard000{number}.h5" in line and "No space left" in line
    monkeypatch.undo()
    assert (tmp_path / "shard0000.h5").read_bytes() == whole
    assert sorted(tmp_path.iterdir()) == before
    main(calls[0])
    assert (tmp_path / "shard0000.h5").read_bytes() == whole
