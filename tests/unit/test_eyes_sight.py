"""What eyes see: against the film's camera, analytic spheres, shadows and mirrors; limbs, scenes, bad input."""

from dataclasses import replace
from types import SimpleNamespace

import mujoco
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from anthro.errors import UserError
from anthro.eyes.eye import Eye
from anthro.eyes.flesh import DENSITY, ball_directions, flesh, grown, limb_bones
from anthro.eyes.layout import Layout, layout
from anthro.eyes.scene import BACKGROUND, SKIN, Scene, sole_height
from anthro.eyes.sight import Eyes, as_bytes, as_floats, nerve, rays
from anthro.render.camera import Camera
from anthro.render.mesh import join, linear_rgb, make_mesh, move, sphere
from anthro.render.parts import Ball, Part, Rays
from anthro.render.raytrace import Studio, intersect, occluded, render, shade
from anthro.render.solids import box

# A trunk with a head, and two arms of two boxes each that reach forward.
LIMB = """<body name="humerus_{s}" pos="0 {y} -.3"><joint name="shoulder_{s}" axis="0 1 0"/>
  <geom name="humerus_{s}" type="mesh" mesh="box" mass="1"/>
  <body name="hand_{s}" pos="0 0 -.3"><joint name="elbow_{s}" axis="0 1 0"/>
    <geom name="hand_{s}" type="mesh" mesh="box" mass=".9"/></body></body>"""
MODEL = f"""
<mujoco>
  <asset><mesh name="box" vertex="-.02 -.02 0  .02 -.02 0  .02 .02 0  -.02 .02 0
                             -.02 -.02 -.3  .02 -.02 -.3  .02 .02 -.3  -.02 .02 -.3"/></asset>
  <worldbody>
    <body name="trunk" pos="0 0 1.3"><geom name="trunk" type="mesh" mesh="box" mass="10"/>
      <site name="head" pos="0 0 .05"/>
      {LIMB.format(s="r", y=-0.2)}{LIMB.format(s="l", y=0.2)}
    </body>
  </worldbody>
</mujoco>"""
WHITE, RED = "#FFFFFF", "#FF0000"
SQUARE = 40


@pytest.fixture(scope="module")
def body():
    model = mujoco.MjModel.from_xml_string(MODEL)
    head = model.site("head").id
    return SimpleNamespace(model=model, q_rest=np.array([-0.6, -0.9, -0.6, -0.9]), effector=lambda name: head)


@pytest.fixture
def posed(body):
    data = mujoco.MjData(body.model)
    data.qpos[:] = body.q_rest
    mujoco.mj_kinematics(body.model, data)
    return data


def srgb(linear):
    value = np.clip(linear, 0, 1)
    return np.where(value <= 0.0031308, 12.92 * value, 1.055 * value ** (1 / 2.4) - 0.055)


def grid(camera):
    """Receptors on an image plane: those whose rays are a camera's, in its own frame."""
    rows, columns = np.divmod(np.arange(camera.height * camera.width), camera.width)
    right, up, forward = (camera.rays(columns + 0.5, rows + 0.5) @ camera.axes.T).T
    return Layout("grid", np.stack([forward, -right, up], axis=1))


# -- the picture ----------------------------------------------------------------------------------------


@pytest.mark.parametrize("angles", [(0.0, 0.0), (0.3, -0.5), (-0.4, 0.2)])
def test_receptors_on_an_image_plane_see_the_films_picture(body, posed, angles):
    """Same scene, same light, one ray a pixel, no smoothing."""
    ball = Ball(0.15, RED, (0.7, 0.1, 1.2))
    eyes = Eyes(body, Scene(body.model, [ball], floor=0.0))
    eyes.reset(np.array([angles, angles]))
    rotation, position = eyes.head(posed)
    at, forward = (
        position + rotation @ eyes.eyes[0].pupil(np.array(angles)),
        rotation @ eyes.eyes[0].rotation(np.array(angles))[:, 0],
    )
    camera = Camera(at, at + forward, 96, 72, 80.0)
    eyes.layouts = (grid(camera), grid(camera))
    seen = eyes.see(posed)[0].reshape(72, 96, 3)
    film = render(eyes.scene.parts, camera, eyes.scene.studio, samples=1).astype(int)
    apart = np.abs(np.rint(255 * srgb(seen)) - film)
    assert len(np.unique(film.reshape(-1, 3), axis=0)) > 50
    # A ray that grazes an edge may fall to its other side by rounding.
    assert (apart.max(axis=2) > 1).mean() < 2e-3 and np.median(apart) == 0


def test_placed_parts_and_one_scene_of_all_surfaces_look_alike(body, posed):
    eyes = Eyes(body, Scene(body.model, [Ball(0.08, RED, (0.6, 0.1, 1.2))], floor=0.0))
    placed = eyes.see(posed)
    meshes = [move(p.mesh, p.rotation, p.position) for p in eyes.scene.parts[:-1]]
    meshes.append(sphere(np.array([0.6, 0.1, 1.2]), 0.08, RED))
    colours = shade([Part(join(meshes))], eyes.scene.studio, *eyes.rays(posed))
    apart = np.abs(nerve(colours.reshape(2, -1, 3)) - placed).reshape(2, -1, 3).max(axis=2)
    assert (apart > 0.1).mean() < 0.005  # facets of the ball's rim and highlight


def test_a_ball_fills_the_receptors_within_its_angular_radius(body, posed):
    eyes = Eyes(body, Scene(body.model, [Ball(0.06, WHITE)]))
    where = eyes.head(posed)[1] + [2.0, 0.3, 0.4]
    eyes.scene.balls[0].place(where)
    eyes.reset(eyes.aim(posed, where))
    seen = eyes.see(posed).reshape(2, -1, 3)
    differs = np.abs(seen - linear_rgb(BACKGROUND)).max(axis=2) > 1e-3
    for k, eye in enumerate(eyes.eyes):
        pupil = eyes.head(posed)[1] + eyes.head(posed)[0] @ eye.pupil(eyes.angles[k])
        radius = np.arcsin(0.06 / np.linalg.norm(where - pupil))
        away = eyes.layouts[k].eccentricity
        inside, beside = away < radius - 1e-5, (away > radius + 1e-5) & (away < np.deg2rad(20))  # before the arms
        assert inside.sum() > 200 and beside.sum() > 200
        assert differs[k][inside].all() and not differs[k][beside].any()


def test_a_mirrored_world_is_seen_mirrored(body, posed):
    """Arms alike, light in the middle, receptors of one eye mirrored for the other."""
    scene = Scene(body.model, [Ball(0.07, RED, (0.7, 0.0, 1.1))])
    scene.studio = Studio(np.array([0.3, 0.0, 1.0]), backdrop_top=np.zeros(3), backdrop_horizon=np.zeros(3))
    eyes = Eyes(body, scene)
    eyes.layouts = (eyes.layouts[0], Layout("mirrored", eyes.layouts[0].directions * [1, -1, 1]))
    eyes.reset(np.array([[0.1, -0.2], [-0.1, -0.2]]))
    left, right = eyes.see(posed)
    assert (np.abs(left - right) > 0.02).mean() < 2e-3 and left.max() > 0.5


# -- shadows, mirrors -------------------------------------------------------------------------------------

EVEN = {"backdrop_top": np.zeros(3), "backdrop_horizon": np.zeros(3)}
ABOVE = Studio(np.array([0.0, 0.0, 1.0]), **EVEN)
DOWN = np.array([0.0, 0.0, -1.0])


def table(height, colour=WHITE):
    corners = np.array([[-1.0, -1, height], [1, -1, height], [1, 1, height], [-1, 1, height]])
    return Part(make_mesh(corners, np.array([[0, 1, 2], [0, 2, 3]]), linear_rgb(colour), 0.12))


@given(st.floats(0.05, 0.4), st.floats(-0.5, 0.5))
def test_a_balls_shadow_is_as_wide_as_the_ball(radius, aside):
    """Light from straight above: points of the table nearer to the axis than the radius are dark."""
    ball = Ball(radius, WHITE, (aside, 0.0, 1.0))
    x = np.linspace(-0.95, 0.95, 77)
    points = np.stack([x, np.zeros(77), np.full(77, 0.001)], axis=1)
    blocked = occluded([table(0.0), ball], points, np.array([0.0, 0.0, 1.0]))
    clear = np.abs(np.abs(x - aside) - radius) > 1e-4
    assert np.array_equal(blocked[clear], (np.abs(x - aside) < radius)[clear])


def test_in_the_shadow_only_the_sky_is_left():
    ball, origins = Ball(0.2, WHITE, (0, 0, 1.0)), np.array([[0.0, 0.6, 0.5], [0.9, 0.6, 0.5]])
    aims = np.array([[0.0, 0.0, 0.0], [0.9, 0.0, 0.0]]) - origins
    aims /= np.linalg.norm(aims, axis=1, keepdims=True)
    dark, lit = shade([table(0.0, "#808080"), ball], ABOVE, origins, aims)
    albedo = linear_rgb("#808080")
    assert dark == pytest.approx(albedo * 0.5, rel=1e-3)  # sky 0.5, seen whole from a level place
    halfway = np.array([0.0, 0.0, 1.0]) - aims[1]
    shine = 0.12 * (halfway[2] / np.linalg.norm(halfway)) ** 40  # gloss of the table
    assert lit == pytest.approx(albedo * (0.5 + 0.72) + shine, rel=1e-3)


def mirror(height, share=1.0):
    return Part(replace(box((0, 0, height - 0.05), (2, 2, 0.1), 0.01, WHITE), mirror=share, gloss=0.0))


def test_a_mirror_shows_what_lies_behind_the_mirrored_ray():
    ball = Ball(0.2, RED, (0.5, 0.0, 0.5), gloss=0.0)
    start = np.array([-0.5, 0.0, 0.5])
    way = np.array([0.5, 0.0, -0.5]) / np.sqrt(0.5)
    seen = shade([mirror(0.0), ball], ABOVE, start, way[None])[0]
    # Straight to the same ball from the mirror's point, along the mirrored ray.
    direct = shade([ball], ABOVE, np.array([0.0, 0.0, 2e-4]), (way * [1, 1, -1])[None])[0]
    assert seen == pytest.approx(direct, abs=2e-3) and seen[0] > 3 * seen[1]
    half = shade([mirror(0.0, 0.5), ball], ABOVE, start, way[None])[0]
    own = shade([mirror(0.0, 0.0), ball], ABOVE, start, way[None])[0]
    assert half == pytest.approx((own + direct) / 2, abs=2e-3)


def test_mirrors_that_face_each_other_are_followed_to_a_depth():
    low = mirror(0.0, 0.5)
    high = Part(replace(box((0, 0, 1.05), (2, 2, 0.1), 0.01, WHITE), mirror=0.5, gloss=0.0))
    way = DOWN[None]
    start = np.array([0.0, 0.0, 0.5])
    # The lower one lies in the upper one's shadow: 0.5 of sky above; the upper one's underside sees 0.4 of it.
    below, above = 0.5, 0.5 * (0.7 - 0.3)
    assert shade([low, high], ABOVE, start, way, 0)[0] == pytest.approx(np.full(3, below), rel=1e-3)
    once = 0.5 * below + 0.5 * above
    assert shade([low, high], ABOVE, start, way, 1)[0] == pytest.approx(np.full(3, once), rel=1e-3)
    twice = 0.5 * below + 0.5 * (0.5 * above + 0.5 * below)
    assert shade([low, high], ABOVE, start, way, 2)[0] == pytest.approx(np.full(3, twice), rel=1e-3)


@given(st.integers(0, 10_000))
def test_balls_are_hit_where_quadratic_equations_say(seed):
    rng = np.random.default_rng(seed)
    centre, radius = rng.uniform(-1, 1, 3), rng.uniform(0.02, 0.5)
    origins, ways = rng.uniform(-2, 2, (50, 3)), rng.normal(size=(50, 3))
    ways /= np.linalg.norm(ways, axis=1, keepdims=True)
    hits = intersect([Ball(radius, WHITE, centre)], origins, ways)
    b = ((origins - centre) * ways).sum(axis=1)
    root = b**2 - ((origins - centre) ** 2).sum(axis=1) + radius**2
    near, far = -b - np.sqrt(np.maximum(root, 0)), -b + np.sqrt(np.maximum(root, 0))
    expected = np.where((root > 0) & (far > 0), np.where(near > 0, near, far), np.inf)
    sure = (np.abs(root) > 1e-5) & (np.abs(near) > 1e-4) & (np.abs(far) > 1e-4)
    assert np.array_equal((hits.part >= 0)[sure], np.isfinite(expected)[sure])
    met = sure & np.isfinite(expected)
    assert np.allclose(hits.distance[met], expected[met], atol=2e-4)
    assert (hits.normal[met] * ways[met]).sum(axis=1).max(initial=-1) <= 1e-6
    assert np.array_equal(occluded([Ball(radius, WHITE, centre)], origins, ways)[sure], (hits.part >= 0)[sure])


def test_rays_that_look_no_more_are_left_alone():
    rays_ = Rays(np.array([0.0, 0, 3]), np.repeat(DOWN[None], 2, axis=0), np.array([0.0, 1e30], np.float32))
    for part in (table(0.0), Ball(0.5, WHITE)):
        part.block(rays_)
    assert rays_.reach.tolist() == [0, 0]


# -- nerves -----------------------------------------------------------------------------------------------


def test_a_nerve_tells_red_green_blue_of_each_receptor_in_turn():
    colours = np.array([[[0.1, 0.2, 0.3], [0.4, 1.5, -0.6]]])
    assert nerve(colours) == pytest.approx(np.array([[0.1, 0.2, 0.3, 0.4, 1.0, 0.0]]))
    assert nerve(colours).dtype == np.float32
    # 0.2126 * 0.1 + 0.7152 * 0.2 + 0.0722 * 0.3 = 0.186; 0.2126 * 0.4 + 0.7152 = 0.8
    assert nerve(colours, binary=True).tolist() == [[0.0, 1.0]]


@given(st.lists(st.floats(0, 1, width=32), min_size=1, max_size=20))
def test_stored_nerves_come_back_within_half_a_step(values):
    vector = np.array(values, np.float32)
    assert np.abs(as_floats(as_bytes(vector)) - vector).max() <= 0.5 / 255 + 1e-6
    assert np.array_equal(as_bytes(as_floats(as_bytes(vector))), as_bytes(vector))


def test_both_eyes_have_10800_numbers_and_the_sketching_ones_9936(body, posed):
    scene = Scene(body.model)
    seen = Eyes(body, scene).see(posed)
    assert seen.shape == (2, 10800) and seen.dtype == np.float32 and 0 <= seen.min() <= seen.max() <= 1
    binary = Eyes(body, scene, "sketching").see(posed)
    assert binary.shape == (2, 9936) and set(np.unique(binary)) <= {0.0, 1.0}


def test_rays_start_at_the_pinhole_and_follow_the_head():
    eye, receptors = Eye("left"), layout("log_polar", "left", 0)
    quarter = np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]])  # the head turned to the left
    origins, ways = rays(eye, receptors, np.zeros(2), quarter, np.array([1.0, 2.0, 3.0]))
    x, y, z = eye.centre + [0.012, 0, 0]
    assert np.allclose(origins, [1 - y, 2 + x, 3 + z], atol=1e-6)
    assert np.allclose(ways, receptors.directions @ quarter.T, atol=1e-7)
    assert np.allclose(ways.mean(axis=0) / np.linalg.norm(ways.mean(axis=0)), [0, 1, 0], atol=1e-2)


def test_receptors_near_a_ball_are_those_that_see_it():
    receptors, point, radius = layout("log_polar", "left", 0), np.array([0.6, 0.1, -0.2]), 0.05
    near = receptors.near(point, radius)
    hits = intersect([Ball(radius, WHITE, point)], np.zeros(3), receptors.directions)
    assert near.count == (hits.part == 0).sum() > 20
    assert np.array_equal(near.directions, receptors.directions[hits.part == 0])
    assert receptors.near(-point, radius).count == 0


def test_turning_obeys_the_mover_and_resting_the_limits(body, posed):
    eyes = Eyes(body, Scene(body.model), movement="main_sequence")
    command = np.deg2rad([[10.0, 0.0], [-10.0, 5.0]])
    for _ in range(40):
        angles = eyes.turn(command, 0.005)
    assert np.allclose(angles, command)
    eyes.reset(np.full((2, 2), 9.0))
    assert np.allclose(eyes.angles, [eye.within(np.full(2, 9.0)) for eye in eyes.eyes])
    with pytest.raises(UserError, match="two finite angles each"):
        eyes.reset(np.zeros(3))


# -- limbs and scenes -------------------------------------------------------------------------------------


def test_flesh_holds_its_bones_mass_and_covers_them(body):
    model = body.model
    colours = dict.fromkeys(SKIN, linear_rgb(WHITE))
    meshes = flesh(model, tuple(SKIN), colours)
    assert {model.body(bone).name for bone in meshes} == {"humerus_r", "hand_r", "humerus_l", "hand_l"}
    for bone, mesh in meshes.items():
        corners = mesh.vertices[mesh.faces]
        volume = np.einsum("ij,ij->i", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])).sum() / 6
        assert volume == pytest.approx(model.body_mass[bone] / DENSITY, rel=0.02)
        assert (mesh.vertices.min(axis=0) < [-0.022, -0.022, -0.301]).all()
        assert (mesh.vertices.max(axis=0) > [0.022, 0.022, 0.001]).all()


@given(st.floats(7e-4, 3e-3), st.integers(0, 100))
def test_a_bone_grows_to_its_volume(volume, seed):
    points = np.random.default_rng(seed).uniform(-1, 1, (30, 3)) * [0.02, 0.02, 0.15]
    mesh = grown(points, volume, np.array([0, 0, 0.15]), np.array([0, 0, -0.15]), np.ones(3))
    corners = mesh.vertices[mesh.faces]
    found = np.einsum("ij,ij->i", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])).sum() / 6
    assert found == pytest.approx(volume, rel=0.05)


def test_a_bone_that_fills_its_volume_has_a_skin():
    cube = np.stack(np.meshgrid(*[[-0.02, 0.02]] * 3), axis=-1).reshape(-1, 3)
    mesh = grown(cube, 1e-6, np.array([0, 0, 0.02]), np.array([0, 0, -0.02]), np.ones(3))
    assert np.abs(mesh.vertices).max(axis=0) == pytest.approx(np.full(3, 0.022))


def test_directions_of_a_ball_are_unit_and_balanced():
    directions = ball_directions(3)
    assert len(directions) == 38 and np.allclose(np.linalg.norm(directions, axis=1), 1)
    assert np.allclose(directions.sum(axis=0), 0)


def test_limbs_hang_on_their_roots(body):
    names = {body.model.body(bone).name for bone in limb_bones(body.model, ("humerus_r", "nothing"))}
    assert names == {"humerus_r", "hand_r"}


def test_limbs_are_placed_where_the_body_has_them(body, posed):
    scene = Scene(body.model).place(posed)
    assert scene.limb_names == ["humerus_r", "hand_r", "humerus_l", "hand_l"]
    for name, part in zip(scene.limb_names, scene.parts, strict=True):
        middle = posed.xpos[body.model.body(name).id] + posed.xmat[body.model.body(name).id].reshape(3, 3) @ [
            0,
            0,
            -0.15,
        ]
        assert np.linalg.norm(part.ball[:3] - middle) < 0.02


def test_nothing_is_built_anew_in_a_frame(body, posed, monkeypatch):
    eyes = Eyes(body, Scene(body.model, [Ball(0.05, RED, (0.5, 0, 1.2))], [table(0.4)], floor=0.0))
    first = eyes.see(posed)
    monkeypatch.setattr("anthro.render.parts.EmbreeScene", None)
    monkeypatch.setattr("anthro.render.parts.TriangleMesh", None)
    assert np.array_equal(eyes.see(posed), first)


def test_the_floor_is_seen_only_by_its_shadows(body, posed):
    eyes = Eyes(body, Scene(body.model, floor=sole_height(body) - 0.05))
    eyes.reset(np.deg2rad([[0.0, -40.0], [0.0, -40.0]]))
    seen = eyes.see(posed).reshape(-1, 3)
    plain = np.abs(seen - linear_rgb(BACKGROUND)).max(axis=1) < 1e-5
    assert plain.mean() > 0.8
    dark = (seen < linear_rgb(BACKGROUND) * 0.5).all(axis=1)
    assert dark.sum() > 5


def test_scenes_refuse_what_cannot_be():
    bare = mujoco.MjModel.from_xml_string(
        "<mujoco><worldbody><body name='stone'><geom size='.1'/></body></worldbody></mujoco>"
    )
    with pytest.raises(UserError, match="none of the bones humerus_r"):
        Scene(bare)
    with pytest.raises(UserError, match="needs a floor"):
        Scene(mujoco.MjModel.from_xml_string(MODEL), stool=True)
