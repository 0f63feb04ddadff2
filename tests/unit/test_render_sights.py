"""Eyes, gaze, balls and slopes of a rollout on stage."""

import json

import numpy as np
import pytest
from render_bodies import INSTANTS, record, write_body

from anthro.eyes.eye import RADIUS, Eye
from anthro.render.mesh import linear_rgb
from anthro.render.parts import Ball
from anthro.render.rollout import read_rollout
from anthro.render.scene import TARGET_COLOUR
from anthro.render.sights import GAZE_COLOUR, GAZE_LENGTH, NEAR, SLOPE_THICKNESS
from anthro.render.stage import Stage
from anthro.world.surfaces import tilted

BALL_RADIUS = 0.05
SLOPE = tilted("slope", (1.5, 0.0, 0.8), (-1.0, 0.0), np.deg2rad(20), half_size=(0.2, 0.3))
HEAD = np.array([0.0, 0.0, 1.3])  # of the body, which stands upright
TOLD = ("name", "centre", "normal", "along", "half_size")


@pytest.fixture
def run(tmp_path):
    write_body(tmp_path)
    return tmp_path


def stage(run, attrs=None, **changes):
    columns = {"qpos": np.zeros((INSTANTS, 3)), "ball": np.full((INSTANTS, 1, 3), [0.6, 0.0, 1.3])}
    record(run, attrs={"ball_radius": BALL_RADIUS, "ball_colour": "#D02020"} | (attrs or {}), **columns | changes)
    return Stage(read_rollout(run, "on_off"))


def balls(parts, radius):
    return np.array([part.centre for part in parts if isinstance(part, Ball) and part.radius == radius]).reshape(-1, 3)


def coloured(parts, colour):
    meshes = [part.mesh for part in parts if not isinstance(part, Ball)]
    points = [mesh.vertices for mesh in meshes if np.allclose(mesh.colours[0], linear_rgb(colour), atol=1e-6)]
    return np.concatenate(points) if points else np.empty((0, 3))


def test_balls_stand_for_targets_and_are_hidden_out_of_play(run):
    path = np.full((INSTANTS, 1, 3), [0.6, 0.0, 1.3])
    path[60:] = np.nan
    scene = stage(run, ball=path)
    first, last = scene.parts(1.0), scene.parts(8.0)
    np.testing.assert_allclose(balls(first, BALL_RADIUS), [[0.6, 0.0, 1.3]])
    assert not len(balls(last, BALL_RADIUS))
    assert not len(coloured(first, TARGET_COLOUR)) and not len(coloured(last, TARGET_COLOUR))
    assert not len(balls(first, RADIUS))  # nothing is known of eyes
    record(run)
    assert len(coloured(Stage(read_rollout(run, "on_off")).parts(1.0), TARGET_COLOUR))


def test_lines_of_gaze_end_where_eyes_look_as_far_as_the_ball(run):
    ball = HEAD + [0.6, 0.1, -0.2]
    angles = np.array([Eye(side).angles_to(ball - HEAD) for side in ("left", "right")])
    scene = stage(run, ball=np.tile(ball, (INSTANTS, 1, 1)), eyes=np.tile(angles, (INSTANTS, 1, 1)))
    parts = scene.parts(1.0)
    np.testing.assert_allclose(balls(parts, RADIUS), [HEAD + Eye(side).centre for side in ("left", "right")])
    ends = coloured(parts, GAZE_COLOUR).reshape(2, 2, -1, 3).mean(axis=2)[:, 1]
    assert np.linalg.norm(ends - ball, axis=1).max() < 0.01  # both as long as from between the eyes
    without = np.full((INSTANTS, 1, 3), np.nan)
    ahead = stage(run, ball=without, eyes=np.zeros((INSTANTS, 2, 2))).parts(1.0)
    starts, ends = np.moveaxis(coloured(ahead, GAZE_COLOUR).reshape(2, 2, -1, 3).mean(axis=2), 1, 0)
    np.testing.assert_allclose(ends - starts, [[GAZE_LENGTH - RADIUS, 0, 0]] * 2, atol=1e-6)


def test_slopes_lie_where_balls_bounce(run):
    told = {name: getattr(SLOPE, name) for name in TOLD}
    scene = stage(run, {"slopes": json.dumps([told])})
    board = scene.parts(0.0)[-1 - len(balls(scene.parts(0.0), BALL_RADIUS))]
    local = (board.mesh.vertices - np.array(SLOPE.centre)) @ SLOPE.axes.T
    np.testing.assert_allclose(local.max(axis=0), [0.2, 0.3, 0.0], atol=1e-4)
    np.testing.assert_allclose(local.min(axis=0), [-0.2, -0.3, -SLOPE_THICKNESS], atol=1e-4)
    camera, _ = scene.shot(200, 100)
    seen = camera.project(board.mesh.vertices)
    assert (seen > 0).all() and (seen < [200, 100]).all()


def test_the_picture_holds_balls_that_are_near_or_over_slopes(run):
    far, over = [0.0, 0.0, 9.0], [1.5, 0.0, 2.5]
    path = np.full((INSTANTS, 1, 3), [0.6, 0.0, 1.3])
    path[:30], path[30:60] = far, over
    told = {name: getattr(SLOPE, name) for name in TOLD}
    with_slope, without = stage(run, {"slopes": json.dumps([told])}, ball=path), stage(run, ball=path)
    assert np.linalg.norm(np.array(over) - [0, 0, 0.5]) > NEAR

    def inside(scene, point):
        seen = scene.shot(200, 100)[0].project(np.array([point]))[0]
        return (seen > 0).all() and (seen < [200, 100]).all()

    assert [inside(with_slope, point) for point in (far, over, path[-1, 0])] == [False, True, True]
    assert [inside(without, point) for point in (far, over, path[-1, 0])] == [False, False, True]
