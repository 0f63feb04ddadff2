"""Discrepancies: against scipy's rotations, against finite differences, from any base, in the mirror."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from anthro.motor.senses import SENSES, angles, direction

seeds = st.integers(0, 2**32 - 1)
MIRROR = np.diag([1.0, -1.0, 1.0])


def turn(rng, most=np.pi):
    """A rotation (3, 3) by at most ``most`` rad."""
    axis = rng.normal(size=3)
    return Rotation.from_rotvec(rng.uniform(0.0, most) * axis / np.linalg.norm(axis)).as_matrix()


def case(kind, seed, most=1.2):
    """Target, position, rotation and base of an effector that looks ahead, more or less."""
    rng = np.random.default_rng(seed)
    base = turn(rng)
    rotation = base @ turn(rng, most)
    aim = base @ turn(rng, most)
    target = {"position": rng.normal(size=3), "gaze": aim[:, 0], "orientation": aim}[kind]
    return target, rng.normal(size=3), rotation, base


def moved(kind, target, by):
    """The target of a body that is turned by ``by`` and moved by one metre along x."""
    if kind == "position":
        return by @ target + (1.0, 0.0, 0.0)
    return by @ target


@given(seed=seeds)
def test_position_is_the_way_in_the_bases_axes(seed):
    target, position, rotation, base = case("position", seed)
    found = SENSES["position"].offset(target, position, rotation, base)
    np.testing.assert_allclose(position + base @ found, target, atol=1e-12)


@given(seed=seeds)
def test_gaze_is_azimuth_and_elevation(seed):
    """A head that turns up by its elevation, then to the left by its azimuth, looks where it looks."""
    target, position, rotation, base = case("gaze", seed)

    def seen(world):
        azimuth, elevation = angles(base.T @ world)
        turned = Rotation.from_euler("ZY", [azimuth, -elevation]).apply([1.0, 0.0, 0.0])
        np.testing.assert_allclose(base @ turned, world, atol=1e-9)
        np.testing.assert_allclose(direction(azimuth, elevation), turned, atol=1e-12)
        return np.array([azimuth, elevation])

    gap = seen(target) - seen(rotation[:, 0])
    gap[0] -= 2.0 * np.pi * np.round(gap[0] / (2.0 * np.pi))
    np.testing.assert_allclose(SENSES["gaze"].offset(target, position, rotation, base), gap, atol=1e-9)


def test_gaze_by_hand_and_the_short_way_round():
    ahead, left, up = np.eye(3)
    look = np.eye(3)
    np.testing.assert_allclose(SENSES["gaze"].offset(left, ahead, look, np.eye(3)), [np.pi / 2, 0.0], atol=1e-12)
    np.testing.assert_allclose(SENSES["gaze"].offset(ahead + up, ahead, look, np.eye(3)), [0.0, np.pi / 4], atol=1e-12)
    behind = Rotation.from_rotvec([0.0, 0.0, 3.0]).as_matrix()  # 3 rad to the left, target 3 rad to the right
    found = SENSES["gaze"].offset(behind.T[:, 0], ahead, behind, np.eye(3))
    np.testing.assert_allclose(found, [2.0 * np.pi - 6.0, 0.0], atol=1e-12)


@given(seed=seeds)
def test_orientation_is_the_rotation_that_is_missing(seed):
    target, position, rotation, base = case("orientation", seed)
    found = SENSES["orientation"].offset(target, position, rotation, base)
    assert np.linalg.norm(found) <= np.pi + 1e-9
    turned = Rotation.from_rotvec(base @ found).as_matrix() @ rotation
    np.testing.assert_allclose(turned, target, atol=1e-9)


@pytest.mark.parametrize("kind", SENSES)
@given(seed=seeds)
def test_no_discrepancy_at_the_target(kind, seed):
    _, position, rotation, base = case(kind, seed)
    sense = SENSES[kind]
    found = sense.offset(sense.feature(position, rotation), position, rotation, base)
    np.testing.assert_allclose(found, np.zeros(sense.width), atol=1e-7)


@pytest.mark.parametrize("kind", SENSES)
@given(seed=seeds)
def test_turning_everything_changes_nothing(kind, seed):
    target, position, rotation, base = case(kind, seed)
    by = turn(np.random.default_rng(seed + 1))
    sense = SENSES[kind]
    before = sense.offset(target, position, rotation, base)
    after = sense.offset(moved(kind, target, by), by @ position + (1.0, 0.0, 0.0), by @ rotation, by @ base)
    np.testing.assert_allclose(after, before, atol=1e-7)


@pytest.mark.parametrize("kind", SENSES)
@given(seed=seeds)
def test_the_mirrored_body_senses_the_mirrored_discrepancy(kind, seed):
    """Frames of the mirrored body are those of its own bones: M R M."""
    target, position, rotation, base = case(kind, seed)
    sense = SENSES[kind]
    aim = MIRROR @ target @ MIRROR if kind == "orientation" else MIRROR @ target
    found = sense.offset(aim, MIRROR @ position, MIRROR @ rotation @ MIRROR, MIRROR @ base @ MIRROR)
    np.testing.assert_allclose(found, sense.mirror * sense.offset(target, position, rotation, base), atol=1e-7)
    assert len(sense.mirror) == sense.width


@pytest.mark.parametrize("kind", SENSES)
@given(seed=seeds)
def test_slopes_are_the_finite_differences(kind, seed):
    """The effector moves and turns as if by five joints; the discrepancy shrinks by the slopes."""
    rng, step = np.random.default_rng(seed), 1e-6
    _, position, rotation, base = case(kind, seed, most=0.9)
    linear, angular, sense = rng.normal(size=(3, 5)), rng.normal(size=(3, 5)), SENSES[kind]
    target = sense.feature(position, rotation)
    slopes = sense.jacobian(rotation, base, linear, angular)
    assert slopes.shape == (sense.width, 5)
    for joint in range(5):
        ends = []
        for way in (-step, step):
            turned = Rotation.from_rotvec(way * angular[:, joint]).as_matrix() @ rotation
            ends.append(sense.offset(target, position + way * linear[:, joint], turned, base))
        np.testing.assert_allclose(slopes[:, joint], (ends[0] - ends[1]) / (2.0 * step), rtol=1e-5, atol=1e-5)


@pytest.mark.parametrize("kind", SENSES)
def test_features_are_copies(kind):
    position, rotation = np.zeros(3), np.eye(3)
    feature = SENSES[kind].feature(position, rotation)
    feature[:] = 7.0
    assert not position.any() and np.array_equal(rotation, np.eye(3))
