"""Balls: their flight, their bounces off surfaces, and the blows that they and the body exchange."""

from itertools import pairwise

import mujoco
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from test_simulator_world import add_bone, as_body

from anthro.body.impact import jolt, point_jacobian, response
from anthro.errors import UserError
from anthro.world.balls import GRAVITY, REST_SPEED, Ball, Balls
from anthro.world.capsules import Capsule, Capsules, read_capsules
from anthro.world.surfaces import FLOOR, Slope, tilted

G, STEP = 9.81, 0.005
unit = st.floats(0.0, 1.0)


def capsule(bone, a, b, radius, name="rod"):
    return Capsule(name, "M", "limb", bone, *a, *b, radius, "estimated", "a test")


def rod(root_free=False, links=1, mass=2.0):
    """Links of 0.4 m that hang from a hip at 1 m, each over a hinge across; a free root for one in empty space."""
    spec = mujoco.MjSpec()
    spec.compiler.degree = False
    hip = add_bone(spec.worldbody, "hip", (0.0, 0.0, 1.0), mass)
    hip.ipos = (0.0, 0.0, 0.0)
    if root_free:
        hip.add_freejoint(name="root")
    parent, place = hip, (0.0, 0.0, 0.0)
    for k in range(links):
        parent = add_bone(parent, f"link{k}", place, mass, inertia=0.02)
        parent.ipos = (0.0, 0.0, -0.2)
        parent.add_joint(name=f"swing{k}", type=mujoco.mjtJoint.mjJNT_HINGE, axis=(0.0, 1.0, 0.2 * k))
        place = (0.0, 0.0, -0.4)
    free = {"joint_stiffness": np.zeros(links), "joint_damping": np.zeros(links)}
    return as_body(spec, q_range=np.tile([-7.0, 7.0], (links, 1)), **free).movable()


def links_covered(links):
    return [capsule(f"link{k}", (0.0, 0.0, 0.0), (0.0, 0.0, -0.4), 0.03, f"rod{k}") for k in range(links)]


def until_hit(balls, simulator, steps=400):
    """Step until the first hit; the hit, and the balls' velocities before that step."""
    for _ in range(steps):
        before = balls.velocity.copy()
        simulator.step(np.zeros(0))
        hits = balls.follow()
        if hits:
            return hits[0], before
    raise AssertionError("nothing was hit")


def kinetic(simulator):
    return 0.5 * simulator.qvel @ simulator.mass @ simulator.qvel


def mechanical(balls, ball=0):
    what, v = balls.balls[ball], balls.velocity[ball]
    return what.mass * (0.5 * v @ v + G * balls.position[ball, 2])


def test_flight_is_a_parabola():
    balls = Balls([Ball()])
    balls.throw(0, (1.0, 2.0, 3.0), (-2.0, 0.5, 4.0))
    for _ in range(200):
        balls.advance(STEP)
    np.testing.assert_allclose(balls.position[0], (-1.0, 2.5, 3.0 + 4.0 - 0.5 * G), atol=1e-12)
    np.testing.assert_allclose(balls.velocity[0], (-2.0, 0.5, 4.0 - G), atol=1e-12)


def test_a_dropped_ball_bounces_when_and_as_high_as_worked_by_hand():
    """From 1 m: 0.4515 s and 4.429 m/s to the floor; with half of that back up, 0.4515 s aloft and to 0.25 m."""
    balls = Balls([Ball(radius=0.05)], surfaces=[Slope("floor", (0, 0, 0), half_size=(9, 9), restitution=0.5)])
    balls.throw(0, (0.0, 0.0, 1.05))
    heights = []
    for _ in range(185):
        balls.advance(STEP)
        heights.append(balls.position[0, 2] - 0.05)
    first, second = balls.hits[:2]
    assert (first.what, first.limb, first.ball) == ("floor", "", 0)
    assert first.time == pytest.approx(np.sqrt(2.0 / G), abs=1e-5)
    assert first.speed == pytest.approx(np.sqrt(2.0 * G), rel=1e-5)
    np.testing.assert_allclose(first.impulse, (0.0, 0.0, 0.15 * 1.5 * np.sqrt(2.0 * G)), rtol=1e-4)
    assert second.time - first.time == pytest.approx(np.sqrt(2.0 / G), abs=1e-4)
    assert max(heights[95:]) == pytest.approx(0.25, abs=1e-3)


def test_a_slope_turns_a_falling_ball_aside():
    """At 30 degrees without friction and loss, a fall is reflected by 60 degrees from the way it came."""
    slope = tilted("slope", (0.0, 0.0, 0.0), (-1.0, 0.0), np.pi / 6, restitution=1.0, friction=0.0)
    balls = Balls([Ball()], surfaces=[slope])
    balls.throw(0, (0.0, 0.0, 0.5), (0.0, 0.0, -4.0))
    while not balls.hits:
        balls.advance(1e-4)
    x, y, z = balls.velocity[0] / np.linalg.norm(balls.velocity[0])
    np.testing.assert_allclose((x, y, z), (-np.sin(np.pi / 3), 0.0, np.cos(np.pi / 3)), atol=1e-3)


@pytest.mark.parametrize("friction, slip", [(0.1, 3.0 - 0.1 * 1.5 * 2.0), (2.0, 0.0)])
def test_friction_takes_its_share_of_the_slip_and_at_most_all(friction, slip):
    slope = Slope("floor", (0, 0, 0), half_size=(9, 9), restitution=0.5, friction=friction)
    balls = Balls([Ball(radius=0.05)], surfaces=[slope])
    balls.throw(0, (0.0, 0.0, 0.05), (0.0, 3.0, -2.0))
    balls.advance(1e-6)
    np.testing.assert_allclose(balls.velocity[0], (0.0, slip, 1.0), atol=1e-4)


def test_a_ball_at_rest_stays_on_the_floor():
    balls = Balls([Ball(restitution=0.6)], surfaces=[FLOOR])
    balls.throw(0, (0.0, 0.0, 0.1))
    for _ in range(1600):
        balls.advance(STEP)
    assert balls.position[0, 2] == pytest.approx(0.05, abs=2e-4)
    assert balls.hits[-1].time < 6.0  # trembling is no hit


@given(unit, unit, st.lists(st.floats(-5.0, 5.0), min_size=3, max_size=3), st.floats(0.0, 0.7))
def test_energy_never_grows_on_slopes(restitution, friction, velocity, angle):
    slopes = [
        tilted("slope", (0.0, 0.0, 0.3), (-1.0, 0.5), angle, restitution=restitution, friction=friction),
        Slope("floor", (0, 0, 0), half_size=(50, 50), restitution=restitution, friction=friction),
    ]
    balls = Balls([Ball()], surfaces=slopes)
    balls.throw(0, (0.1, -0.1, 0.9), velocity)
    energies = [mechanical(balls)]
    for _ in range(200):
        balls.advance(STEP)
        energies.append(mechanical(balls))
    assert max(b - a for a, b in pairwise(energies)) < 1e-9
    assert balls.position[0, 2] > 0.049


@given(st.floats(5.0, 15.0), st.floats(-0.2, 0.2), st.floats(-0.2, 0.2), st.floats(0.01, 0.1), st.floats(-1.2, 1.2))
def test_no_ball_goes_through_a_thin_plane(speed, aside, above, radius, angle):
    normal = (np.cos(angle), 0.0, np.sin(angle))
    plane = Slope("plane", (0.0, 0.0, 0.0), normal, (0.0, 1.0, 0.0), half_size=(0.5, 0.5))
    balls = Balls([Ball(radius=radius)], surfaces=[plane])
    aim, away = np.array([0.0, aside, 0.0]) + above * np.cross(normal, (0.0, 1.0, 0.0)), 0.5 * np.array(normal)
    balls.throw(0, aim + away - 0.5 * (0.5 / speed) ** 2 * np.array(GRAVITY), -away / (0.5 / speed))
    for _ in range(round(0.6 / speed / STEP) + 1):
        balls.advance(STEP)
        assert (balls.position[0] @ np.array(normal)) > radius - 2e-4
        if balls.hits:
            return
    raise AssertionError("the plane was not met")


@given(st.floats(6.0, 15.0), st.floats(-1.0, 1.0), st.floats(0.05, 0.35), st.integers(0, 2))
def test_no_ball_goes_through_a_limb(speed, direction, height, which):
    """Aimed at the middle of a rod of 6 cm, at up to 15 m/s: 7.5 cm a step."""
    simulator = rod(links=3).simulator()
    simulator.reset(np.array([0.3, -0.5, 0.4]))
    balls = Balls([Ball(radius=0.02)], simulator, capsules=links_covered(3))
    balls.capsules.refresh(simulator)
    a, b = balls.capsules.ends[which]
    aim, flight = a + height / 0.4 * (b - a), 0.4 / speed
    way = np.array([np.cos(direction), np.sin(direction), 0.0])
    balls.throw(0, aim - 0.4 * way, speed * way - 0.5 * flight * np.array(GRAVITY))
    for _ in range(int(1.3 * flight / STEP) + 2):
        simulator.step(np.zeros(0))
        if balls.follow():
            return
    raise AssertionError("the limb was not met")


def test_head_on_against_a_free_mass_is_as_in_the_textbook():
    """0.5 kg at u meet 4 kg at rest with e = 0.6: 1.6 u 0.5 4 / 4.5 N s; momentum along the way is kept."""
    simulator = rod(root_free=True, links=1).simulator()
    ball = Ball(mass=0.5, restitution=0.6)
    # through the centre of mass of hip and link, so that nothing turns; the hinge bears no blow along its axis
    balls = Balls([ball], simulator, capsules=[capsule("hip", (0, 0, -0.1), (0, 0, -0.1), 0.05)])
    balls.throw(0, (0.0, 0.3, 0.9), (0.0, -5.0, 0.0))
    hit, _ = until_hit(balls, simulator)
    total = float(simulator.model.body_mass.sum())
    assert hit.speed == pytest.approx(5.0, rel=1e-3)
    assert np.linalg.norm(hit.impulse) == pytest.approx(1.6 * hit.speed * 0.5 * total / (0.5 + total), rel=1e-3)
    momentum = np.zeros((3, simulator.model.nv))
    mujoco.mj_jacSubtreeCom(simulator.model, simulator.data, momentum, 1)
    whole = total * momentum @ simulator.qvel + 0.5 * balls.velocity[0]
    np.testing.assert_allclose(whole[:2], (0.0, -2.5), atol=1e-9)


def test_head_on_against_a_welded_bone_the_ball_alone_turns_back():
    simulator = rod().simulator()
    balls = Balls([Ball(restitution=0.7)], simulator, capsules=[capsule("hip", (0, -0.1, 0), (0, 0.1, 0), 0.05)])
    balls.throw(0, (-0.3, 0.0, 1.0), (6.0, 0.0, 0.0))
    hit, before = until_hit(balls, simulator)
    np.testing.assert_allclose(before[0, 0], 6.0)
    assert balls.velocity[0] @ hit.impulse == pytest.approx(0.7 * hit.speed * np.linalg.norm(hit.impulse), rel=0.03)
    assert not simulator.qvel.any()
    np.testing.assert_allclose(hit.point, (-0.05, 0.0, 1.0), atol=4e-3)


def test_a_hinged_rod_bears_a_blow_as_its_inertia_over_the_lever_squared():
    """At 0.3 m under the hinge: I = 0.02 + 2 * 0.2^2 + 1e-4 of armature none; m_eff = I / 0.09."""
    simulator = rod().simulator()
    balls = Balls([Ball(mass=0.2, restitution=0.5, radius=0.02)], simulator, capsules=links_covered(1))
    balls.throw(0, (-0.2, 0.0, 0.7 + 0.5 * G * (0.15 / 8.0) ** 2), (8.0, 0.0, 0.0))
    hit, _ = until_hit(balls, simulator)
    inertia = 0.02 + 2.0 * 0.2**2
    lever = 1.0 - hit.point[2]
    effective = inertia / lever**2
    wanted = 1.5 * hit.speed * 0.2 * effective / (0.2 + effective)
    assert lever == pytest.approx(0.3, abs=2e-3)
    assert np.linalg.norm(hit.impulse) == pytest.approx(wanted, rel=1e-3)
    assert simulator.qvel[0] == pytest.approx(-wanted * lever / inertia, rel=0.01)
    assert (hit.what, hit.limb, hit.bone) == ("rod0", "limb", "link0")


@given(
    unit,
    st.floats(0.05, 2.0),
    st.floats(0.5, 15.0),
    st.floats(-1.2, 1.2),
    st.lists(st.floats(-3, 3), min_size=3, max_size=3),
)
def test_a_blow_keeps_restitution_and_takes_the_energy_that_it_must(restitution, mass, speed, direction, rates):
    """On a chain in motion: e u after u, (1 - e^2) u^2 / 2 times the effective mass lost."""
    simulator = rod(links=3).simulator()
    simulator.reset(np.array([0.3, -0.5, 0.4]), np.array(rates))
    ball = Ball(radius=0.04, mass=mass, restitution=restitution)
    balls = Balls([ball], simulator, capsules=links_covered(3))
    balls.capsules.refresh(simulator)
    a, b = balls.capsules.ends[1]
    way = np.array([np.cos(direction), np.sin(direction), 0.0])
    # at the surface, a hair apart, towards the link's middle
    along = (b - a) / np.linalg.norm(b - a)
    out = -(way - (way @ along) * along)
    out /= np.linalg.norm(out)
    balls.throw(0, 0.5 * (a + b) + (0.07 + 5e-6) * out, 0.5 * (balls.capsules.speeds[1].sum(axis=0)) - speed * out)
    before = kinetic(simulator) + 0.5 * mass * balls.velocity[0] @ balls.velocity[0]
    mass_matrix, point = simulator.mass, 0.5 * (a + b)
    slopes = out @ point_jacobian(simulator, "link1", point)
    effective = 1.0 / (1.0 / mass + slopes @ np.linalg.solve(mass_matrix, slopes))
    balls.advance(1e-9)
    assert len(balls.hits) == 1
    after = 0.5 * simulator.qvel @ mass_matrix @ simulator.qvel + 0.5 * mass * balls.velocity[0] @ balls.velocity[0]
    back = max(restitution * speed, REST_SPEED)
    lost = 0.5 * (speed**2 - back**2) * effective
    assert before - after == pytest.approx(lost, rel=1e-4, abs=1e-5 * before)
    apart = balls.velocity[0] @ out - slopes @ simulator.qvel
    assert apart == pytest.approx(back, rel=1e-4, abs=1e-5)


def test_a_blow_within_a_step_is_the_same_at_every_step_length():
    """Half a second after the blow, the rod is where finer steps have it."""
    angles = []
    for step in (5e-3, 1e-3, 2.5e-4):
        simulator = rod().simulator(step)
        balls = Balls([Ball(mass=0.3)], simulator, capsules=links_covered(1))
        balls.throw(0, (-0.5, 0.0, 0.75), (7.0, 0.0, 0.5))
        for _ in range(round(0.4 / step)):
            simulator.step(np.zeros(0))
            balls.follow()
        angles.append(float(simulator.joint_angles[0]))
    assert abs(angles[0]) > 0.2
    assert abs(angles[0] - angles[2]) < 0.03 * abs(angles[2])
    assert abs(angles[1] - angles[2]) < 0.3 * abs(angles[0] - angles[2])


def test_a_carried_body_meets_balls_with_its_bases_speed():
    simulator = rod().simulator()
    balls = Balls([Ball(mass=0.1)], simulator, capsules=[capsule("hip", (0, -0.1, 0), (0, 0.1, 0), 0.05)])
    balls.throw(0, (0.3, 0.0, 1.0), (-1.0, 0.0, 0.5 * G * 0.2 / 3.0))
    for k in range(1, 60):
        simulator.carry((2.0 * STEP * k, 0.0, 0.0), (2.0, 0.0, 0.0))
        simulator.step(np.zeros(0))
        if balls.follow():
            break
    assert balls.hits[0].speed == pytest.approx(3.0, rel=0.02)
    assert balls.hits[0].time == pytest.approx(0.2 / 3.0, abs=3e-3)


def test_ends_move_as_they_say():
    simulator = rod(links=3).simulator()
    simulator.reset(np.array([0.3, -0.5, 0.4]), np.array([2.0, -1.0, 3.0]))
    covered = Capsules(simulator.body, links_covered(3))
    covered.refresh(simulator)
    before, speeds = covered.ends.copy(), covered.speeds.copy()
    for k, row in enumerate(covered.rows):
        for side in range(2):
            through = point_jacobian(simulator, row.bone, before[k, side]) @ simulator.qvel
            np.testing.assert_allclose(speeds[k, side], through, atol=1e-12)
    simulator.reset(simulator.qpos + 1e-6 * simulator.qvel, simulator.qvel.copy())
    covered.refresh(simulator)
    np.testing.assert_allclose((covered.ends - before) / 1e-6, speeds, atol=1e-4)


def test_an_impulse_answers_by_the_mass_matrix_and_moves_what_is_left_of_the_step():
    simulator = rod(links=3).simulator()
    simulator.reset(np.array([0.3, -0.5, 0.4]))
    change = response(simulator, np.array([0.1, -0.2, 0.3]))
    np.testing.assert_allclose(simulator.mass @ change, (0.1, -0.2, 0.3), atol=1e-12)
    jolt(simulator, change, 0.002)
    np.testing.assert_allclose(simulator.qvel, change)
    np.testing.assert_allclose(simulator.joint_angles, np.array([0.3, -0.5, 0.4]) + 0.002 * change)
    with pytest.raises(UserError, match="no bone 'tail'"):
        point_jacobian(simulator, "tail", np.zeros(3))


def test_balls_are_only_in_play_once_thrown():
    simulator = rod().simulator()
    balls = Balls([Ball(), Ball()], simulator, capsules=links_covered(1))
    for _ in range(3):
        simulator.step(np.zeros(0))
        assert balls.follow() == []
    assert np.isnan(balls.position).all() and balls.time == simulator.time
    balls.throw(1, (0.5, 0.0, 1.0))
    simulator.step(np.zeros(0))
    balls.follow()
    assert np.isnan(balls.position[0]).all() and balls.position[1, 2] == pytest.approx(1.0 - 0.5 * G * STEP**2)
    balls.remove(1)
    assert np.isnan(balls.position).all()
    for _ in range(3):
        simulator.step(np.zeros(0))
    with pytest.raises(UserError, match="cannot follow"):
        balls.follow()


def test_what_cannot_be_is_refused():
    for wrong in ({"radius": 0.0}, {"mass": -1.0}, {"restitution": 1.1}, {"radius": np.nan}):
        with pytest.raises(UserError, match="ball"):
            Ball(**wrong)
    with pytest.raises(UserError, match="there are none"):
        Balls([])
    balls = Balls([Ball()])
    with pytest.raises(UserError, match="no ball 1"):
        balls.throw(1, (0, 0, 0))
    for place in ((0, 0, np.nan), (0, 0)):
        with pytest.raises(UserError, match="three finite numbers"):
            balls.throw(0, place)
    with pytest.raises(UserError, match="has no bone that a capsule covers"):
        Capsules(rod())
    wrong = [
        {"normal": (1, 0, 0)},
        {"half_size": (0, 1)},
        {"restitution": 2.0},
        {"friction": -1.0},
        {"centre": (0, 0, np.inf)},
    ]
    for changes in wrong:
        with pytest.raises(UserError, match="slope s"):
            Slope(**{"name": "s", "centre": (0, 0, 0)} | changes)


def test_the_table_is_whole(tmp_path):
    rows = read_capsules()
    names = [row.capsule for row in rows]
    assert len(set(names)) == len(names)
    assert {row.limb for row in rows} == {"right_arm", "left_arm", "right_leg", "left_leg", "head", "trunk"}
    right, left = (next(r for r in rows if r.capsule == f"thigh_{side}") for side in "rl")
    assert left.bone == "femur_l" and left.by_m == -right.by_m and left.radius_m == right.radius_m
    table = tmp_path / "capsules.csv"
    head = "capsule,side,limb,bone,ax_m,ay_m,az_m,bx_m,by_m,bz_m,radius_m,quality,source\n"
    table.write_text(head + "a,M,head,cranium,0,0,0,0,0,1,0.0,estimated,x\n")
    with pytest.raises(UserError, match="radius of a must be positive"):
        read_capsules(table)


def test_capsules_cover_the_bones_and_end_at_the_joints(load_body):
    body = load_body("nakada2018")
    simulator = body.simulator()
    covered = Capsules(body)
    covered.refresh(simulator)
    model, data = body.model, simulator.data
    assert {row.bone for row in covered.rows} == {row.bone for row in read_capsules()}
    place = {row.capsule: k for k, row in enumerate(covered.rows)}
    for name, near, far in (
        ("upper_arm", "humerus", "ulna"),
        ("forearm", "ulna", "lunate"),
        ("thigh", "femur", "tibia"),
        ("shank", "tibia", "talus"),
    ):
        for side in "rl":
            for end, bone in enumerate((near, far)):
                gap = covered.ends[place[f"{name}_{side}"], end] - data.body(f"{bone}_{side}").xpos
                assert np.linalg.norm(gap) < 0.025, (name, side, bone)
    meshes = np.flatnonzero(model.geom_type == mujoco.mjtGeom.mjGEOM_MESH)
    vertices = []
    for geom in meshes:
        mesh = model.geom_dataid[geom]
        first = model.mesh_vertadr[mesh]
        own = model.mesh_vert[first : first + model.mesh_vertnum[mesh]]
        vertices.append(own @ data.geom_xmat[geom].reshape(3, 3).T + data.geom_xpos[geom])
    outside = covered.clearance(np.vstack(vertices))
    assert outside.max() < 0.025 and np.mean(outside > 0.0) < 0.03
