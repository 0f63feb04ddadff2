"""Training pairs: shapes, repeatability, students, bad input, a full disk."""

import errno
import os

import h5py
import numpy as np
import pytest

from anthro import files
from anthro.errors import UserError
from anthro.files import digest, read_shard, write_json
from anthro.motor import synthesize, synthesize_reflex
from anthro.motor.network import FeedForward
from anthro.motor.reflex import DRIVE_RANGE, reflex_adjustment

REACH = 2.0  # m, no hand is further from a target
PAPER, PROPRIOCEPTIVE, REFLEX = (
    f"{name}/weights.h5"
    for name in ("right_arm_voluntary_paper", "right_arm_voluntary_proprioceptive", "right_arm_reflex")
)


@pytest.fixture
def voluntary(tmp_path, arm_folder, data_spec):
    """Function of the shard's name and more arguments: the command line of a small shard."""
    write_json(tmp_path / "spec.json", data_spec("voluntary"))

    def arguments(name="shard0000.h5", shard=0, *more):
        files = ["--spec", tmp_path / "spec.json", "--body", arm_folder, "--out", tmp_path / name]
        return [str(argument) for argument in [*files, "--shard", shard, *more]]

    return arguments


@pytest.fixture
def reflexive(tmp_path, arm_folder, data_spec):
    write_json(tmp_path / "reflex.json", data_spec("reflex"))

    def arguments(name="reflex0000.h5", shard=0):
        files = ["--spec", tmp_path / "reflex.json", "--body", arm_folder, "--out", tmp_path / name]
        return [str(argument) for argument in [*files, "--shard", shard]]

    return arguments


def test_voluntary_shard(tmp_path, voluntary, data_spec):
    assert synthesize.main(voluntary()) == 0
    columns, attrs = read_shard(tmp_path / "shard0000.h5")
    widths = {"offset": 3, "drive": 29, "strain": 29, "voluntary": 29}
    assert {name: values.shape for name, values in columns.items()} == {n: (60, w) for n, w in widths.items()}
    assert all(values.dtype == np.float32 and np.isfinite(values).all() for values in columns.values())
    assert attrs["spec_digest"] == digest(data_spec("voluntary")) and attrs["round"] == 0
    assert np.linalg.norm(columns["offset"], axis=1).max() < REACH
    assert np.abs(columns["voluntary"]).max() <= np.float32(data_spec("voluntary")["teacher"]["max_adjustment"])
    assert columns["drive"].min() >= DRIVE_RANGE[0] and columns["drive"].max() <= DRIVE_RANGE[1]
    assert len(np.unique(columns["offset"], axis=0)) == 60


def test_reflex_shard_is_equations_4_and_5(tmp_path, reflexive, data_spec):
    assert synthesize_reflex.main(reflexive()) == 0
    columns, attrs = read_shard(tmp_path / "reflex0000.h5")
    assert set(columns) == {"strain_change", "strain_rate_change", "reflex"}
    assert all(values.shape == (60, 29) and values.dtype == np.float32 for values in columns.values())
    wanted = reflex_adjustment(columns["strain_change"], columns["strain_rate_change"])
    np.testing.assert_allclose(columns["reflex"], wanted, atol=1e-6)
    assert np.abs(columns["strain_rate_change"]).max() > 0.01
    assert attrs["spec_digest"] == digest(data_spec("reflex"))


@pytest.mark.parametrize("role", ["voluntary", "reflex"])
def test_same_seed_same_bytes_and_shards_differ(tmp_path, voluntary, reflexive, role):
    main, arguments = (synthesize.main, voluntary) if role == "voluntary" else (synthesize_reflex.main, reflexive)
    for name, shard in (("a.h5", 0), ("b.h5", 0), ("c.h5", 1)):
        main(arguments(name, shard))
    assert (tmp_path / "a.h5").read_bytes() == (tmp_path / "b.h5").read_bytes()
    first, _ = read_shard(tmp_path / "a.h5")
    other, _ = read_shard(tmp_path / "c.h5")
    for name in first:
        assert not np.array_equal(first[name], other[name])


def test_rounds_and_seeds_differ(arm, data_spec):
    spec = data_spec("voluntary", pairs=3)
    offsets = [
        synthesize.synthesize(spec | {"seed": seed}, arm, number, 0, [])["offset"]
        for seed, number in ((7, 0), (7, 1), (8, 0))
    ]
    assert not np.array_equal(offsets[0], offsets[1]) and not np.array_equal(offsets[0], offsets[2])


def test_a_shorter_shard_is_the_beginning_of_a_longer_one(arm, data_spec):
    """Memory is constant: pairs are made one after the other, and how many changes none of them."""
    short, long = (synthesize.synthesize(data_spec("voluntary", pairs=n), arm, 0, 0, []) for n in (20, 60))
    for name, values in short.items():
        np.testing.assert_array_equal(values, long[name][:20])


@pytest.mark.parametrize("share", [0.0, 1.0])
def test_pairs_of_rollouts_or_of_single_states_alone(arm, data_spec, share):
    columns = synthesize.synthesize(data_spec("voluntary", pairs=40, posture_share=share), arm, 0, 0, [])
    assert all(np.isfinite(values).all() for values in columns.values())
    assert np.abs(columns["voluntary"]).max() > 1e-3
    assert np.linalg.norm(columns["offset"], axis=1).min() < 0.3


def test_students_lead_and_the_teacher_labels(tmp_path, tiny_nets, voluntary):
    students = ["--round", "1", "--students", tiny_nets / PAPER, tiny_nets / PROPRIOCEPTIVE]
    for name in ("a.h5", "b.h5"):
        assert synthesize.main(voluntary(name, 0, *students, "--reflex", tiny_nets / REFLEX)) == 0
    assert (tmp_path / "a.h5").read_bytes() == (tmp_path / "b.h5").read_bytes()
    columns, attrs = read_shard(tmp_path / "a.h5")
    assert attrs["round"] == 1 and columns["voluntary"].shape == (60, 29)
    assert all(np.isfinite(values).all() for values in columns.values())


def test_the_input_variant_follows_from_a_students_width(tiny_nets):
    students = synthesize.load_students([tiny_nets / PAPER, tiny_nets / PROPRIOCEPTIVE], tiny_nets / REFLEX, 29)
    assert [student.proprioceptive for student in students] == [False, True]
    assert synthesize.load_students([], None, 29) == []
    with pytest.raises(UserError, match="--students needs --reflex"):
        synthesize.load_students([tiny_nets / PAPER], None, 29)


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


def test_missing_spec_or_body_is_refused_by_name(tmp_path, voluntary, reflexive, refusal):
    for main, arguments in ((synthesize.main, voluntary()), (synthesize_reflex.main, reflexive())):
        no_spec = ["--spec", tmp_path / "none.json", *arguments[2:]]
        assert "none.json" in refusal(main, no_spec)
        no_body = [*arguments[:2], "--body", tmp_path / "nobody", *arguments[4:]]
        assert "nobody" in refusal(main, no_body)


def full_disk(*args, **kwargs):
    raise OSError(errno.ENOSPC, "No space left on device")


@pytest.mark.parametrize("where", ["open", "write", "rename"])
@pytest.mark.parametrize("role", ["voluntary", "reflex"])
def test_full_disk_loses_nothing_that_was_finished(tmp_path, voluntary, reflexive, refusal, monkeypatch, where, role):
    main, arguments = (synthesize.main, voluntary) if role == "voluntary" else (synthesize_reflex.main, reflexive)
    main(arguments("shard0000.h5", 0))
    whole = (tmp_path / "shard0000.h5").read_bytes()
    before = sorted(tmp_path.iterdir())
    target, name = {
        "open": (files.h5py, "File"),
        "write": (h5py.Group, "create_dataset"),
        "rename": (os, "replace"),
    }[where]
    monkeypatch.setattr(target, name, full_disk)
    for shard in (0, 1):
        line = refusal(main, arguments(f"shard000{shard}.h5", shard))
        assert f"shard000{shard}.h5" in line and "No space left" in line
    monkeypatch.undo()
    assert (tmp_path / "shard0000.h5").read_bytes() == whole
    assert sorted(tmp_path.iterdir()) == before
    main(arguments("shard0000.h5", 0))
    assert (tmp_path / "shard0000.h5").read_bytes() == whole
