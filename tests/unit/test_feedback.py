"""What controllers make of their limb's discrepancy (anthro.motor.feedback)."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from anthro.motor.feedback import PLAIN, SMOOTHING, Feedback, FeedbackState

STEP = 0.005
NEAR = 0.1


def toward(place):
    """The discrepancy of a limb at a place."""
    return lambda target: np.asarray(target, float) - place


def test_plain_is_the_discrepancy_itself():
    state = FeedbackState(PLAIN, STEP)
    for place in (0.0, 0.3, -0.2):
        np.testing.assert_array_equal(state.told(toward(place), [0.5, 0.1, 0.0]), np.array([0.5, 0.1, 0.0]) - place)


def test_what_remains_is_added_up_by_hand():
    state, target = FeedbackState(Feedback(rate=2.0, near=NEAR), STEP), np.array([0.06, 0.0])
    for count in range(1, 4):
        told = state.told(toward(0.0), target)
        np.testing.assert_allclose(told, target * (1.0 + count * 2.0 * STEP))
    state.reset()
    np.testing.assert_allclose(state.told(toward(0.0), target), target * (1.0 + 2.0 * STEP))


def test_far_discrepancies_are_not_added_up():
    state, target = FeedbackState(Feedback(rate=2.0, near=NEAR), STEP), np.array([0.11, 0.0])
    for _ in range(50):
        np.testing.assert_array_equal(state.told(toward(0.0), target), target)


@given(st.lists(st.floats(-0.09, 0.09), min_size=3, max_size=3))
def test_the_sum_is_bounded(target):
    state = FeedbackState(Feedback(rate=50.0, near=NEAR), STEP)
    for _ in range(100):
        told = state.told(toward(0.0), target)
    assert np.linalg.norm(told - target) <= 0.5 * NEAR * (1.0 + 1e-12)


@pytest.mark.parametrize("target_speed", [0.0, 0.7])
def test_the_limbs_own_movement_leads_and_the_targets_does_not(target_speed):
    """At steady 0.4 m/s the discrepancy is told as it will be 0.2 s later, wherever the target goes meanwhile."""
    state = FeedbackState(Feedback(lead=0.2, near=NEAR), STEP)
    for step in range(round(20 * SMOOTHING / STEP)):
        time = step * STEP
        place, target = np.array([0.4 * time, 0.0]), np.array([1.0 + target_speed * time, 0.0])
        told = state.told(toward(place), target)
    np.testing.assert_allclose(told, target - place - [0.2 * 0.4, 0.0], atol=1e-6)


def test_the_lead_is_bounded_and_forgotten():
    state = FeedbackState(Feedback(lead=0.2, near=NEAR), STEP)
    for step in range(100):
        place = np.array([10.0 * step * STEP, 0.0])  # 2 m ahead, if it were not bounded
        told = state.told(toward(place), np.zeros(2))
    np.testing.assert_allclose(told + place, [-NEAR, 0.0], atol=1e-9)
    state.reset()
    np.testing.assert_array_equal(state.told(toward(place), np.zeros(2)), -place)
