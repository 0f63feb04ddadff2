"""Rollouts read for drawing and interpolated in time."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from render_bodies import INSTANTS, record, turned, write_body

from anthro.errors import UserError
from anthro.render.rollout import read_rollout, slerp


@pytest.fixture
def run(tmp_path):
    write_body(tmp_path)
    write_body(tmp_path, "zhou2021", free=True)
    return tmp_path


def test_a_rollout_at_other_times(run):
    record(run, limbs="left_arm neck_seated", props="stool floor", direction=np.arange(2.0 * INSTANTS).reshape(-1, 2))
    rollout = read_rollout(run, "on_off")
    assert rollout.body.name == "nakada2018" and rollout.seed == 7
    assert rollout.limbs == ("left_arm", "neck_seated") and rollout.props == ("stool", "floor")
    assert np.allclose(rollout.switches(), [3, 7])
    now = rollout.at(np.array([0.05, 2.95, 3.05, 99.0]))
    assert now.qpos[0] == pytest.approx(0.5 / 119) and now.qpos[-1] == pytest.approx(1)
    assert now.effector.shape == (4, 2, 3) and now.effector[2, 1, 2] == pytest.approx(1.35)
    assert now.controller_on.tolist() == [True, True, False, True]
    assert now.others["direction"][:, 0].tolist() == [0, 58, 60, 238]


def test_a_fixed_root_is_moved_along_the_shorter_turn(run):
    place = np.linspace([0.0, 0, 0.5], [1.19, 0, 0.5], INSTANTS)
    quaternion = turned([0, 1, 0], np.linspace(0, -59.5, INSTANTS))
    quaternion[1::2] *= -1  # the same turns
    record(run, base=np.concatenate([place, quaternion], axis=1))
    now = read_rollout(run, "on_off").at(np.array([5.05]))
    assert now.base[0, :3] == pytest.approx([0.505, 0, 0.5])
    expected = turned([0, 1, 0], [-25.25])[0]
    assert np.abs(now.base[0, 3:] @ expected) == pytest.approx(1, abs=1e-12)


def test_a_free_root_keeps_a_unit_quaternion(run):
    quaternion = turned([1, 0, 0], np.arange(INSTANTS) * 90.0)
    qpos = np.concatenate([np.zeros((INSTANTS, 3)), quaternion, np.zeros((INSTANTS, 3))], axis=1)
    record(run, body="zhou2021", qpos=qpos)
    now = read_rollout(run, "on_off").at(np.array([0.05]))
    assert now.qpos[0, 3:7] == pytest.approx(turned([1, 0, 0], [45.0])[0])
    record(run, body="zhou2021", qpos=2 * qpos)
    with pytest.raises(UserError, match="unit length"):
        read_rollout(run, "on_off")


@given(st.floats(-170, 170), st.floats(0, 1), st.sampled_from([-1, 1]))
def test_slerp_turns_at_an_even_pace(degrees, share, sign):
    start, end = turned([0, 0, 1], [20.0]), sign * turned([0, 0, 1], [20 + degrees])
    expected = turned([0, 0, 1], [20 + share * degrees])
    assert np.abs((slerp(start, end, np.array([share])) * expected).sum()) == pytest.approx(1, abs=1e-9)


@pytest.mark.parametrize(
    "changes, word",
    [
        ({"time": np.zeros(INSTANTS)}, "time does not increase"),
        ({"time": np.arange(5.0)}, "shape"),
        ({"qpos": np.full((INSTANTS, 3), np.nan)}, "qpos is not finite"),
        ({"qpos": np.zeros((INSTANTS, 7))}, r"qpos has shape \(120, 7\), body nakada2018 asks for \(120, 3\)"),
        ({"activation": np.zeros((INSTANTS, 29))}, "activation has shape"),
        ({"target": np.zeros((INSTANTS, 2, 3))}, "target has shape"),
        ({"base": np.zeros((INSTANTS, 6))}, "base has shape"),
        ({"base": np.zeros((INSTANTS, 7))}, "unit length"),
        ({"effector": None}, "no column effector"),
        ({"props": "stool sofa"}, "unknown prop 'sofa'"),
        ({"body": "zhou2021", "qpos": np.ones((INSTANTS, 10)), "base": np.ones((INSTANTS, 7))}, "is free"),
    ],
)
def test_bad_rollouts_are_refused_by_name(run, changes, word):
    record(run, **changes)
    with pytest.raises(UserError, match=rf"rollout\.h5.*{word}"):
        read_rollout(run, "on_off")


def test_a_missing_body_is_refused(run):
    record(run, body="nobody")
    with pytest.raises(UserError, match="nobody"):
        read_rollout(run, "on_off")
