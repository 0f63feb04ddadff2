"""Camera, ray tracing and scene of the film frames."""

import mujoco
import numpy as np
import pytest

from anthro.render.camera import Camera
from anthro.render.mesh import evenly, join, linear_rgb, outermost, resample, sphere, tube, tubes
from anthro.render.parts import FAR, Part
from anthro.render.raytrace import Studio, intersect, occluded, render
from anthro.render.scene import BELLY_RADII, belly_radii, bones, corners, muscle_paths, muscles, root_bone
from anthro.render.solids import box, turned

ARM = """
<mujoco>
  <asset>
    <mesh name="bone" vertex="-.02 -.02 0  .02 -.02 0  .02 .02 0  -.02 .02 0
                              -.02 -.02 .3  .02 -.02 .3  .02 .02 .3  -.02 .02 .3"/>
  </asset>
  <worldbody>
    <geom type="mesh" mesh="bone" pos="0 0 1"/>
    <site name="origin" pos=".05 0 1.2"/>
    <site name="origin2" pos="0 .05 1.2"/>
    <body name="lower" pos="0 0 1">
      <joint name="elbow" axis="0 1 0"/>
      <geom type="mesh" mesh="bone" pos="0 0 -.3" mass="1"/>
      <body name="tip" pos="0 0 -.3"><geom type="mesh" mesh="bone" pos="0 0 -.3" mass="1"/></body>
      <geom name="round" type="cylinder" size=".03 .05" euler="90 0 0" mass="0"/>
      <geom name="ball" type="sphere" size=".03" mass="0"/>
      <site name="end" pos=".05 0 -.2"/>
      <site name="end2" pos="0 .05 -.2"/>
      <site name="side" pos=".06 0 0"/>
    </body>
  </worldbody>
  <tendon>
    <spatial name="a">
      <site site="origin"/><geom geom="round" sidesite="side"/><site site="end"/>
    </spatial>
    <spatial name="b"><site site="origin2"/><geom geom="ball"/><site site="end2"/></spatial>
  </tendon>
</mujoco>
"""


@pytest.fixture
def arm():
    model = mujoco.MjModel.from_xml_string(ARM)
    data = mujoco.MjData(model)
    data.qpos[0] = 1.2
    mujoco.mj_kinematics(model, data)
    mujoco.mj_comPos(model, data)
    mujoco.mj_tendon(model, data)
    return model, data


def camera(width=64, height=48):
    return Camera(np.array([3.0, 0.0, 1.0]), np.array([0.0, 0.0, 1.0]), width, height, 30.0)


def test_camera_rays_are_unit_and_centred():
    eye = camera()
    columns, rows = np.meshgrid(np.arange(64) + 0.5, np.arange(48) + 0.5)
    rays = eye.rays(columns.ravel(), rows.ravel())
    assert np.allclose(np.linalg.norm(rays, axis=1), 1)
    assert np.allclose(rays.mean(axis=0) / np.linalg.norm(rays.mean(axis=0)), [-1, 0, 0])
    left, top = eye.rays(np.array([0.0, 32.0]), np.array([24.0, 0.0]))
    assert left[1] < 0 and left[2] == pytest.approx(0)  # facing -x, the world's -y lies at the left
    assert top[2] > 0 and top[1] == pytest.approx(0)


def test_projection_undoes_rays():
    eye = camera()
    columns, rows = np.array([3.0, 60.0]), np.array([40.0, 7.0])
    seen = eye.project(eye.position + 2.5 * eye.rays(columns, rows))
    assert np.allclose(seen, np.stack([columns, rows], axis=1))


def test_framing_keeps_all_points_inside_and_fills_the_picture():
    points = np.random.default_rng(3).normal(0, 0.4, (50, 3)) + [0.2, -0.3, 1.2]
    eye = Camera.framing(points, -60, 10, 200, 150, margin=0.05)
    seen = eye.project(points) / [200, 150]
    assert seen.min() >= 0.05 - 1e-9 and seen.max() <= 0.95 + 1e-9
    span = seen.max(axis=0) - seen.min(axis=0)
    assert span.max() == pytest.approx(0.9)


def test_depth_of_a_sphere_is_the_analytic_one():
    centre, radius = np.array([0.0, 0.0, 1.0]), 0.5
    eye = camera()
    rays = eye.rays(*(np.random.default_rng(0).uniform(0, 48, (2, 400))))
    ahead = rays @ (centre - eye.position)
    square = ahead**2 - ((centre - eye.position) @ (centre - eye.position) - radius**2)
    part = Part(sphere(np.zeros(3), radius, "#FFFFFF"), position=centre)
    hits = intersect([part], eye.position, rays)
    clear = np.abs(square) > 0.01  # a ray that grazes may pass beside the facets
    assert np.array_equal((hits.distance < FAR)[clear], (square > 0)[clear])
    inside = clear & (square > 0)
    depth = ahead[inside] - np.sqrt(square[inside])
    assert inside.sum() > 50
    assert np.abs(hits.distance[inside] - depth).max() < 0.03
    points = eye.position + hits.distance[inside, None] * rays[inside]
    outward = (points - centre) / np.linalg.norm(points - centre, axis=1, keepdims=True)
    assert (hits.normal[inside] * outward).sum(axis=1).min() > 0.999


def test_nearest_part_wins_and_a_turned_part_is_hit_where_it_is():
    red, blue = "#FF0000", "#0000FF"
    quarter = np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]])
    near = Part(sphere(np.array([0.0, -1.0, 1.0]), 0.2, red), rotation=quarter)
    far = Part(sphere(np.array([0.0, 0.0, 1.0]), 0.2, blue))
    hits = intersect([far, near], np.array([3.0, 0, 1.0]), np.array([[-1.0, 0, 0], [0, 0, 1.0]]))
    assert hits.distance[0] == pytest.approx(1.8, abs=2e-3) and hits.part.tolist() == [1, -1]
    assert np.allclose(hits.colour[0], linear_rgb(red))
    blocked = occluded([far, near], np.array([[0.5, 0, 1], [0.5, 0, 2]]), np.array([1.0, 0, 0]))
    assert blocked.tolist() == [True, False]


def test_shadow_falls_away_from_the_key_light():
    ball = Part(sphere(np.array([0.0, 0.0, 0.5]), 0.2, "#FFFFFF"))
    above = Studio(key_direction=np.array([0.0, 0.0, 1.0]), floor=0.0)
    eye = Camera(np.array([2.0, 0.0, 1.5]), np.zeros(3), 65, 65, 40.0)
    shaded = render([ball], eye, above, samples=1).astype(int)
    bare = render([], eye, above, samples=1).astype(int)
    column, row = eye.project(np.zeros((1, 3)))[0].astype(int)
    assert (bare - shaded)[row, column].min() > 20
    assert np.array_equal(bare[row, 2], shaded[row, 2])


def test_same_scene_gives_the_same_bytes():
    def picture():
        parts = [Part(sphere(np.array([0.0, 0, 1.0]), 0.3, "#D55E00")).bake()]
        return render(parts, camera(), Studio(floor=0.6, key_rays=3)).tobytes()

    assert picture() == picture()


def test_baked_sky_is_darker_inside_a_fold():
    alone = Part(sphere(np.zeros(3), 0.1, "#FFFFFF")).bake()
    assert alone.exposure.min() > 0.9
    pair = [sphere(np.zeros(3), 0.1, "#FFFFFF"), sphere(np.array([0.2, 0, 0]), 0.1, "#FFFFFF")]
    assert Part(join(pair)).bake().exposure.min() < 0.7


def test_every_ray_is_tried_against_every_part_that_it_may_meet():
    random = np.random.default_rng(5)
    balls = [Part(sphere(centre, 0.1, "#FFFFFF")) for centre in random.uniform(-1, 1, (30, 3))]
    origin = np.array([4.0, 0.3, 0.2])
    aims = random.uniform(-1, 1, (500, 3)) - origin
    rays = (aims / np.linalg.norm(aims, axis=1, keepdims=True)).astype(np.float32)
    hits = intersect(balls, origin.astype(np.float32), rays)
    alone = [intersect([ball], origin.astype(np.float32), rays).distance for ball in balls]
    assert np.array_equal(hits.distance, np.min(alone, axis=0))
    assert 50 < (hits.distance < FAR).sum() < 450
    starts = np.broadcast_to(origin, rays.shape).astype(np.float32)
    assert np.array_equal(occluded(balls, starts, rays), hits.distance < FAR)


def test_bones_that_move_together_are_one_mesh(arm):
    model, data = arm
    meshes = bones(model)
    assert set(meshes) == {0, 1}
    assert len(meshes[1].faces) == 2 * len(meshes[0].faces)
    world = meshes[1].vertices @ data.xmat[1].reshape(3, 3).T + data.xpos[1]
    reach = np.linalg.norm(world - [0, 0, 1], axis=1).max()
    assert reach == pytest.approx(np.hypot(0.6, np.hypot(0.02, 0.02)), abs=1e-6)


def test_corners_reach_as_far_as_their_bones(arm):
    model, _ = arm
    assert root_bone(model) == 1
    found = corners(model)
    assert set(found) == {0, 1, 2}
    assert np.allclose(found[0].min(axis=0), [-0.02, -0.02, 1]) and np.allclose(found[0].max(axis=0), [0.02, 0.02, 1.3])
    assert np.allclose(found[2].min(axis=0), [-0.02, -0.02, -0.3])


def test_paths_follow_their_wrapping_surfaces(arm):
    model, data = arm
    paths = muscle_paths(model, data)
    assert len(paths) == model.ntendon
    for tendon, path in enumerate(paths):
        drawn = np.linalg.norm(np.diff(path, axis=0), axis=1).sum()
        assert drawn == pytest.approx(data.ten_length[tendon], rel=5e-3)
    from_axis = np.linalg.norm((paths[0] - [0, 0, 1])[:, [0, 2]], axis=1)
    assert len(paths[0]) > 4 and np.allclose(from_axis[1:-1], 0.03, atol=1e-9)


def test_muscles_are_tubes_from_origin_to_insertion_in_their_own_colours(arm):
    paths = muscle_paths(*arm)
    colours, glow = np.array([[0.1, 0.2, 0.3], [0.4, 0.5, 0.6]]), np.array([0.0, 0.5])
    mesh = muscles(paths, np.array([0.002, 0.005]), colours, glow)
    for path, colour, shine, radius in zip(paths, colours, glow, (0.002, 0.005), strict=True):
        own = (mesh.colours == colour).all(axis=1)
        assert own.any() and (mesh.glow[own] == shine).all()
        around = mesh.vertices[np.unique(mesh.faces[own])]
        distance = np.linalg.norm(around[:, None] - evenly([path], 400), axis=2).min(axis=1)
        # Coarse rings cut the bend round the wrapping surface by less than 2 mm.
        assert 0.9 * radius < distance.max() < radius + 0.002
        for end in path[[0, -1]]:
            assert np.linalg.norm(around - end, axis=1).min() < 0.6 * radius


def test_bellies_grow_with_the_root_of_the_force_between_limits():
    # 60 N of 60e4 N/m^2 are 1 cm^2, of radius 5.64 mm; half of it is drawn.
    assert belly_radii(np.array([60.0])) == pytest.approx(0.00282, rel=1e-2)
    assert belly_radii(np.array([0.1, 1e4])).tolist() == list(BELLY_RADII)


def test_tube_keeps_its_radius_and_faces_outwards():
    turn = np.linspace(0, 2, 40)
    path = resample(np.stack([np.cos(turn), np.sin(turn), 0.2 * turn], axis=1), 0.05)
    mesh = tube(path, np.full(len(path), 0.01), np.ones(3))
    distance = np.linalg.norm(mesh.vertices[:, None] - path[None], axis=2).min(axis=1)
    assert np.allclose(distance, 0.01, atol=1e-6)
    corners = mesh.vertices[mesh.faces]
    flat = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    assert ((flat * mesh.normals[mesh.faces[:, 0]]).sum(axis=1) > 0).all()


def test_many_tubes_are_the_single_ones_in_order():
    random = np.random.default_rng(1)
    paths = np.cumsum(random.uniform(0.01, 0.02, (3, 9, 3)), axis=1)
    radii, colours = random.uniform(0.001, 0.002, (3, 9)), random.uniform(size=(3, 3))
    together = tubes(paths, radii, colours, 5)
    single = join([tube(paths[i], radii[i], colours[i], 5) for i in range(3)])
    assert np.allclose(together.vertices, single.vertices) and np.array_equal(together.faces, single.faces)
    assert np.array_equal(together.colours, single.colours)


def test_points_lie_evenly_along_each_path():
    bent, straight = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0]]), np.array([[0.0, 0, 5], [0, 0, 6]])
    points = evenly([bent, straight], 9)
    assert np.allclose(points[1], np.stack([np.zeros(9), np.zeros(9), np.linspace(5, 6, 9)], axis=1))
    assert np.allclose(points[0, [0, 1, -1]], [[0, 0, 0], [0.25, 0, 0], [1, 1, 0]])


def volume(mesh):
    corners_ = mesh.vertices[mesh.faces]
    return np.einsum("ij,ij->i", corners_[:, 0], np.cross(corners_[:, 1], corners_[:, 2])).sum() / 6


def test_a_box_has_its_size_and_is_closed():
    mesh = box((1.0, 2.0, 3.0), (0.4, 0.2, 0.1), 0.01, "#808080")
    assert np.allclose(mesh.vertices.min(axis=0), [0.8, 1.9, 2.95], atol=2e-4)
    assert np.allclose(mesh.vertices.max(axis=0), [1.2, 2.1, 3.05], atol=2e-4)
    assert volume(mesh) == pytest.approx(0.4 * 0.2 * 0.1, rel=0.02)
    turned_ = box((0, 0, 0), (0.4, 0.2, 0.1), 0.01, "#808080", np.pi / 2)
    assert np.allclose(np.ptp(turned_.vertices, axis=0), [0.2, 0.4, 0.1], atol=2e-3)


def test_a_turned_solid_is_closed_and_faces_outwards():
    cone = turned([(0.0, 0.0), (0.3, 0.0), (0.0, 0.6)], "#808080", (1.0, 0.0))
    assert volume(cone) == pytest.approx(np.pi * 0.3**2 * 0.6 / 3, rel=0.01)
    assert np.allclose(np.linalg.norm(cone.normals, axis=1), 1)


def test_outermost_points_bound_all():
    points = np.random.default_rng(2).normal(size=(200, 3))
    few = outermost(points)
    assert len(few) <= 26
    assert np.allclose([few.min(axis=0), few.max(axis=0)], [points.min(axis=0), points.max(axis=0)])
