"""The centre of pressure of hand-worked motions, and when balance is lost."""

import numpy as np
import pytest

from anthro.motor.balance import GRAVITY, Balance

SUPPORT = (-0.2, 0.6, -0.3, 0.3, 0.8)


class Mass:
    """A simulator's step and centre of mass: a point that moves as it is told."""

    def __init__(self, way, step=0.005):
        self.way, self.step_seconds, self.time = way, step, 0.0

    @property
    def centre_of_mass(self):
        return np.array(self.way(self.time), float)


def run(way, seconds, support=SUPPORT):
    """First time at which balance is lost, None if it is kept."""
    mass, balance = Mass(way), Balance(support)
    balance.begin(mass)
    while mass.time < seconds:
        mass.time += mass.step_seconds
        if balance.lost(mass):
            return mass.time
    return None


@pytest.mark.parametrize(
    ("centre", "acceleration", "expected"),
    [
        ((0.1, 0.0, 1.0), (0.0, 0.0, 0.0), (0.1, 0.0)),
        ((0.1, 0.0, 1.0), (2.0, 0.0, 0.0), (0.1 - 0.2 * 2.0 / GRAVITY, 0.0)),
        ((0.0, 0.1, 1.3), (0.0, -4.0, 2.0), (0.0, 0.1 + 0.5 * 4.0 / (GRAVITY + 2.0))),
        ((0.0, 0.0, 1.0), (1.0, 0.0, -GRAVITY), (-0.2 / (0.1 * GRAVITY), 0.0)),  # in free fall: no more than tenfold
    ],
)
def test_centre_of_pressure_by_hand(centre, acceleration, expected):
    """c - (c_z - z_0) a / (a_z + g): moments about the point where the force acts vanish."""
    centre, acceleration = np.array(centre), np.array(acceleration)
    found = Balance(SUPPORT).centre_of_pressure(centre, acceleration)
    np.testing.assert_allclose(found, expected, atol=1e-12)
    if acceleration[2] > -0.9 * GRAVITY:
        lever = centre - [*found, SUPPORT[4]]
        moment = np.cross(lever, acceleration + [0.0, 0.0, GRAVITY])
        np.testing.assert_allclose(moment[:2], 0.0, atol=1e-12)


def test_a_resting_or_evenly_moving_mass_keeps_balance_until_it_leaves_the_support():
    assert run(lambda t: (0.1, 0.0, 1.2), 1.0) is None
    assert run(lambda t: (0.1, 0.31, 1.2), 1.0) == pytest.approx(0.005)
    # 0.5 m/s from the middle, the jerk of its start forgotten: over the edge at 0.6 m after 1.2 s
    assert run(lambda t: (0.5 * t, 0.0, 0.8), 2.0) == pytest.approx(1.2, abs=0.01)


def test_a_mass_that_accelerates_for_long_loses_balance_where_the_formula_says():
    """At 1.3 m, 0.5 m above the seat, accelerating forward by a: its centre of pressure lies 0.5 a / g behind it."""
    limit = 0.2 * GRAVITY / 0.5  # leaves the rear edge at once
    kept = run(lambda t: (0.5 * 0.9 * limit * t * t, 0.0, 1.3), 0.2)
    lost = run(lambda t: (0.5 * 1.3 * limit * t * t, 0.0, 1.3), 0.2)
    assert kept is None and lost is not None


def test_a_jolt_of_one_step_is_smoothed_and_beginning_forgets_it():
    jolt = Mass(lambda t: (0.0 if t < 0.1 else 1e-4, 0.0, 1.3))
    balance = Balance(SUPPORT)
    balance.begin(jolt)
    while jolt.time < 0.3:
        jolt.time += jolt.step_seconds
        assert not balance.lost(jolt)  # 4 m/s^2 over 5 ms
    far = Mass(lambda t: (0.3, 0.0, 1.3))
    balance.begin(far)
    far.time += 0.005
    assert not balance.lost(far)


def test_the_bodys_own_centre_of_mass_is_what_counts(limb):
    """At rest on its fixed pelvis the whole body stands within the support that the core is trained with."""
    simulator = limb("core").body.simulator()
    balance = Balance(SUPPORT)
    balance.begin(simulator)
    assert not balance.lost(simulator)
    x, y, _ = simulator.centre_of_mass
    tight = Balance((x + 0.01, 0.6, -0.3, 0.3, 0.8))
    tight.begin(simulator)
    assert tight.lost(simulator) and abs(y) < 1e-3
