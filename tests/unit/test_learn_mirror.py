"""The mirrored network (anthro.learn.mirror)."""

import hashlib

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from anthro import cli
from anthro.learn import mirror
from anthro.learn.mirror import mirrored
from anthro.motor.network import FeedForward

SIZES = (6, 16, 8, 4)


def network(seed=0, attrs=None) -> FeedForward:
    generator = np.random.default_rng(seed)
    n_in, n_out = SIZES[0], SIZES[-1]
    return FeedForward(
        [generator.normal(size=(b, a)) for a, b in zip(SIZES, SIZES[1:], strict=False)],
        [generator.normal(size=b) for b in SIZES[1:]],
        {
            "input_softening": generator.choice([0.0, 0.02], n_in),
            "input_mean": generator.normal(size=n_in),
            "input_scale": generator.uniform(0.5, 2, n_in),
            "output_softening": generator.choice([0.0, 0.05], n_out),
            "output_mean": generator.normal(size=n_out),
            "output_scale": generator.uniform(0.1, 1, n_out),
            "output_limit": generator.uniform(0.1, 0.4, n_out),
        },
        attrs,
    )


signs = st.sampled_from([1, -1])


@settings(deadline=None, max_examples=50)
@given(
    order_in=st.permutations(range(SIZES[0])),
    order_out=st.permutations(range(SIZES[-1])),
    sign_in=st.lists(signs, min_size=SIZES[0], max_size=SIZES[0]),
    sign_out=st.lists(signs, min_size=SIZES[-1], max_size=SIZES[-1]),
    seed=st.integers(0, 50),
)
def test_the_mirrored_net_does_the_same_in_the_mirror(order_in, order_out, sign_in, sign_out, seed):
    right = network(seed)
    left = mirrored(right, order_in, sign_in, order_out, sign_out)
    x = np.random.default_rng(seed + 1).normal(size=(9, SIZES[0])).astype(np.float32)
    expected = right.predict(x)[:, order_out] * sign_out
    np.testing.assert_allclose(left.predict(x[:, order_in] * sign_in), expected, rtol=1e-4, atol=1e-4)
    np.testing.assert_allclose(left.predict(x[0, order_in] * sign_in), expected[0], rtol=1e-4, atol=1e-4)


@pytest.mark.parametrize(
    "change", [{0: [0, 1, 2, 3, 4, 4]}, {0: [0, 1]}, {1: [1, 1, 1, 1, 1, 2]}, {1: [1]}, {2: [0, 1, 2, 4]}, {3: [0] * 4}]
)
def test_what_is_no_mirror_is_refused(change):
    arguments = dict(enumerate(([*range(6)], [1] * 6, [*range(4)], [1] * 4))) | change
    with pytest.raises(ValueError, match="not"):
        mirrored(network(), *arguments.values())


def save(path) -> FeedForward:
    right = network(attrs={"name": "right_arm_reflex", "spec_digest": "abc", "epoch": 3})
    right.save(path)
    return right


def test_a_left_limb_is_the_right_one_with_y_turned_to_the_last_bit(tmp_path, capsys):
    source = tmp_path / "right.h5"
    right = save(source)
    command = ["--weights", str(source), "--offset-signs", "1", "-1", "1", "--name", "left", "--out"]
    for name in ("left.h5", "again.h5"):
        assert cli.run(mirror.main, [*command, str(tmp_path / name)]) == 0
    assert capsys.readouterr().out.splitlines()[0] == "left: mirrored from right_arm_reflex"
    assert (tmp_path / "left.h5").read_bytes() == (tmp_path / "again.h5").read_bytes()
    left = FeedForward.load(tmp_path / "left.h5")
    x = np.random.default_rng(0).normal(size=(20, 6)).astype(np.float32)
    np.testing.assert_array_equal(left.predict(x * [1, -1, 1, 1, 1, 1]), right.predict(x))
    assert left.attrs == right.attrs | {
        "name": "left",
        "mirrored_from": "right_arm_reflex",
        "source_digest": hashlib.sha256(source.read_bytes()).hexdigest(),
    }


def test_a_net_without_an_offset_stays_as_it_is(tmp_path):
    right = save(tmp_path / "right.h5")
    assert cli.run(mirror.main, ["--weights", str(tmp_path / "right.h5"), "--out", str(tmp_path / "left.h5")]) == 0
    left = FeedForward.load(tmp_path / "left.h5")
    np.testing.assert_array_equal(left.predict(np.ones(6)), right.predict(np.ones(6)))
    assert left.attrs["mirrored_from"] == left.attrs["name"] == "right_arm_reflex"


@pytest.mark.parametrize("told", [["2"], ["1"] * 7, ["0", "1", "1"]])
def test_bad_signs_and_files_are_told(tmp_path, capsys, told):
    save(tmp_path / "right.h5")
    out = tmp_path / "left.h5"
    command = ["--weights", str(tmp_path / "right.h5"), "--offset-signs", *told, "--out", str(out)]
    assert cli.run(mirror.main, command) == 2
    assert "offset signs" in capsys.readouterr().err
    command[1] = str(tmp_path / "none.h5")
    assert cli.run(mirror.main, command) == 2
    assert "none.h5" in capsys.readouterr().err
    assert not out.exists()
