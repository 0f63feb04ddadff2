"""Where balls come from: cannon and sloped planes; and where limbs can meet them."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from anthro.errors import UserError
from anthro.streams import stream
from anthro.world.balls import Ball, Balls
from anthro.world.cannon import Cannon, launch_velocity
from anthro.world.capsules import Capsules
from anthro.world.reach import LOWEST, SPACING, Reach
from anthro.world.slopes import Drops, staircase
from anthro.world.surfaces import Slope, tilted

COUNT = 200
place = st.lists(st.floats(-4.0, 4.0), min_size=3, max_size=3)


def box(low, high):
    return lambda points: np.all((points >= low) & (points <= high), axis=-1)


IN_REACH = box((0.15, -0.7, 0.6), (0.55, 0.0, 1.3))


def test_a_launch_velocity_as_worked_by_hand():
    """3 m nearer and 0.5 m lower in 1 s: -3 m/s along, and 9.81 / 2 - 0.5 up."""
    np.testing.assert_allclose(launch_velocity((3.5, 0.2, 1.5), (0.5, -0.3, 1.0), 1.0), (-3.0, -0.5, 4.405))


@given(place, place, st.floats(0.3, 2.0))
def test_a_shot_passes_its_target_when_it_should(muzzle, target, flight):
    balls = Balls([Ball()])
    balls.throw(0, muzzle, launch_velocity(muzzle, target, flight))
    for _ in range(100):
        balls.advance(flight / 100)
    np.testing.assert_allclose(balls.position[0], target, atol=1e-9)


@pytest.mark.parametrize(
    "arguments", [((0, 0, 0), (1, 0, 0), 0.0), ((0, 0, np.nan), (1, 0, 0), 1.0), ((0, 0), (1, 0), 1.0)]
)
def test_a_launch_that_is_none_is_refused(arguments):
    with pytest.raises(UserError, match="cannon"):
        launch_velocity(*arguments)


def cannon(seed, **changes):
    return Cannon("right_arm", lambda: np.array([0.4, -0.3, 1.0]), stream(seed, "cannon"), **changes)


def test_a_cannon_shoots_from_its_box_and_within_its_flights_the_same_from_one_stream():
    shots, again = ([one.shoot() for one in [cannon(1)] for _ in range(50)] for _ in range(2))
    for shot, same in zip(shots, again, strict=True):
        np.testing.assert_array_equal(shot.velocity, same.velocity)
        assert shot.limb == "right_arm" and 0.8 <= shot.flight <= 1.4
        assert np.all((shot.muzzle >= (2.5, -0.6, 0.9)) & (shot.muzzle <= (4.0, 0.6, 1.5)))
        np.testing.assert_allclose(shot.position(shot.flight), shot.target)
        assert shot.position(np.linspace(0.0, 1.0, 7)).shape == (7, 3)
    assert not np.array_equal(cannon(2).shoot().velocity, shots[0].velocity)


@pytest.mark.parametrize("changes", [{"flight": (0.0, 1.0)}, {"flight": (1.4, 0.8)}, {"low": (9, 0, 0)}])
def test_a_cannon_that_cannot_shoot_is_refused(changes):
    with pytest.raises(UserError, match="cannon"):
        cannon(1, **changes)


def drops(seed, **changes):
    return Drops(**{"slopes": staircase(), "ball": Ball(), "within": IN_REACH, "rng": stream(seed, "drops")} | changes)


def test_drops_come_into_reach_after_a_bounce_in_time_the_same_from_one_stream():
    first, again = drops(3), drops(3)
    for _ in range(8):
        drop, same = first.draw(), again.draw()
        np.testing.assert_array_equal(drop.position, same.position)
        assert 0.8 <= drop.arrival <= 2.0 and drop.bounces >= 1 and IN_REACH(drop.point)
        balls = Balls([Ball()], surfaces=staircase())
        balls.throw(0, drop.position, drop.velocity)
        for _ in range(round(drop.arrival / 0.005)):
            balls.advance(0.005)
        np.testing.assert_allclose(balls.position[0], drop.point, atol=1e-9)
        assert len(balls.hits) == drop.bounces


def test_drops_that_never_come_or_come_too_soon_are_none():
    assert drops(1, within=box((8, 8, 8), (9, 9, 9))).follow((2.0, -0.3, 2.3), (0, 0, 0)) is None
    everywhere = drops(1, within=lambda points: np.ones(len(points), bool))
    assert everywhere.follow((2.0, -0.3, 2.3), (0, 0, 0)) is None


@pytest.mark.parametrize("changes", [{"slopes": []}, {"arrival": (2.0, 0.8)}, {"low": (9, 0, 0)}])
def test_drops_that_cannot_be_are_refused(changes):
    with pytest.raises(UserError, match="drops"):
        drops(1, **changes)


def test_hopeless_drops_are_given_up():
    flat = [Slope("flat", (2.0, -0.3, 1.0))]
    with pytest.raises(UserError, match="came into reach"):
        drops(1, slopes=flat, speed=0.0, arrival=(0.8, 0.9)).draw()


def test_a_tilted_slope_falls_the_way_it_is_told():
    along, across, normal = tilted("s", (0, 0, 0), (-1.0, 0.0), np.pi / 6).axes
    np.testing.assert_allclose(along, (-np.cos(np.pi / 6), 0.0, -0.5), atol=1e-12)
    np.testing.assert_allclose(normal, (-0.5, 0.0, np.cos(np.pi / 6)), atol=1e-12)
    np.testing.assert_allclose(np.cross(along, across), normal, atol=1e-12)


def test_the_reach_of_a_seated_arm_and_leg(limb):
    for name in ("right_arm", "left_leg"):
        its = limb(name, "nakada2018")
        space = Reach(its, stream(1, f"reach.{name}"), count=COUNT)
        again = Reach(its, stream(1, f"reach.{name}"), count=COUNT)
        np.testing.assert_array_equal(space.points, again.points)
        assert space.points.shape == (COUNT, 3)
        assert space.points[:, 0].min() > 0.15 and space.points[:, 2].min() > LOWEST
        assert space.contains(space.draw()) and space.contains(space.points).all()
        assert space.contains(space.points + (0.0, 0.0, 0.99 * SPACING)).all()
        assert not space.contains(np.array([2.0, 0.0, 1.0]))
        rest = Capsules(its.body, [row for row in Capsules(its.body).rows if row.limb in ("head", "trunk")])
        rest.refresh(its.body.simulator())
        assert rest.clearance(space.points).min() > 0.06


def test_a_reach_that_is_none_is_refused(limb):
    its = limb("right_arm", "nakada2018")
    for changes in ({"share": 0.0}, {"share": 1.5}, {"count": 0}, {"ahead": 3.0, "count": 5}):
        with pytest.raises(UserError, match="reach of right_arm"):
            Reach(its, stream(1, "reach"), **changes)
