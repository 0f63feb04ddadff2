"""What stands on stage: body, targets, ink and props; where the camera stands; colours."""

import numpy as np
import pytest
from render_bodies import INSTANTS, record, turned, write_body

from anthro.render.framing import azimuth_deg, framed_bones
from anthro.render.mesh import linear_rgb
from anthro.render.palette import (
    ARM_COLOURS,
    LEG_COLOURS,
    PALE,
    TRUNK_COLOURS,
    drawn_group,
    group_colour,
    legend,
    limb_muscles,
    shades,
)
from anthro.render.rollout import read_rollout
from anthro.render.scene import TARGET_COLOUR
from anthro.render.stage import INK_COLOUR, TARGET_RADIUS, Stage


@pytest.fixture
def run(tmp_path):
    write_body(tmp_path)
    return tmp_path


def stage(run, **changes):
    record(run, **changes)
    return Stage(read_rollout(run, "on_off"))


def seen(parts, colour=None):
    """Vertices of all parts in the world, or of those that show a colour."""
    points = []
    for part in parts:
        of_colour = colour is None or np.isclose(part.mesh.colours, linear_rgb(colour), atol=1e-6).all(axis=1).any()
        if of_colour:
            points.append(part.mesh.vertices @ part.rotation.T + part.position)
    return np.concatenate(points) if points else np.empty((0, 3))


def test_targets_are_balls_and_those_that_are_not_there_are_hidden(run):
    target = np.full((INSTANTS, 2, 3), [0.5, 0.0, 1.0])
    target[:, 1] = np.nan
    target[60:, 1] = [0.5, 0.0, 2.0]
    scene = stage(run, limbs="left_arm neck_seated", target=target)
    for time, top in ((1.0, 1.0), (8.0, 2.0)):
        balls = seen(scene.parts(time), TARGET_COLOUR)
        assert balls[:, 2].max() == pytest.approx(top + TARGET_RADIUS, abs=1e-4)
    assert not len(seen(stage(run, target=np.full((INSTANTS, 1, 3), np.nan)).parts(1.0), TARGET_COLOUR))


def test_ink_grows_with_time_where_the_pen_is_down(run):
    time = np.arange(INSTANTS) * 0.1
    pen = np.stack([np.full(INSTANTS, 0.5), time / 10, np.ones(INSTANTS)], axis=1)
    down = (time < 4) | (time > 6)
    scene = stage(run, pen=pen, pen_down=down.astype(np.uint8))
    assert not len(seen(scene.parts(0.0), INK_COLOUR))
    half, whole = seen(scene.parts(3.0), INK_COLOUR)[:, 1], seen(scene.parts(11.9), INK_COLOUR)[:, 1]
    assert half.max() == pytest.approx(0.3, abs=0.005)
    assert whole.max() == pytest.approx(1.19, abs=0.005)
    assert not ((whole > 0.41) & (whole < 0.6)).any()


def test_base_tilts_the_body_not_the_world(run):
    base = np.concatenate([np.tile([1.0, 0, 0.2], (INSTANTS, 1)), turned([0, 1, 0], np.full(INSTANTS, -90))], axis=1)
    still = {"qpos": np.zeros((INSTANTS, 3)), "target": np.full((INSTANTS, 1, 3), np.nan)}
    upright, supine = stage(run, **still), stage(run, **still, base=base)
    tall, flat = seen(upright.parts(0.0)), seen(supine.parts(0.0))
    assert np.ptp(tall[:, 2]) > 1.2 and np.ptp(flat[:, 2]) < 0.6
    # Head first towards -x, face up: what was above the root bone lies behind it.
    assert flat[:, 0].min() == pytest.approx(1.0 - (tall[:, 2].max() - 0.5), abs=1e-5)
    assert supine.body.model.body_pos[1].tolist() == [0, 0, 0.5]
    camera, studio = supine.shot(60, 40)
    assert camera.axes[1, 2] > 0.9 and studio.key_axis[2] > 0.5


def test_a_stool_carries_the_pelvis_and_follows_it(run):
    base = np.tile([0.0, 0, 0.5, 1, 0, 0, 0], (INSTANTS, 1))
    base[60:, 2] = 0.55
    scene = stage(run, base=base, props="stool", qpos=np.zeros((INSTANTS, 3)))
    seat, stand = (piece.part for piece in scene._pieces)
    for time, rise in ((1.0, 0.0), (9.0, 0.05)):
        scene.parts(time)
        pelvis = 0.5 - 0.05 + 0.25 - 0.3 + rise
        assert pelvis - 0.03 < seen([seat])[:, 2].max() < pelvis
        assert seen([stand])[:, 2].min() == pytest.approx(scene.shot(60, 40)[1].floor, abs=1e-4)
        assert seen([seat])[:, 2].min() < seen([stand])[:, 2].max()  # one tube slides in the other


def test_a_chair_reclines_on_its_foot(run):
    degrees = np.where(np.arange(INSTANTS) < 60, 0, -30)
    base = np.concatenate([np.tile([0.0, 0, 0.5], (INSTANTS, 1)), turned([0, 1, 0], degrees)], axis=1)
    scene = stage(run, base=base, props="chair", qpos=np.zeros((INSTANTS, 3)))
    shell, foot = (piece.part for piece in scene._pieces)
    backs, feet = [], []
    for time in (1.0, 9.0):
        scene.parts(time)
        backs.append(seen([shell])[:, 0].min())
        feet.append(seen([foot]))
    assert backs[1] < backs[0] - 0.1 and np.array_equal(*feet)
    scene.parts(1.0)
    bones = [seen([part])[:, 0].min() for part in scene._bones.values()]
    assert seen([shell])[:, 0].min() < min(bones)


def test_the_floor_bears_the_body_only_if_there_is_one(run):
    still = {"qpos": np.zeros((INSTANTS, 3))}
    lowest = seen(stage(run, **still, target=np.full((INSTANTS, 1, 3), np.nan)).parts(0.0))[:, 2].min()
    floors = [stage(run, **still, props=props).shot(60, 40)[1].floor for props in ("floor", "stool", "")]
    assert floors == pytest.approx([lowest, lowest, lowest - 0.05], abs=1e-4)


def test_the_camera_frames_what_moves(run):
    stages = {limbs: stage(run, limbs=limbs) for limbs in ("neck_seated", "left_arm", "right_leg")}
    names = {
        limbs: {scene.body.model.body(bone).name for bone in framed_bones(scene.body.model, [limbs])}
        for limbs, scene in stages.items()
    }
    assert names["neck_seated"] == {"T1", "cranium"}
    assert names["left_arm"] == {"sacrum", "hip_bone_r", "T1", "cranium", "humerus_l"}
    assert names["right_leg"] == names["left_arm"] | {"femur_r"}
    far = {limbs: scene.shot(60, 40)[0].position[:2] for limbs, scene in stages.items()}
    assert np.linalg.norm(far["neck_seated"]) < np.linalg.norm(far["left_arm"])
    turned_ = stages["left_arm"].shot(60, 40, azimuth=180)[0]
    assert turned_.axes[2] @ [1, 0, 0] > 0.9


def test_the_camera_stands_on_the_moving_side():
    assert azimuth_deg(["left_arm"], False) == -azimuth_deg(["right_arm"], False) > 0
    assert azimuth_deg(["left_arm", "neck_seated"], True) > 90


def test_a_still_is_the_same_every_time(run):
    first, second = (stage(run, props="chair").parts(2.0) for _ in range(2))
    assert np.array_equal(seen(first), seen(second))


def test_muscles_that_nobody_commands_are_pale_at_rest(run):
    record(run)
    body = read_rollout(run, "on_off").body
    led = limb_muscles(body, "left_arm")
    assert led.tolist() == [True, False, False]
    assert limb_muscles(body, "neck_seated").tolist() == [False, True, False]
    assert limb_muscles(body, "right_leg").tolist() == [False, False, True]
    assert not limb_muscles(body, "right_arm").any() and not limb_muscles(body, "core").any()
    colours, glow = shades(body.muscle_groups, np.zeros(3), led)
    assert np.allclose(colours[1:], linear_rgb(PALE)) and not glow.any()
    assert np.allclose(colours[0], 0.25 * linear_rgb(ARM_COLOURS["shoulder"]))


def test_muscles_brighten_with_activation_up_to_their_groups_colour():
    for group, colour in (ARM_COLOURS | LEG_COLOURS | TRUNK_COLOURS).items():
        colours, glow = shades([group] * 3, np.array([0, 0.3, 1]))
        assert np.all(np.diff(colours.sum(axis=1)) > 0) and np.all(np.diff(glow) > 0)
        assert np.allclose(colours[-1], linear_rgb(colour)) and glow[-1] == 0.5


def test_any_group_has_a_colour_and_a_word():
    assert group_colour("sternocleidomastoid") == TRUNK_COLOURS["front"]
    assert drawn_group("middle scalene") == "side" and drawn_group("splenius capitis") == "back"
    assert list(legend(["left_arm"])) == ["shoulder", "elbow", "forearm", "wrist"]
    both = legend(["right_arm", "left_leg", "core"])
    assert both["shoulder/hip"] == ARM_COLOURS["shoulder"] and "forearm/side" in both and "front" in both
