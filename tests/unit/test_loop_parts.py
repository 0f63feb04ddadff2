"""The loop's plan, looks, gaze and leads, each on its own."""

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st

from anthro import config
from anthro.errors import UserError
from anthro.eyes.eye import SIDES, Eye
from anthro.eyes.vision import seen_from
from anthro.files import write_json
from anthro.loop.gaze import Gaze, head_target
from anthro.loop.leads import Reaching
from anthro.loop.percept import Onlooker, red_receptors
from anthro.loop.plan import loop_plan, read_loop_plan
from anthro.motor.senses import angles, direction
from anthro.sources import source_files

ROOT = Path(__file__).resolve().parents[2]
CONTENT = yaml.safe_load((ROOT / "config" / "loop.yaml").read_text())
PLAN = loop_plan(CONTENT)
EYES = tuple(Eye(side) for side in SIDES)
angle = st.floats(-0.6, 0.6)


def test_the_loop_knows_nothing_of_the_world_or_of_demos():
    """Nor of the offline teacher: what decides a step of the cycle is in the files that it imports."""
    files = source_files("anthro.loop.cycle", "anthro.loop.meeting", "anthro.loop.leads", src=ROOT / "src")
    rooms = {Path(file).relative_to(ROOT / "src" / "anthro").parts[0] for file in files}
    assert "loop" in rooms and not rooms & {"world", "demos", "learn"}
    assert not any(Path(file).stem in ("teacher", "kinematics", "effort") for file in files)


def test_the_plan_of_a_run_is_read(tmp_path):
    write_json(tmp_path / "specs" / "loop.json", config.load({"scale": "smoke"}, ROOT)["loop"])
    assert read_loop_plan(tmp_path) == PLAN


@pytest.mark.parametrize("change", [{"sight_stepz": 2}, {"gaze": {"position_gain": 1.0}}, {"sight_steps": 0}])
def test_a_plan_with_other_keys_is_refused(change):
    with pytest.raises(UserError, match="loop"):
        loop_plan(CONTENT | change)
    with pytest.raises(UserError, match="is missing"):
        loop_plan({name: value for name, value in CONTENT.items() if name != "flight"})


def test_red_is_told_from_skin_stool_white_and_dark():
    colours = [(160, 4, 4), (176, 102, 64), (40, 44, 50), (255, 255, 255), (20, 0, 0), (80, 30, 30)]
    nerve = np.array([colours, colours[::-1]], np.uint8).reshape(2, -1)
    assert red_receptors(nerve).tolist() == [2, 2]


class Looking:
    """Stand-in for eyes: a head at the origin, and optic nerve vectors as they are put here."""

    def __init__(self):
        self.eyes, self.angles, self.vector = EYES, np.array([[0.1, -0.2], [0.15, -0.1]]), np.zeros((2, 6))

    def see(self, data):
        return self.vector

    def head(self, data):
        return data.rotation, np.array([0.1, 0.2, 0.3])


def looked(point, rotation, eyes=(0, 1), red=(1, 1)):
    """A look of eyes whose DNNs answer exactly, at a point of the world."""
    look = Looking()
    look.vector[:] = np.array([[0.7, 0.0, 0.0] * 2] * 2) * np.array(red)[:, None]
    local = (point - np.array([0.1, 0.2, 0.3])) @ rotation
    told = np.array([seen_from(*each, local) for each in zip(EYES, look.angles, strict=True)])
    offset = np.array([0.1, -0.2, 0.3]) @ rotation
    offsets = np.array([offset @ eye.rotation(pair) for eye, pair in zip(EYES, look.angles, strict=True)])
    vision = SimpleNamespace(discrepancy=lambda nerve: told, offsets=lambda limb, nerve: offsets)
    onlooker = Onlooker(look, vision, 1, 2.0, eyes)
    return onlooker.look(SimpleNamespace(rotation=rotation), 0.5, ["right_arm"])


@given(st.floats(0.4, 3.0), angle, angle, angle)
def test_answers_in_the_frames_of_eyes_are_turned_into_the_worlds(distance, azimuth, elevation, turn):
    c, s = np.cos(turn), np.sin(turn)
    rotation = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1.0]])
    point = np.array([0.1, 0.2, 0.3]) + rotation @ (distance * direction(azimuth, elevation) + [0.1, 0, 0])
    percept = looked(point, rotation)
    for eye, way in zip(EYES, percept.directions, strict=True):
        true = point - (np.array([0.1, 0.2, 0.3]) + rotation @ eye.centre)
        np.testing.assert_allclose(way, true / np.linalg.norm(true), atol=1e-9)
    np.testing.assert_allclose(percept.offsets["right_arm"], [0.1, -0.2, 0.3], atol=1e-9)


def test_an_eye_that_is_shut_or_sees_no_target_goes_with_the_other():
    point = np.array([1.0, 0.1, 0.2])
    both = looked(point, np.eye(3))
    for percept in (looked(point, np.eye(3), eyes=(0,)), looked(point, np.eye(3), red=(1, 0))):
        np.testing.assert_array_equal(percept.directions, both.directions[[0, 0]])
        assert np.isnan(percept.discrepancy[1]).all() and np.isfinite(percept.discrepancy[0]).all()
    nothing = looked(point, np.eye(3), red=(0, 0))
    assert nothing.directions is None and not nothing.offsets and np.isnan(nothing.discrepancy).all()


def test_limb_vision_is_asked_for_foveated_targets_only():
    look = Looking()
    look.vector[:, ::3] = 0.7
    vision = SimpleNamespace(discrepancy=lambda nerve: np.full((2, 2), 0.3), offsets=lambda limb, nerve: 1 / 0)
    percept = Onlooker(look, vision, 1, 0.1).look(SimpleNamespace(rotation=np.eye(3)), 0.0, ["right_arm"])
    assert percept.directions is not None and not percept.offsets


def test_gaze_follows_what_moves_and_turns_back_as_the_head_turns():
    gaze, look = Gaze(PLAN.gaze), Looking()
    assert not gaze.command(look, np.eye(3), 0.0).any()
    for time in np.arange(0.0, 1.0, 0.01):
        gaze.follow(np.tile(direction(0.3 * time, -0.2), (2, 1)), time)
    late = 1.02
    np.testing.assert_allclose(angles(gaze.directions(late)[0]), [0.3 * late, -0.2], atol=2e-3)
    turn = np.deg2rad(20.0)
    rotation = np.array([[np.cos(turn), -np.sin(turn), 0], [np.sin(turn), np.cos(turn), 0], [0, 0, 1]])
    np.testing.assert_allclose(gaze.command(look, rotation, late)[0], [0.3 * late - turn, -0.2], atol=2e-3)
    gaze.follow(None, 1.03)
    assert not gaze.command(look, np.eye(3), 1.03).any()


def test_a_jump_moves_the_gaze_at_once_and_leaves_no_speed():
    gaze = Gaze(PLAN.gaze)
    for time, azimuth in ((0.0, 0.0), (0.01, 0.01), (0.02, 0.5), (0.03, 0.5)):
        gaze.follow(np.tile(direction(azimuth, 0.0), (2, 1)), time)
    np.testing.assert_allclose(gaze.directions(0.2), np.tile(direction(0.5, 0.0), (2, 1)))


@given(st.floats(-1.4, 1.4), st.floats(-1.2, 1.2), st.floats(-0.5, 0.5))
def test_the_head_is_led_no_farther_than_its_neck_goes(azimuth, elevation, turn):
    base = np.array([[np.cos(turn), -np.sin(turn), 0], [np.sin(turn), np.cos(turn), 0], [0, 0, 1]])
    found = np.rad2deg(angles(base.T @ head_target(PLAN.head, base, base @ direction(azimuth, elevation))))
    wanted = np.rad2deg([azimuth, elevation])
    limits = np.array([PLAN.head.azimuth_deg, PLAN.head.elevation_deg])
    np.testing.assert_allclose(found, np.clip(wanted, *limits.T), atol=1e-9)


def test_a_reach_goes_to_what_is_seen_by_shares():
    reach = Reaching(PLAN.reach)
    assert reach.goal() is None
    reach.notice(None, np.array([0.1, 0.0, 0.0]), np.zeros(3))
    np.testing.assert_allclose(reach.goal(), [0.1, 0.0, 0.0])
    reach.notice(None, np.array([0.1, 0.0, 0.0]), np.array([0.1, 0.0, 0.0]))
    np.testing.assert_allclose(reach.goal(), [0.1 + 0.1 * PLAN.reach.gain, 0.0, 0.0])
    np.testing.assert_allclose(reach.estimate, [0.2, 0.0, 0.0])
    reach.reset()
    assert reach.goal() is None and reach.estimate is None
