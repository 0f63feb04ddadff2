"""Still pictures of a body: spindles, views, plates and the sheet of joints."""

import mujoco
import numpy as np
import pytest

from anthro.body import Body
from anthro.errors import UserError
from anthro.figures.limb import limb_plate
from anthro.figures.plate import GAP, HEAD, plate
from anthro.figures.zhou2021.joint_sweeps import PIXELS, Sweeper, swept_joints
from anthro.render.anatomy import BACK, FRONT, RIGHT, Anatomy, assemble, picture, spindle, width_of

# A trunk, an upper arm and a forearm of boxes on the right, an upper arm on the left.
MODEL = """
<mujoco>
  <compiler autolimits="false"/>
  <asset>
    <mesh name="box" vertex="-.02 -.02 0  .02 -.02 0  .02 .02 0  -.02 .02 0
                             -.02 -.02 -.3  .02 -.02 -.3  .02 .02 -.3  -.02 .02 -.3"/>
  </asset>
  <worldbody>
    <body name="trunk" pos="0 0 1.2">
      <geom name="trunk" type="mesh" mesh="box" mass="1"/>
      <site name="origin" pos="0 -.02 -.05"/>
      <site name="chest" pos="0 0 -.28"/>
      <body name="upper_r" pos="0 -.2 0">
        <joint name="shoulder_r" axis="0 1 0"/>
        <geom name="upper_r" type="mesh" mesh="box" mass="1"/>
        <site name="upper" pos=".03 0 -.05"/>
        <body name="fore_r" pos="0 0 -.32">
          <joint name="elbow_r" axis="0 0 1"/>
          <geom name="fore_r" type="mesh" mesh="box" mass="1"/>
          <site name="insertion" pos=".03 0 -.1"/>
        </body>
      </body>
      <body name="upper_l" pos="0 .2 0">
        <joint name="shoulder_l" axis="0 1 0"/>
        <geom name="upper_l" type="mesh" mesh="box" mass="1"/>
        <site name="other" pos="0 0 -.1"/>
      </body>
    </body>
  </worldbody>
  <tendon>
    <spatial name="chest_r"><site site="origin"/><site site="upper"/></spatial>
    <spatial name="biceps_r"><site site="upper"/><site site="insertion"/></spatial>
    <spatial name="chest_l"><site site="origin"/><site site="other"/></spatial>
    <spatial name="costal_cartilage_r"><site site="chest"/><site site="upper"/></spatial>
    <spatial name="costal_cartilage_bend_r"><site site="chest"/><site site="upper"/></spatial>
  </tendon>
</mujoco>
"""
TABLES = {
    "joints": "joint,region,min,max,rest,stiffness,damping\n"
    "shoulder_r,arm,-1,2,0,0,0\nelbow_r,arm,0.5,1,0.5,0,0\nshoulder_l,arm,-1,2,0,0,0\n",
    "muscles": "muscle,region,group,max_force,slack_length,tendon_length\n"
    "chest_r,core,chest,600,0.1,0.1\nbiceps_r,arm,elbow,300,0.1,0.1\nchest_l,core,chest,600,0.1,0.1\n",
    "ligaments": "ligament,stiffness,damping,slack_low,slack_high\n"
    "costal_cartilage_r,1,1,0.1,0.1\ncostal_cartilage_bend_r,1,1,0.1,0.1\n",
    "contacts": "contact,radius,surfaces\n",
}


@pytest.fixture
def body(tmp_path):
    mujoco.mj_saveModel(mujoco.MjModel.from_xml_string(MODEL), str(tmp_path / "model.mjb"))
    for name, text in TABLES.items():
        (tmp_path / f"{name}.csv").write_text(text)
    return Body.load(tmp_path)


def radii(mesh, rings):
    points = mesh.vertices.reshape(rings, -1, 3)
    return np.linalg.norm(points - points.mean(axis=1, keepdims=True), axis=2).mean(axis=1)


def test_a_spindle_is_thick_and_red_in_its_belly_thin_and_white_at_its_ends():
    path = np.array([[0.0, 0, 0], [0, 0, 0.3]])
    mesh = spindle(path, 4e-4, 0.08)
    rings = len(mesh.vertices) // 10
    radius = radii(mesh, rings)
    assert radius[0] == radius[-1] == radius.min() and radius.min() < 0.3 * radius.max()
    red = mesh.colours[:, 0] / mesh.colours[:, 1]
    assert red[0] < 1.5 and red[-1] < 1.5 and red.max() > 4
    assert np.argmax(radius) < rings / 2  # the longer tendon lies at the insertion


def test_a_belly_grows_with_the_root_of_its_area_up_to_a_share_of_its_length():
    path = np.array([[0.0, 0, 0], [0, 0, 0.3]])
    widest = [radii(mesh, len(mesh.vertices) // 10).max() for mesh in (spindle(path, a, 0.1) for a in (1e-4, 4e-4, 1))]
    assert widest[1] == pytest.approx(2 * widest[0], rel=0.02)
    assert widest[2] < 0.05


def test_muscles_are_those_asked_for(body):
    anatomy = Anatomy(body)
    assert len(anatomy.muscles()) == 3
    assert len(anatomy.muscles(body.muscles_of("arm"))) == 1
    assert body.muscles_of("core") == ("chest_r", "chest_l")


def test_springs_that_stand_for_something_else_are_not_drawn(body):
    assert len(Anatomy(body).ligaments()) == 1
    assert not Anatomy(body).ligaments("_l")


def test_bones_lie_where_the_pose_puts_them(body):
    neutral, raised = Anatomy(body), Anatomy(body, np.array([np.pi / 2, 0, 0]))
    assert neutral.points(["fore_r"])[:, 2].min() == pytest.approx(0.58, abs=1e-6)
    assert raised.points(["fore_r"])[:, 0].min() < -0.6
    assert np.allclose(neutral.points(["trunk"]), raised.points(["trunk"]))


def test_a_bone_is_left_out_with_all_that_hangs_on_it(body):
    assert set(Anatomy(body).bones_without(["upper_r"])) == {"trunk", "upper_l"}


def test_framing_by_an_unknown_bone_is_one_clear_line(body):
    with pytest.raises(UserError, match="no bone wing"):
        Anatomy(body).points(["trunk", "wing"])


@pytest.mark.parametrize("view", [FRONT, RIGHT, BACK])
def test_a_picture_holds_all_points_on_white(body, view):
    anatomy = Anatomy(body)
    points = anatomy.points(anatomy.bones)
    width = width_of(points, view, 120, 0.05)
    image = picture(assemble([*anatomy.bones.values()]), points, view, width, 120, 0.05)
    assert image.shape == (120, width, 3)
    dark = (image < 250).any(axis=2)
    assert not dark[:4].any() and not dark[-4:].any() and not dark[:, 0].any() and not dark[:, -1].any()
    assert dark.any(axis=1).sum() > 0.85 * 120


def test_front_and_back_show_the_right_side_on_opposite_hands(body):
    anatomy = Anatomy(body)
    points, part = anatomy.points(anatomy.bones), assemble([anatomy.bones["fore_r"]])
    sides = [np.nonzero((picture(part, points, view, 120, 120) < 250).any(axis=2))[1].mean() for view in (FRONT, BACK)]
    assert sides[0] < 60 < sides[1]


def test_a_plate_keeps_every_pixel():
    figure = plate([("a", np.zeros((50, 30, 3), np.uint8)), ("b", np.zeros((50, 40, 3), np.uint8))], "heading")
    size = figure.get_size_inches() * 200
    assert size == pytest.approx([70 + 3 * GAP, 50 + 2 * HEAD + GAP])
    boxes = [axes.get_position().bounds for axes in figure.axes]
    assert [box[2] * size[0] for box in boxes] == pytest.approx([30, 40])


def test_a_limb_is_drawn_from_three_sides(body):
    figure = limb_plate(body, "arm", ("upper_r", "fore_r"), (), (60, 80))
    assert len(figure.axes) == 3
    assert "Right arm: 1 muscles" in [text.get_text() for text in figure.texts]


def test_the_sheet_has_every_joint_once_with_neutral_or_the_angle_next_to_it(body):
    joints = dict(swept_joints(body))
    assert list(joints) == ["shoulder_r", "elbow_r"]
    assert joints["shoulder_r"].tolist() == [-1, 0, 2] and joints["elbow_r"].tolist() == [0.5, 0.5, 1]


def test_a_sweep_shows_the_moving_bone_in_colour(body):
    images = Sweeper(body).sweep("shoulder_r", [-1, 0, 2])
    assert [image.shape for image in images] == [(PIXELS, PIXELS, 3)] * 3
    blue = [(image[..., 2].astype(int) > image[..., 0] + 40).sum() for image in images]
    assert min(blue) > 100
    assert not np.array_equal(images[0], images[2])
