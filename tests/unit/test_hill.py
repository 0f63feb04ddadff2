"""The Hill muscle of Zhou et al. 2021, Appendix B, by hand and against its own slopes."""

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from anthro.body import hill

A = np.array([1000.0])
numbers = settings(max_examples=200, deadline=None)
strains = st.floats(-1.0, 0.6)
rates = st.floats(-12.0, 12.0)
activations = st.floats(0.0, 1.0)
strengths = st.floats(10.0, 3000.0)


def one(value):
    return np.array([float(value)])


def test_constants_are_the_papers():
    assert (hill.MIN_LENGTH, hill.MAX_SPEED, hill.EXPONENT) == (0.3, 8.0, 6.0)
    assert (hill.STIFFNESS_PER_FORCE, hill.DAMPING_PER_STIFFNESS) == (0.8, 0.1)


@pytest.mark.parametrize(
    ("e", "rate", "expected"),
    [
        (0.0, 0.0, 1000.0),  # isometric at slack length: A
        (0.35, 0.0, 1500.0),  # 1000 * 1.05 / 0.7
        (-0.35, 0.0, 500.0),  # 1000 * 0.35 / 0.7
        (-0.7, 0.0, 0.0),  # l = 0.3 l0
        (-0.9, 0.0, 0.0),
        (0.0, -4.0, 500.0),  # half of v_m
        (0.0, -8.0, 0.0),  # v_m
        (0.0, -20.0, 0.0),
        (0.0, 5.0, 1000.0),  # lengthening costs nothing
        (-0.35, -2.0, 375.0),  # 500 * 0.75
    ],
)
def test_contractile_element_by_hand(e, rate, expected):
    assert hill.active_force(one(e), one(rate), A)[0] == pytest.approx(expected, abs=1e-9)


@pytest.mark.parametrize(
    ("e", "rate", "expected"),
    [
        (0.0, 0.0, 0.0),
        (0.1, 0.0, 800.0 * 0.8221188003905089),  # e^0.6 - 1
        (0.1, 1.0, 800.0 * 0.8221188003905089 + 80.0),
        (0.1, -0.8, 800.0 * 0.8221188003905089 - 64.0),
        (0.0, 1.0, 80.0),  # at slack length the damper alone
        (0.0, -1.0, 0.0),  # it never pushes
        (-0.5, 0.0, 0.0),
        (-0.5, 5.0, 0.0),  # 800 (e^-3 - 1) + 400 < 0
        (0.1, -20.0, 0.0),
    ],
)
def test_parallel_element_by_hand(e, rate, expected):
    assert hill.passive_force(one(e), one(rate), A)[0] == pytest.approx(expected, abs=1e-6)


def test_total_by_hand():
    """0.5 * 1142.857 * 0.9 + 593.695 at e = 0.1, e' = -0.8."""
    total = hill.force(one(0.5), one(0.1), one(-0.8), A)[0]
    assert total == pytest.approx(0.5 * 1000.0 * 0.8 / 0.7 * 0.9 + 800.0 * 0.8221188003905089 - 64.0, abs=1e-6)


def test_strain_by_hand():
    np.testing.assert_allclose(hill.strain(np.array([0.08, 0.1, 0.13]), np.full(3, 0.1)), [-0.2, 0.0, 0.3])


@numbers
@given(a=activations, e=strains, rate=rates, strength=strengths)
def test_forces_and_slopes_are_never_negative(a, e, rate, strength):
    state = one(e), one(rate), one(strength)
    assert hill.active_force(*state) >= 0.0 and hill.passive_force(*state) >= 0.0
    assert hill.force(one(a), *state) >= 0.0
    assert hill.stiffness(one(a), *state) >= 0.0 and hill.damping(one(a), *state) >= 0.0


@numbers
@given(a=activations, e=strains, rate=rates, strength=strengths)
def test_slopes_are_the_finite_differences(a, e, rate, strength):
    """Away from the corners of max and min, where there is no slope."""
    step = 1e-6
    parallel = 0.8 * (np.exp(6.0 * e) - 1.0) + 0.08 * rate
    assume(min(abs(parallel), abs(e + 0.7), abs(rate), abs(rate + 8.0)) > 1e-3)
    a, e, rate, strength = one(a), one(e), one(rate), one(strength)

    def slope(first, second):
        return (hill.force(a, *second, strength) - hill.force(a, *first, strength)) / (2.0 * step)

    stiffness = slope((e - step, rate), (e + step, rate))
    damping = slope((e, rate - step), (e, rate + step))
    np.testing.assert_allclose(hill.stiffness(a, e, rate, strength), stiffness, rtol=1e-4, atol=1e-3)
    np.testing.assert_allclose(hill.damping(a, e, rate, strength), damping, rtol=1e-4, atol=1e-3)


def test_slopes_are_zero_where_nothing_pulls():
    slack = one(-0.75), one(0.0), A
    assert hill.stiffness(one(1.0), *slack) == 0.0 and hill.damping(one(1.0), *slack) == 0.0
    silent = one(-0.2), one(0.0), A
    assert hill.stiffness(one(0.0), *silent) == 0.0 and hill.damping(one(0.0), *silent) == 0.0


def test_slopes_by_hand():
    """e = 0.1, e' = -0.8, a = 0.5: 0.5 A / 0.7 * 0.9 + 4.8 A e^0.6; 0.5 * 1142.857 / 8 + 0.08 A."""
    state = one(0.5), one(0.1), one(-0.8), A
    assert hill.stiffness(*state)[0] == pytest.approx(450.0 / 0.7 + 4800.0 * 1.8221188003905089, rel=1e-9)
    assert hill.damping(*state)[0] == pytest.approx(0.5 * 800.0 / 0.7 / 8.0 + 80.0, rel=1e-9)


def test_force_is_linear_in_activation():
    e, rate, strength = np.full(3, -0.1), np.full(3, -1.0), np.full(3, 500.0)
    low, middle, high = hill.force(np.array([0.0, 0.5, 1.0]), e, rate, strength)
    assert middle == pytest.approx(0.5 * (low + high))


@numbers
@given(e=strains)
def test_stored_energy_is_the_springs_work(e):
    """Integral of f_P over the fiber's way from slack length, l0 = 0.1 m."""
    way = np.linspace(0.0, max(e, 0.0), 2001)
    work = np.trapezoid(hill.passive_force(way, np.zeros_like(way), np.full_like(way, 1000.0)), way) * 0.1
    assert hill.passive_energy(one(e), A, 0.1)[0] == pytest.approx(work, rel=1e-5, abs=1e-9)
