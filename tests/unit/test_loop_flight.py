"""Flights fitted to what is seen of them, bounces noticed, and the places where a limb meets a ball."""

from pathlib import Path

import numpy as np
import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st

from anthro.loop.flight import GRAVITY, Flight, covariance
from anthro.loop.meeting import Meeting
from anthro.loop.percept import Percept, crossing
from anthro.loop.plan import loop_plan
from anthro.world import balls
from anthro.world.balls import Ball, Balls
from anthro.world.surfaces import Slope

ROOT = Path(__file__).resolve().parents[2]
PLAN = loop_plan(yaml.safe_load((ROOT / "config" / "loop.yaml").read_text()))
LOOK = 0.01  # s between looks
EYES = np.array([0.0, 0.0, 1.25])
number = st.floats(-2.0, 2.0)
vector = st.tuples(number, number, number).map(np.array)


def fallen(place, velocity, time):
    return place + time * (velocity + 0.5 * time * GRAVITY)


def seen(place, gap):
    """Covariance of a place that is told by a limb's vision alone, the limb being ``gap`` m away from it."""
    way, plan = place - EYES, PLAN.flight
    distance = np.linalg.norm(way)
    return covariance(plan, way / distance, distance, plan.near_sd + plan.far_sd * gap)


def watched(place, velocity, until, noise=0.0, rng=None):
    flight = Flight(PLAN.flight)
    for time in np.arange(0.3, 0.3 + until, LOOK):
        true = fallen(place, velocity, time - 0.3)
        spread = seen(true, np.linalg.norm(true))
        error = noise * np.linalg.cholesky(spread) @ rng.normal(size=3) if noise else 0.0
        flight.see(time, true + error, spread)
    return flight


def test_the_fall_is_that_of_the_world():
    np.testing.assert_array_equal(GRAVITY, balls.GRAVITY)


@given(vector, vector, st.floats(0.3, 1.0))
def test_a_flight_that_is_seen_exactly_is_known(place, velocity, until):
    """But for what is thought of its speed before anything is seen, which weighs little."""
    flight = watched(3.0 * np.array([1, 0, 0]) + place, velocity, until)
    later = 0.3 + until + 0.4
    wanted = fallen(3.0 * np.array([1, 0, 0]) + place, velocity, later - 0.3)
    found, spread = flight.at(later)
    assert flight.bounces == 0
    assert np.linalg.norm(found - wanted) < 0.25 * np.sqrt(np.trace(spread)) + 1e-6
    np.testing.assert_allclose(flight.path(np.array([later]))[0], found)


def test_a_noisy_flight_is_known_as_well_as_is_said():
    """Mahalanobis distances of three dimensions: 3 on average, over 11.3 once in a hundred."""
    rng = np.random.default_rng(0)
    apart = []
    for _ in range(200):
        place, velocity = np.array([3.0, 0.2, 1.3]), rng.normal([-3.0, 0.0, 4.0], [0.6, 0.5, 0.6])
        flight = watched(place, velocity, 0.5, 1.0, rng)
        found, spread = flight.at(1.2)
        gap = found - fallen(place, velocity, 0.9)
        apart.append(gap @ np.linalg.solve(spread, gap))
    assert 2.0 < np.mean(apart) < 4.5


def test_more_looks_make_it_surer():
    spreads = [np.trace(watched(np.array([3.0, 0, 1.3]), np.array([-3.0, 0, 4]), until).at(1.3)[1]) for until in
               (0.1, 0.2, 0.4, 0.8)]  # fmt: skip
    assert np.all(np.diff(spreads) < 0)


@pytest.mark.parametrize("noise", [0.0, 0.7])
def test_a_bounce_is_noticed_and_what_follows_is_foreseen(noise):
    rng = np.random.default_rng(1)
    floor = Slope("floor", (1.0, 0.0, 0.8), half_size=(1.0, 1.0))
    world = Balls([Ball()], surfaces=[floor])
    world.throw(0, (1.6, -0.2, 1.6), (-1.0, 0.0, 0.0))
    flight = Flight(PLAN.flight)
    while len(world.hits) < 1 or world.time < world.hits[0].time + 0.12:
        world.advance(LOOK)
        true = world.position[0]
        spread = seen(true, 0.6)
        flight.see(world.time, true + noise * np.linalg.cholesky(spread) @ rng.normal(size=3), spread)
    foreseen = flight.at(world.time + 0.2)[0]
    world.advance(0.2)
    assert flight.bounces == 1
    assert np.linalg.norm(foreseen - world.position[0]) < (0.1 if noise else 0.05)


def test_one_strange_look_is_no_bounce():
    flight = watched(np.array([3.0, 0, 1.3]), np.array([-3.0, 0, 4]), 0.4)
    flight.see(0.71, np.array([0.0, 2.0, 0.0]), 1e-3 * np.eye(3))
    true = fallen(np.array([3.0, 0, 1.3]), np.array([-3.0, 0, 4]), 0.42)
    flight.see(0.72, true, 1e-3 * np.eye(3))
    assert flight.bounces == 0


def told(time, place, blind=False):
    """What both eyes tell of a place; or only the left one."""
    centres = EYES + [[0.0, 0.03, 0.0], [0.0, -0.03, 0.0]]
    ways = place - centres
    directions = ways / np.linalg.norm(ways, axis=1, keepdims=True)
    discrepancy = np.array([[0.0, 0.0], [np.nan if blind else 0.0] * 2])
    return Percept(time, np.zeros((2, 3), np.uint8), discrepancy, directions, centres)


@given(st.tuples(st.floats(0.3, 3.0), number, number).map(np.array))
def test_lines_of_both_eyes_pass_each_other_where_they_look(place):
    percept = told(0.0, EYES + place)
    np.testing.assert_allclose(percept.fixation, EYES + place, atol=1e-8)
    assert percept.baseline == pytest.approx(0.06)
    assert told(0.0, EYES + place, blind=True).fixation is None
    assert crossing(percept.centres, percept.directions * [[1.0], [-1.0]]) is None


def test_the_eyes_converge_on_near_balls_and_limbs_tell_of_far_ones():
    """A limb that errs by 0.2 m moves the estimate little when the ball is near, and much when it is far."""
    shares = []
    for distance in (0.4, 1.0, 4.0):
        meeting, place = Meeting(PLACES, PLAN.flight, PLAN.meeting), EYES + [distance, 0.0, 0.0]
        meeting.notice(told(0.0, place), np.array([0.5, 0.0, 0.0]), place - [0.3, 0.0, 0.0])
        shares.append((meeting.estimate - place)[0] / 0.2)
    assert 0.0 < shares[0] < shares[1] < 0.1 and 0.5 < shares[2] < 1.0
    meeting.reset()
    meeting.notice(told(0.0, place, blind=True), np.array([0.5, 0.0, 0.0]), place - [0.3, 0.0, 0.0])
    assert np.linalg.norm(meeting.estimate - EYES) == pytest.approx(4.2, abs=0.01)


PLACES = np.random.default_rng(5).uniform((0.2, -0.6, 0.7), (0.6, 0.0, 1.3), (3000, 3))


@given(st.floats(0.8, 1.4), st.tuples(st.floats(0.3, 0.5), st.floats(-0.5, -0.1), st.floats(0.8, 1.2)).map(np.array))
def test_a_ball_is_met_on_its_way(flight, target):
    """The goal lies within reach, and where the ball passes."""
    muzzle, hand = np.array([3.0, 0.1, 1.2]), np.array([0.37, -0.35, 0.8])
    velocity = (target - muzzle) / flight - 0.5 * flight * GRAVITY
    meeting = Meeting(PLACES, PLAN.flight, PLAN.meeting)
    assert meeting.goal() is None
    for time in np.arange(0.0, 0.7 * flight, LOOK):
        place = fallen(muzzle, velocity, time)
        meeting.notice(told(time, place), place - hand, hand)
    path = np.array([fallen(muzzle, velocity, time) for time in np.linspace(0, 2 * flight, 2000)])
    assert np.linalg.norm(path - meeting.goal(), axis=1).min() < 0.03
    assert np.linalg.norm(PLACES - meeting.goal(), axis=1).min() < 0.08


def test_a_limb_is_made_ready_where_the_ball_passes_out_of_reach():
    meeting, hand = Meeting(PLACES, PLAN.flight, PLAN.meeting), np.array([0.37, -0.35, 0.8])
    for time in np.arange(0.0, 0.3, LOOK):
        place = fallen(np.array([2.0, -0.4, 1.2]), np.zeros(3), time)
        meeting.notice(told(time, place), place - hand, hand)
    assert np.linalg.norm(PLACES - meeting.goal(), axis=1).min() == 0.0
    assert meeting.goal()[0] > 0.55
    meeting.reset()
    assert meeting.goal() is None and not meeting.flight.known
