"""Which rays may meet which parts: against the same tests in plain numpy, and at their limits."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from anthro.eyes.vision import RED, WHITE
from anthro.render import culling
from anthro.render.mesh import linear_rgb, sphere
from anthro.render.parts import FAR, REAL, Ball, Hits, Part, Rays, Troop
from anthro.render.raytrace import intersect, occluded, within_reach

QUARTER = np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]])
AHEAD = np.array([1.0, 0.0, 0.0])


def rays_of(count, rng):
    ways = rng.normal(size=(count, 3))
    ways /= np.linalg.norm(ways, axis=1, keepdims=True)
    return Rays(rng.uniform(-2, 2, (count, 3)), ways, rng.choice([0.0, 0.5, 2.0, FAR], count).astype(REAL))


def passing(rays, ball, begin=0):
    """Of all rays from `begin` on."""
    end = len(rays.reach)
    told = np.empty(end - begin, bool)
    assert culling.pass_ball(rays.columns, rays.reach, np.asarray(ball, REAL), begin, end, told) == told.any()
    return told


def gap(rays, ball):
    """By how much rays pass a ball's test, in double precision: negative for those that miss it."""
    origins, ways = rays.columns[:3].T.astype(float), rays.columns[3:].T.astype(float)
    to = ball[:3] - origins
    ahead, away = (to * ways).sum(axis=1), (to * to).sum(axis=1)
    inside = ball[3] ** 2 - away
    aside = np.where(ahead > 0, inside + ahead**2, inside)
    return np.min([rays.reach, aside, ahead + ball[3], rays.reach - (ahead - ball[3])], axis=0)


@given(st.integers(0, 10_000), st.integers(0, 40))
def test_balls_are_passed_as_plain_geometry_says(seed, begin):
    rng = np.random.default_rng(seed)
    rays, ball = rays_of(150, rng), np.append(rng.uniform(-1, 1, 3), rng.uniform(0.05, 1.0))
    margin = gap(rays, ball)[begin:]
    sure = (np.abs(margin) > 1e-4) | (rays.reach[begin:] == 0)
    assert np.array_equal(passing(rays, ball, begin)[sure], (margin > 0)[sure])


@pytest.mark.parametrize(
    ("origin", "reach", "expected"),
    [
        ((0.0, 0, 0), FAR, True),
        ((4.0, 0, 0), FAR, False),  # the ball lies behind
        ((2.3, 0, 0), FAR, True),  # from within, its centre behind
        ((0.0, 0.49, 0), FAR, True),
        ((0.0, 0.51, 0), FAR, False),
        ((0.0, 0, 0), 1.51, True),
        ((0.0, 0, 0), 1.49, False),  # looks less far than the ball is
        ((2.0, 0, 0), 0.01, True),
        ((2.0, 0, 0), 0.0, False),  # looks no more
    ],
)
def test_rays_at_the_limits_of_a_ball(origin, reach, expected):
    rays = Rays(np.array(origin), AHEAD[None], np.array([reach], REAL))
    assert passing(rays, [2.0, 0, 0, 0.5]).tolist() == [expected]
    assert culling.reachable(rays.columns, rays.reach, np.array([[2.0, 0, 0, 0.5]], REAL)).tolist() == [expected]


def test_a_far_ball_that_is_grazed_is_not_lost_by_rounding():
    """Squares of 100 m hide those of 1 mm in single precision."""
    rays = Rays(np.array([[0.0, 0.0009, 0.0]]), AHEAD)
    assert passing(rays, [100.0, 0, 0, 0.001]).tolist() == [True]


@pytest.mark.parametrize("count", [1, culling.TILE - 1, culling.TILE, culling.TILE + 1, 3 * culling.TILE + 5])
def test_all_rays_are_tried_whatever_their_number(count):
    rng = np.random.default_rng(count)
    balls = np.column_stack([rng.uniform(-2, 2, (12, 3)), rng.uniform(0.01, 0.4, 12)]).astype(REAL)
    rays = rays_of(count, rng)
    found = culling.reachable(rays.columns, rays.reach, balls)
    assert found.tolist() == [passing(rays, ball).any() for ball in balls]
    # The last ray alone, too.
    rays.reach[:-1], rays.reach[-1] = 0, FAR
    met = np.append(rays.columns[:3, -1] + rays.columns[3:, -1], 0.1).astype(REAL)
    assert culling.reachable(rays.columns, rays.reach, met[None]).tolist() == [True]


@given(st.integers(0, 10_000))
def test_gathered_rays_pass_ball_and_box_and_are_carried_into_the_parts_frame(seed):
    rng = np.random.default_rng(seed)
    part = Part(sphere(np.zeros(3), 0.5, WHITE), QUARTER, rng.uniform(-1, 1, 3))
    rays = rays_of(culling.TILE + 40, rng)
    count = part._gather(rays, rays.reach)
    chosen = rays.chosen[:count]
    origins, ways = rays.columns[:3].T, rays.columns[3:].T
    starts, local = (origins - part.position) @ QUARTER, ways @ QUARTER
    assert np.allclose(rays.starts[:count], starts[chosen], atol=1e-6)
    assert np.allclose(rays.ways[:count], local[chosen], atol=1e-6)
    with np.errstate(divide="ignore"):
        ends = np.sort([(side - starts) / local for side in part._box], axis=0)
    near, far = np.maximum(ends[0].max(axis=1), 0), np.minimum(ends[1].min(axis=1), rays.reach)
    sure = (np.abs(far - near) > 1e-4) & (np.abs(gap(rays, part.ball)) > 1e-4) | (rays.reach == 0)
    wanted = (near <= far) & (gap(rays, part.ball) > 0)
    assert np.array_equal(np.isin(np.arange(len(rays.reach)), chosen)[sure], wanted[sure])


def test_only_parts_that_rays_may_meet_are_tried_the_nearer_ones_first():
    places = [(3.0, 0, 0), (1.0, 0, 0), (2.0, 5, 0), (-1.0, 0, 0)]
    parts = [Ball(0.2, WHITE, place) for place in places]
    assert within_reach(parts, Rays(np.zeros(3), AHEAD[None])) == [1, 0]
    assert within_reach(parts, Rays(np.zeros(3), AHEAD[None], np.array([2.0], REAL))) == [1]
    assert within_reach(parts, Rays(np.zeros(3), np.empty((0, 3)))) == []
    assert within_reach([], Rays(np.zeros(3), AHEAD[None])) == []


def test_parts_beyond_the_reach_are_not_looked_for():
    parts = [Part(sphere(np.array([x, 0.0, 0.0]), 0.2, WHITE)) for x in (1.0, 3.0)]
    ways = np.repeat(AHEAD[None], 2, axis=0)
    assert intersect(parts[1:], np.zeros(3), ways, np.full(2, 2.0, REAL)).part.tolist() == [-1, -1]
    assert intersect(parts, np.zeros(3), ways, np.full(2, 2.0, REAL)).part.tolist() == [0, 0]


def test_shadow_rays_that_do_not_look_count_as_occluded():
    ball, origins = Ball(0.2, WHITE, (1.0, 0, 0)), np.array([[0.0, 0, 0], [0.0, 1, 0], [0.0, 1, 0]])
    assert occluded([ball], origins, AHEAD, np.array([FAR, FAR, 0], REAL)).tolist() == [True, False, True]


def test_a_troop_is_placed_as_its_parts_are_one_by_one():
    meshes = [sphere(np.array([0.1 * k, 0.0, 0.2]), 0.05, WHITE) for k in range(3)]
    rng = np.random.default_rng(0)
    turns, places = np.linalg.qr(rng.normal(size=(3, 3, 3)))[0], rng.normal(size=(3, 3))
    alone = [Part(mesh, *frame) for mesh, *frame in zip(meshes, turns, places, strict=True)]
    together = [Part(mesh) for mesh in meshes]
    Troop(together).place(turns, places)
    for one, other in zip(alone, together, strict=True):
        assert np.array_equal(one.rotation, other.rotation) and np.array_equal(one.position, other.position)
        assert np.allclose(one.ball, other.ball, atol=1e-6)
    together[1].place(None, None)
    assert np.allclose(together[1].ball, Part(meshes[1]).ball) and np.allclose(together[2].ball, alone[2].ball)
    Troop([])


def test_a_painted_ball_shows_its_new_colour():
    ball, rays = Ball(0.2, WHITE, (1.0, 0, 0)), Rays(np.zeros(3), AHEAD[None])
    for colour in (RED, WHITE):
        hits = Hits(1)
        ball.paint(colour).meet(0, rays, hits)
        assert ball.colour == colour and np.allclose(hits.colour[0], linear_rgb(colour))
