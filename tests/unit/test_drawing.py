"""Given trajectories, the error of ink on them, and the figures that show both."""

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from PIL import Image
from scipy.spatial.transform import Rotation

from anthro.errors import UserError
from anthro.figures.nakada2018 import fig26_drawing, fig27_reclining
from anthro.files import read_shard, write_json, write_shard
from anthro.world.glyphs import GLYPHS
from anthro.world.path_error import distance_to_path, path_error
from anthro.world.strokes import Stroke, butterfly, writing
from anthro.world.trajectory import STRAIGHT_RADIUS, Plane, Trajectory

DESK = Plane([0.4, 0.1, 1.0], [0.0, -1.0, 0.0], [0.0, 0.0, 1.0])  # upright before a body that faces +x
CHARACTERS = "".join(GLYPHS)


def bounds(strokes):
    points = np.vstack([stroke.points for stroke in strokes])
    return points.min(axis=0), points.max(axis=0)


def ellipse(a, b, points=2000):
    angle = np.linspace(0, 2 * np.pi, points)
    return Stroke(np.stack([a * np.cos(angle), b * np.sin(angle)], axis=1)), angle


def test_a_butterfly_is_as_wide_as_asked_centred_closed_and_its_own_mirror_image():
    wings, body, left, right = strokes = butterfly(0.3)
    low, high = bounds(strokes)
    assert high[0] - low[0] == pytest.approx(0.3)
    np.testing.assert_allclose(low + high, 0, atol=1e-12)
    assert wings.closed and body.closed and not left.closed
    mirror = np.array([-1.0, 1.0])
    np.testing.assert_allclose(wings.points, wings.points[::-1] * mirror, atol=1e-12)
    np.testing.assert_allclose(left.points, right.points * mirror, atol=1e-12)


def test_the_wings_are_smooth_and_their_points_evenly_spaced():
    def sharpest(points):
        steps = np.diff(butterfly(0.3, points)[0].points, axis=0)
        lengths = np.linalg.norm(steps, axis=1)
        assert np.ptp(lengths) < 0.01 * lengths.mean()
        around = np.vstack([steps, steps[:1]]) / np.append(lengths, lengths[0])[:, None]
        return np.arccos((around[1:] * around[:-1]).sum(axis=1)).max()

    assert sharpest(400) < 0.25  # of a corner it would stay what it is, of a curve it falls with the spacing
    assert sharpest(1600) == pytest.approx(sharpest(400) / 4, rel=0.05)


def test_drawings_grow_in_proportion():
    assert butterfly(0.6)[0].length == pytest.approx(2 * butterfly(0.3)[0].length)
    assert sum(s.length for s in writing("A1", 0.1)) == pytest.approx(2 * sum(s.length for s in writing("A1", 0.05)))


def test_letters_have_the_lengths_of_their_lines_and_arcs():
    (stem,) = writing("I", 0.1)
    assert stem.length == pytest.approx(0.1)
    stem, bar = writing("T", 0.1)
    assert (stem.length, bar.length) == (pytest.approx(0.1), pytest.approx(0.062))
    low, high = bounds(writing("O", 0.1))
    np.testing.assert_allclose([low, high], [[-0.042, -0.05], [0.042, 0.05]], atol=1e-4)


@pytest.mark.parametrize("character", [c for c in CHARACTERS if c != " "])
def test_every_glyph_stands_on_the_base_line_and_is_a_capital_high(character):
    low, high = bounds(writing(character, 1.0))
    assert high[1] - low[1] == pytest.approx(1.0, abs=0.01 if character != "Q" else 0.1)
    assert high[0] - low[0] < 1.0


def test_capitals_and_figures_are_all_there_and_letters_do_not_touch():
    assert set(CHARACTERS) == set("ABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789 ")
    left, right = writing("II", 1.0)
    assert right.points[0, 0] - left.points[0, 0] == pytest.approx(0.26)
    left, right = writing("I I", 1.0)
    assert right.points[0, 0] - left.points[0, 0] == pytest.approx(0.26 + 0.38)


@pytest.mark.parametrize(
    "make, told",
    [
        (lambda: writing("", 0.1), "nothing to write"),
        (lambda: writing("  ", 0.1), "nothing to write"),
        (lambda: writing("Ab", 0.1), "no glyph for 'b'"),
        (lambda: writing("A", 0.0), "height"),
        (lambda: writing("A", float("nan")), "height"),
        (lambda: butterfly(-0.3), "width"),
        (lambda: Stroke([[0, 0]]), "two finite points"),
        (lambda: Stroke([[0, 0], [0, np.inf]]), "two finite points"),
        (lambda: Stroke([[1, 1], [1, 1]]), "no length"),
        (lambda: Trajectory([], DESK, 0.1), "no strokes"),
        (lambda: Trajectory(butterfly(0.3), DESK, 0.0), "speed"),
        (lambda: Trajectory(butterfly(0.3), DESK, 0.1, lift=-0.01), "lift"),
        (lambda: Plane([0, 0, 0], [1, 0, 0], [2, 0, 0]), "parallel"),
        (lambda: Plane([0, 0, 0], [0, 0, 0], [0, 0, 1]), "parallel"),
        (lambda: Plane([0, 0], [1, 0, 0], [0, 0, 1]), "origin"),
        (lambda: path_error(np.zeros((3, 3)), np.zeros((3, 3)), np.zeros(3)), "nothing is drawn"),
        (lambda: path_error(np.zeros((3, 3)), np.zeros((3, 3)), np.zeros(4)), "do not go with"),
        (lambda: path_error(np.full((3, 3), np.nan), np.eye(3), np.ones(3)), "not finite"),
    ],
)
def test_bad_input_is_one_clear_line(make, told):
    with pytest.raises(UserError, match=told):
        make()


def test_a_plane_places_right_up_and_towards_the_reader():
    np.testing.assert_allclose(DESK.place([0.1, 0.2, 0.03]), [0.37, 0.0, 1.2])
    np.testing.assert_allclose(DESK.locate([0.37, 0.0, 1.2]), [0.1, 0.2, 0.03], atol=1e-15)
    leaning = Plane([0, 0, 0], [2, 0, 0], [5, 0, 1])
    np.testing.assert_allclose(leaning.axes, [[1, 0, 0], [0, 0, 1], [0, -1, 0]], atol=1e-15)


def test_a_straight_line_is_drawn_at_the_speed_between_its_ends():
    path = Trajectory([Stroke([[0, 0], [0.3, 0]])], DESK, 0.1)
    assert path.duration == pytest.approx(0.3 / 0.1 + 0.2)  # either ramp of 0.2 s costs half its time
    middle = np.linspace(0.5, 2.5, 21)
    np.testing.assert_allclose(np.diff(path.reference(middle)[:, 0]), 0.01, rtol=1e-6)
    np.testing.assert_allclose(path.reference([0.0, path.duration]), [[0, 0, 0], [0.3, 0, 0]], atol=1e-12)
    short = Trajectory([Stroke([[0, 0], [0.01, 0]])], DESK, 0.1)
    assert short.duration == pytest.approx(0.4)  # half the speed: 0.01 m in two ramps of 0.2 s


def test_speed_follows_the_two_thirds_power_law():
    a, b, speed = 0.1, 0.04, 0.08
    stroke, angle = ellipse(a, b)
    path = Trajectory([stroke], DESK, speed)
    times = np.arange(0.3, path.duration - 0.3, 1e-3)
    x, y, _ = path.reference(times).T
    travelled = np.hypot(np.gradient(x, times), np.gradient(y, times))
    where = np.arctan2(y / b, x / a)
    curvature = a * b / (a**2 * np.sin(where) ** 2 + b**2 * np.cos(where) ** 2) ** 1.5
    law = speed * (1 + STRAIGHT_RADIUS * curvature) ** (-1 / 3)
    np.testing.assert_allclose(travelled[5:-5], law[5:-5], rtol=0.02)
    assert travelled.max() / travelled.min() > 1.5


def test_the_pen_rests_at_corners_and_is_lifted_between_strokes():
    corner = Trajectory([Stroke([[0, 0], [0.1, 0], [0.1, 0.1]])], DESK, 0.1)
    half = corner.duration / 2
    np.testing.assert_allclose(corner.reference(half), [0.1, 0, 0], atol=1e-9)
    assert np.linalg.norm(corner.reference(half + 1e-3) - corner.reference(half)) < 1e-6
    assert corner.pen_down(np.linspace(0, corner.duration, 50)).all()
    two = Trajectory(writing("II", 0.1), DESK, 0.1, lift=0.02)
    times = np.linspace(0, two.duration, 2001)
    places, down = two.reference(times), two.pen_down(times)
    assert np.abs(places[down, 2]).max() < 1e-12
    assert places[:, 2].max() == pytest.approx(0.02, rel=1e-3)
    assert down[0] and down[-1] and 1 == (np.diff(down.astype(int)) == -1).sum()
    assert not two.pen_down(-0.01) and not two.pen_down(two.duration + 0.01)


def test_positions_are_those_of_the_plane_for_one_time_or_many():
    path = Trajectory(butterfly(0.3), DESK, 0.1)
    times = np.linspace(-1, path.duration + 1, 40)
    many = path.position(times)
    assert many.shape == (40, 3) and path.position(1.0).shape == (3,) and np.shape(path.pen_down(1.0)) == ()
    np.testing.assert_allclose(many, [path.position(t) for t in times])
    np.testing.assert_allclose(DESK.locate(many), path.reference(times), atol=1e-12)
    np.testing.assert_allclose(many[-1], path.position(path.duration))


@settings(max_examples=25)
@given(st.text(CHARACTERS, min_size=1, max_size=4).filter(str.strip), st.floats(0.02, 0.5), st.floats(0.02, 0.12))
@example("SIGGRAPH 2018", 0.1, 0.05)
def test_a_trajectory_is_continuous_bounded_in_speed_and_draws_all_its_strokes(text, speed, height):
    strokes = writing(text, height)
    path = Trajectory(strokes, DESK, speed)
    times = np.linspace(0, path.duration, 1 + int(path.duration / 2e-3))
    places, down = path.reference(times), path.pen_down(times)
    assert np.isfinite(places).all()
    travelled = np.linalg.norm(np.diff(places, axis=0), axis=1) / times[1]
    assert travelled.max() < 3 * speed + 1e-6
    assert travelled[down[1:] & down[:-1]].max() < 1.02 * speed
    drawn = np.linalg.norm(np.diff(places, axis=0), axis=1)[down[1:] & down[:-1]].sum()
    assert drawn == pytest.approx(sum(stroke.length for stroke in strokes), rel=0.02)
    np.testing.assert_allclose(places[0, :2], strokes[0].points[0], atol=1e-9)
    np.testing.assert_allclose(places[-1, :2], strokes[-1].points[-1], atol=1e-9)


def test_the_error_of_ink_is_that_worked_by_hand():
    x = np.linspace(0, 1, 101)
    line = np.stack([x, 0 * x, 0 * x], axis=1)
    down = np.ones(101, bool)
    shifted = path_error(line + [0, 0.003, 0.004], line, down)
    assert shifted == pytest.approx((0.005, 0.005), rel=1e-3)
    assert path_error(line, line, down) == pytest.approx((0, 0), abs=1e-4)
    still = path_error(0 * line, line, down)  # a finger that never moves
    assert still == pytest.approx((0, np.sqrt(1 / 3)), rel=1e-3, abs=1e-4)
    halved = path_error(line * [0.5, 1, 1], line, down)  # skips the far half: rms of 0..0.5 over half the path
    assert halved.rms == pytest.approx(0, abs=1e-4)
    assert halved.coverage_rms == pytest.approx(np.sqrt(0.5**3 / 3), rel=1e-3)


def test_only_ink_with_the_pen_down_counts_and_strokes_are_not_joined():
    reference = np.array([[0, 0], [1, 0], [1, 0.5], [1, 1], [0, 1]], float)
    down = np.array([1, 1, 0, 1, 1])
    ink = reference.copy()
    ink[2] = 7
    assert path_error(ink, reference, down) == pytest.approx((0, 0), abs=1e-4)
    assert distance_to_path([[1.5, 0.5], [0.2, 0.1]], reference, down) == pytest.approx(
        [np.hypot(0.5, 0.5), 0.1], abs=1e-4
    )


def recorded(folder, strokes, wobble=0.004, base=False):
    """A demo's rollout and metrics whose ink sways about its trajectory."""
    path = Trajectory(strokes, DESK, 0.1)
    time = np.arange(0, path.duration, 0.01)
    reference, down = path.reference(time), path.pen_down(time)
    ink = reference + wobble * np.stack([np.sin(5 * time), np.cos(3 * time), 0.5 * np.sin(time)], axis=1)
    columns = {"time": time, "ink": ink, "reference": reference, "pen_down": down.astype(np.uint8)}
    if base:
        lean = -np.radians(15) * (1 - np.cos(time))
        quaternion = Rotation.from_rotvec(lean[:, None] * [0, 1, 0]).as_quat(scalar_first=True)
        columns["base"] = np.hstack([np.zeros((len(time), 3)), quaternion])
    write_shard(folder / "rollout.h5", columns)
    error = path_error(ink, reference, down)
    write_json(folder / "metrics.json", {"rms_error_m": error.rms, "coverage_rms_m": error.coverage_rms})


def test_leaning_back_is_positive_whatever_the_bone_s_own_frame():
    own = Rotation.from_euler("xyz", [0.4, -0.2, 1.0])
    turned = Rotation.from_rotvec(np.outer([0, -0.3, 0.1], [0, 1, 0])) * own
    base = np.hstack([np.zeros((3, 3)), turned.as_quat(scalar_first=True)])
    np.testing.assert_allclose(fig27_reclining.reclined(base), [0, 0.3, -0.1], atol=1e-12)


def test_both_figures_draw_from_rollouts(tmp_path):
    demos = tmp_path / "demos"
    recorded(demos / "draw_butterfly", butterfly(0.3))
    recorded(demos / "write", writing("SIGGRAPH 2018", 0.05))
    recorded(demos / "write_reclining", writing("SIGGRAPH 2018", 0.05), wobble=0.01, base=True)
    for figure in (fig26_drawing, fig27_reclining):
        out = tmp_path / f"{figure.__name__}.png"
        figure.main(["--run", str(tmp_path), "--out", str(out)])
        with Image.open(out) as drawn:
            assert drawn.size[0] == 1400 and len(drawn.getcolors()) > 20


def test_figures_tell_what_is_missing(tmp_path, refusal):
    arguments = ["--run", tmp_path, "--out", tmp_path / "a.png"]
    assert "draw_butterfly/rollout.h5: no such file" in refusal(fig26_drawing.main, arguments)
    folder = tmp_path / "demos" / "write_reclining"
    recorded(folder, writing("I", 0.05))
    assert "no column base" in refusal(fig27_reclining.main, arguments)
    recorded(folder, writing("I", 0.05), base=True)
    write_json(folder / "metrics.json", {"rms_error_m": 0.01})
    assert "no coverage_rms_m" in refusal(fig27_reclining.main, arguments)
    recorded(folder, writing("I", 0.05), base=True)
    columns, _ = read_shard(folder / "rollout.h5")
    write_shard(folder / "rollout.h5", columns | {"ink": np.nan * columns["ink"]})
    assert "not finite" in refusal(fig27_reclining.main, arguments)
    assert not (tmp_path / "a.png").exists()
