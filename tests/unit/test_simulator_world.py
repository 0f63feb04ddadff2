"""A free root, ligaments, joint springs, ground and seat: small bodies made for each purpose."""

import csv
from dataclasses import replace

import mujoco
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from anthro.body import Body, wrapping
from anthro.body import simulator as simulation
from anthro.body.contact import Seat, World
from anthro.body.model import Contacts
from anthro.body.simulator import Simulator
from anthro.body.strings import elements, is_string
from anthro.body.system import System
from anthro.errors import UserError

MASS = 75.0
SITE = int(mujoco.mjtWrap.mjWRAP_SITE)
FEET = [(x, y, -0.5) for x in (-0.1, 0.0, 0.15) for y in (-0.1, 0.1)]
AXES = {"flexion": (0, 1, 0), "lateral": (1, 0, 0), "axial": (0, 0, 1)}


def add_bone(parent, name, position, mass, inertia=0.05):
    bone = parent.add_body(name=name, pos=position)
    bone.explicitinertial, bone.mass, bone.inertia = True, mass, (inertia, inertia, inertia)
    bone.ipos = (0.01, 0.0, 0.05)
    return bone


def add_tendon(spec, name, *ends):
    tendon = spec.add_tendon(name=name)
    for k, (bone, position) in enumerate(ends):
        bone.add_site(name=f"{name}_{k}", pos=position)
        tendon.wrap_site(f"{name}_{k}")


def as_body(spec, muscles=0, ligaments=(), contacts=(), surfaces="ground seat", **changes):
    """A Body of a compiled spec; ``ligaments`` are kinds (strut or cord), resting at their neutral length."""
    model = spec.compile()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    hinges = [model.joint(i).name for i in range(model.njnt) if model.jnt_type[i] == mujoco.mjtJoint.mjJNT_HINGE]
    neutral, rest = data.ten_length[:muscles], data.ten_length[muscles:]
    strut = np.array([kind == "strut" for kind in ligaments], bool)
    fields = {
        "name": "small",
        "model": model,
        "dof_names": tuple(hinges),
        "dof_regions": ("core",) * len(hinges),
        "q_rest": np.zeros(len(hinges)),
        "q_range": np.tile([-0.6, 0.6], (len(hinges), 1)),
        "joint_stiffness": np.full(len(hinges), 2.0),
        "joint_damping": np.full(len(hinges), 0.5),
        "muscle_names": tuple(f"muscle{i}" for i in range(muscles)),
        "muscle_regions": ("core",) * muscles,
        "muscle_groups": ("trunk",) * muscles,
        "max_force": np.full(muscles, 400.0),
        "slack_length": 0.6 * neutral,
        "tendon_length": 0.4 * neutral,
        "ligament_names": tuple(f"ligament{i}" for i in range(len(ligaments))),
        "ligament_stiffness": np.full(len(ligaments), 2e4),
        "ligament_damping": np.full(len(ligaments), 50.0),
        "ligament_slack": np.stack([np.where(strut, rest, 0.0), rest], axis=1),
        "contacts": Contacts(
            tuple(contacts),
            np.array([model.site(f"contact_{name}").id for name in contacts], int),
            np.full(len(contacts), 0.01),
            (frozenset(surfaces.split()),) * len(contacts),
        ),
        "effectors": {},
        "root_free": bool((model.jnt_type == mujoco.mjtJoint.mjJNT_FREE).any()),
    }
    return Body(**fields | changes)


def new_spec():
    spec = mujoco.MjSpec()
    spec.compiler.degree = False
    spec.option.gravity = (0.0, 0.0, -9.81)
    return spec


def make_statue(centre_height=0.05):
    """A 75 kg body whose six spheres of 1 cm touch the ground when its origin is at 0.51 m, and a nodding head."""
    spec = new_spec()
    trunk = add_bone(spec.worldbody, "trunk", (0, 0, 0.51), MASS - 1.0, 4.0)
    trunk.ipos = (0.01, 0.0, centre_height)
    trunk.add_freejoint(name="root")
    head = add_bone(trunk, "head", (0, 0, 0.3), 1.0)
    head.add_joint(name="nod", type=mujoco.mjtJoint.mjJNT_HINGE, axis=(0, 1, 0))
    for k, foot in enumerate(FEET):
        trunk.add_site(name=f"contact_{k}", pos=foot)
    return as_body(spec, contacts=[str(k) for k in range(6)], joint_stiffness=np.array([50.0]))


@pytest.fixture(scope="module")
def statue():
    """Its centre of mass is at 0.56 m."""
    return make_statue()


@pytest.fixture(scope="module")
def sled():
    """A statue that does not topple: its trunk's mass is 2 cm above the ground."""
    return make_statue(-0.49)


def make_column(ligaments=("strut", "cord"), free=True, feet=False):
    """A column of four bones of 5 kg, three hinges each; three muscles per gap and one over all, two ligaments."""
    spec = new_spec()
    bones = [add_bone(spec.worldbody, "bone0", (0, 0, 1.0), 5.0)]
    if free:
        bones[0].add_freejoint(name="root")
    for i in range(1, 4):
        bones.append(add_bone(bones[-1], f"bone{i}", (0, 0, 0.1), 5.0))
        for name, axis in AXES.items():
            bones[i].add_joint(name=f"{name}{i}", type=mujoco.mjtJoint.mjJNT_HINGE, axis=axis)
    places = [(0.06, 0.0), (-0.04, 0.05), (-0.04, -0.05)]
    for i in range(3):
        for k, (x, y) in enumerate(places):
            add_tendon(spec, f"muscle{i}{k}", (bones[i], (x, y, 0.0)), (bones[i + 1], (x, y, 0.05)))
    add_tendon(spec, "long", (bones[0], (0.08, 0, 0)), (bones[2], (0.09, 0, 0)), (bones[3], (0.08, 0, 0.05)))
    for k, side in zip(range(len(ligaments)), (0.08, -0.08), strict=False):
        add_tendon(spec, f"ligament{k}", (bones[1], (0, side, 0)), (bones[3], (0, side, 0)))
    corners = [(bone, x, y) for bone in bones for x in (-0.1, 0.1) for y in (-0.1, 0.1)] if feet else []
    for k, (bone, x, y) in enumerate(corners):
        bone.add_site(name=f"contact_{k}", pos=(x, y, 0.0))
    return as_body(spec, muscles=10, ligaments=ligaments, contacts=[str(k) for k in range(len(corners))])


@pytest.fixture(scope="module")
def column():
    return make_column()


def run(simulator, seconds, activation=None):
    activation = np.zeros(simulator.body.muscle_count) if activation is None else activation
    for _ in range(round(seconds / simulator.step_seconds)):
        simulator.step(activation)
    return simulator


def energy_growth(simulator, steps):
    lowest, growth = simulator.energy(), 0.0
    for _ in range(steps):
        simulator.step(np.zeros(simulator.body.muscle_count))
        energy = simulator.energy()
        growth, lowest = max(growth, energy - lowest), min(lowest, energy)
    return growth


# Free root


def test_velocities_are_named_and_hinges_come_last(column):
    simulator = column.simulator()
    assert column.velocity_names[:6] == ("root_x", "root_y", "root_z", "root_roll", "root_pitch", "root_yaw")
    assert column.velocity_names[6:] == column.dof_names and len(column.velocity_names) == simulator.model.nv
    simulator.joint_angles[:] = 0.1
    simulator.joint_velocities[:] = 0.2
    np.testing.assert_array_equal(simulator.qpos[7:], 0.1)
    np.testing.assert_array_equal(simulator.qvel, np.r_[np.zeros(6), np.full(9, 0.2)])


def test_a_free_body_falls_as_it_should(statue):
    simulator = run(statue.simulator(1e-3), 0.5)
    drop = statue.simulator().centre_of_mass - simulator.centre_of_mass
    np.testing.assert_allclose(drop, (0.0, 0.0, 0.5 * 9.81 * 0.25), atol=4e-3)


def test_inner_forces_leave_the_centre_of_mass_alone(column):
    """Momentum of a body in free fall with active muscles, against the fall of a stone."""
    simulator = column.simulator(1e-3)
    start = simulator.centre_of_mass
    run(simulator, 0.2, np.linspace(0.0, 0.3, 10))
    moved = simulator.centre_of_mass - start + (0.0, 0.0, 0.5 * 9.81 * 0.2 * 0.201)
    assert np.abs(simulator.joint_angles).max() > 0.05
    np.testing.assert_allclose(moved, 0.0, atol=1e-3)


def test_first_order_convergence_of_a_free_body(column):
    """Errors at 7, 3.5 and 1.75 ms against 0.1 ms halve with the step; muscles, ligaments, limits."""
    activation = np.random.default_rng(2).uniform(0.0, 0.4, 10)

    def end(step):
        simulator = column.simulator(step)
        simulator.reset(None, np.r_[0.1, 0.0, 0.5, 0.3, -0.2, 0.4, np.full(9, 0.5)])
        return run(simulator, 0.21, activation).qpos.copy()

    reference = end(1e-4)
    error = [np.linalg.norm(end(step) - reference) for step in (7e-3, 3.5e-3, 1.75e-3)]
    assert error[0] < 0.05
    assert 1.6 < error[0] / error[1] < 2.6 and 1.6 < error[1] / error[2] < 2.6


@pytest.mark.parametrize("seed", range(6))
def test_energy_never_grows_from_random_poses_up_to_the_limits(seed):
    """A column on a fixed foot, muscles off, poses over the whole range and beyond; tolerance 1e-6 J."""
    rng, body = np.random.default_rng(seed), make_column(("cord", "cord"), free=False)
    simulator = body.simulator(rng.choice([0.005, 0.007]))
    simulator.reset(rng.uniform(-0.65, 0.65, 9), rng.normal(0.0, 1.0, 9))
    assert energy_growth(simulator, 300) < 1e-6


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("step", [0.005, 0.007])
def test_a_whipping_chain_of_many_bones_gains_no_energy(seed, step):
    """Sixteen bones with three hinges each, all turning at about 3 rad/s, a weight of 5 kg on top."""
    spec = new_spec()
    bone = spec.worldbody
    for i in range(16):
        bone = add_bone(bone, f"bone{i}", (0, 0, 0.03), 1.2 if i < 15 else 5.0, 1e-3 if i < 15 else 0.15)
        for name, axis in AXES.items():
            bone.add_joint(name=f"{name}{i}", type=mujoco.mjtJoint.mjJNT_HINGE, axis=axis, armature=1e-4)
    body = as_body(spec)
    rng, simulator = np.random.default_rng(seed), body.simulator(step)
    simulator.reset(rng.uniform(-0.2, 0.2, 48), rng.normal(0.0, 3.0, 48))
    assert energy_growth(simulator, 300) < 1e-6


@pytest.mark.parametrize("seed", range(4))
def test_a_limp_body_that_falls_on_the_ground_gains_no_energy(seed):
    rng, body = np.random.default_rng(seed), make_column(feet=True)
    simulator = Simulator(body, rng.choice([0.005, 0.007]), World())
    pose = simulator.qpos.copy()
    pose[2], pose[7:] = 0.25, rng.uniform(-0.6, 0.6, 9)
    simulator.reset(pose, np.r_[rng.normal(0.0, 1.0, 6), rng.normal(0.0, 2.0, 9)])
    assert energy_growth(simulator, 400) < 1e-6
    assert simulator.contact_force()[:, 2].sum() == pytest.approx(20.0 * 9.81, rel=0.1)


# Paths


def mujocos_paths(model, qpos):
    """Lengths (t,) and dense slopes (t, nv) of all tendons by ``mj_tendon``, at a pose (nq,)."""
    data = mujoco.MjData(model)
    data.qpos[:] = qpos
    mujoco.mj_kinematics(model, data)
    mujoco.mj_comPos(model, data)
    mujoco.mj_tendon(model, data)
    slopes = np.zeros((model.ntendon, model.nv))
    for row in range(model.ntendon):
        entries = slice(model.ten_J_rowadr[row], model.ten_J_rowadr[row] + model.ten_J_rownnz[row])
        slopes[row, model.ten_J_colind[entries]] = data.ten_J[entries]
    return data.ten_length, slopes


def random_pose(body, rng):
    """Angles over the whole range, and a root anywhere (nq,)."""
    pose = body.simulator().qpos.copy()
    pose[-body.dof_count :] = rng.uniform(*body.q_range.T)
    if body.root_free:
        pose[:3], pose[3:7] = rng.normal(size=3), rng.normal(size=4)
        pose[3:7] /= np.linalg.norm(pose[3:7])
    return pose


@pytest.mark.parametrize("which", ["column", "arm", "whole"])
def test_paths_are_mujocos_at_random_poses(which, request):
    """Lengths and all slopes; slopes over wraps to the tolerance of MuJoCo's own search for the point of contact."""
    body, rng = request.getfixturevalue(which), np.random.default_rng(8)
    simulator = body.simulator()
    for _ in range(20):
        simulator.reset(random_pose(body, rng))
        length, slopes = mujocos_paths(body.model, simulator.qpos)
        found = simulator._paths.dense(body.model.ntendon, body.model.nv)
        np.testing.assert_allclose(simulator.data.ten_length, length, rtol=0.0, atol=1e-9)
        np.testing.assert_allclose(found, slopes, rtol=0.0, atol=1e-7)
        straight = [set(body.model.wrap_type[elements(body.model, i)]) == {SITE} for i in range(body.model.ntendon)]
        assert any(straight) and np.abs(found - slopes)[straight].max() < 1e-14


def test_paths_of_two_trees_and_pulleys_are_left_to_mujoco():
    """Two bones that hang in the world beside one another; the world itself belongs to either."""
    spec = new_spec()
    bones = [add_bone(spec.worldbody, name, (x, 0, 0), 1.0) for name, x in (("one", 0.0), ("other", 0.3))]
    for k, bone in enumerate(bones):
        bone.add_joint(name=f"hinge{k}", type=mujoco.mjtJoint.mjJNT_HINGE, axis=(0, 1, 0.2))
    add_tendon(spec, "within", (spec.worldbody, (0.1, 0.1, 0.2)), (bones[1], (0.02, 0, 0.1)), (bones[1], (0, 0, 0.2)))
    add_tendon(spec, "between", (bones[0], (0.05, 0, 0.1)), (bones[1], (0, 0.05, 0.15)))
    add_tendon(spec, "branched", (bones[0], (0.05, 0, 0.2)), (spec.worldbody, (0, 0.05, 0.3)))
    spec.tendon("branched").wrap_pulley(2.0)
    for name in ("between_0", "branched_1"):
        spec.tendon("branched").wrap_site(name)
    body = as_body(spec, muscles=3)
    assert [is_string(body.model, tendon) for tendon in range(3)] == [True, False, False]
    simulator = body.simulator()
    simulator.reset(np.array([0.4, -0.5]))
    length, slopes = mujocos_paths(body.model, simulator.qpos)
    np.testing.assert_allclose(simulator.data.ten_length, length, rtol=0.0, atol=1e-14)
    np.testing.assert_allclose(simulator.jacobian, slopes, rtol=0.0, atol=1e-14)


def test_rows_hold_only_joints_that_change_a_length(column):
    paths = column.simulator()._paths
    assert np.diff(paths.start).max() == 9 and np.diff(paths.start).min() == 3


@given(
    st.floats(-1.0, 1.0).map(lambda x: 10.0 ** (-8.0 + 5.0 * abs(x))),
    st.floats(0.002, 0.05),
    st.floats(1.05, 4.0),
    st.floats(1.05, 4.0),
)
def test_a_string_inside_of_a_wrap_leaves_it_without_a_leap(gap, radius, first, second):
    """A line that all but touches the circle from outside is hardly longer by way of the circle."""
    far = radius * (1.0 + gap)
    a, b = (far, -radius * np.sqrt(first**2 - 1.0), 0.0), (far, radius * np.sqrt(second**2 - 1.0), 0.0)
    centre, frame = (0.0, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0)
    length, come, leave = wrapping.wrap(a, b, centre, True, centre, frame, radius, True)
    assert length == 0.0 and come == leave and np.hypot(*come[:2]) == pytest.approx(radius)
    straight = np.linalg.norm(np.subtract(b, a))
    by_way = np.linalg.norm(np.subtract(come, a)) + np.linalg.norm(np.subtract(b, come))
    assert (
        straight <= by_way + 1e-15
        and by_way - straight < 5.0 * gap * radius / (first - 1.0) / (second - 1.0) + 1e-6 * radius
    )


# Ligaments and joint springs


def ligament_energy(simulator):
    """Elastic energy of the ligaments by their tables, J."""
    body = simulator.body
    low, high = body.ligament_slack.T
    length = simulator.data.ten_length[body.muscle_count :]
    return 0.5 * body.ligament_stiffness @ np.square(length - np.clip(length, low, high))


def shifted(simulator, qpos, velocity, amount):
    """Pose (nq,) turned or moved along one velocity."""
    direction, moved = np.zeros(simulator.model.nv), qpos.copy()
    direction[velocity] = 1.0
    mujoco.mj_integratePos(simulator.model, moved, direction, amount)
    return moved


@pytest.mark.parametrize("seed", range(3))
def test_torques_of_ligaments_are_the_slopes_of_their_energy(column, seed):
    rng, simulator, small = np.random.default_rng(seed), column.simulator(), 1e-6
    qpos, wanted = random_pose(column, rng), []
    for velocity in range(simulator.model.nv):
        energies = []
        for sign in (-1.0, 1.0):
            simulator.reset(shifted(simulator, qpos, velocity, sign * small))
            energies.append(ligament_energy(simulator))
        wanted.append((energies[0] - energies[1]) / (2.0 * small))
    simulator.reset(qpos)
    assert np.abs(wanted).max() > 1.0
    np.testing.assert_allclose(simulator.ligament_torque(), wanted, rtol=1e-5, atol=1e-4)


def test_stiffness_of_ligaments_by_hand(column):
    """J^T diag(k) J of the taut ones: a strut always, a cord beyond its length alone."""
    simulator = column.simulator()
    for bend, taut in ((-0.1, [1.0, 1.0]), (0.1, [1.0, 0.0])):
        pose = simulator.qpos.copy()
        pose[7:] = 0.0
        pose[7 + column.dof_names.index("lateral2")] = bend
        simulator.reset(pose)
        slopes = simulator._paths.dense(12, 15)[10:]
        wanted = slopes.T @ np.diag(2e4 * np.array(taut)) @ slopes
        np.testing.assert_allclose(simulator.ligament_stiffness(np.arange(15)), wanted, atol=1e-9)
        np.testing.assert_allclose(simulator.ligament_stiffness(np.array([9, 7])), wanted[[9, 7]], atol=1e-9)


def test_a_strut_pushes_and_pulls_and_a_cord_only_pulls(column):
    simulator = column.simulator()
    assert np.abs(simulator.ligament_force()).max() < 1e-9
    for bend, strut, cord in ((0.1, -1, 1), (-0.1, 1, 0)):
        pose = simulator.qpos.copy()
        pose[7:] = 0.0
        pose[7 + column.dof_names.index("lateral2")] = -bend  # the strut is on the left, the cord on the right
        simulator.reset(pose)
        force = simulator.ligament_force()
        assert np.sign(force[0]) == strut and np.sign(force[1]) == cord, force
        stretch = simulator.data.ten_length[10:] - column.ligament_slack[:, 1]
        assert force[0] == pytest.approx(2e4 * stretch[0])
        assert force[1] == pytest.approx(max(2e4 * stretch[1], 0.0))


@pytest.mark.parametrize("cord", [False, True])
def test_a_ligament_carries_a_weight(cord):
    """A bone of 5 kg hangs on a hinge and, 8 cm from it, on a ligament: the force is that of statics."""
    spec = new_spec()
    bone = add_bone(spec.worldbody, "bone", (0, 0, 1.0), 5.0)
    bone.ipos = (0.16, 0, 0)
    bone.add_joint(name="hinge", type=mujoco.mjtJoint.mjJNT_HINGE, axis=(0, 1, 0))
    add_tendon(spec, "ligament", (spec.worldbody, (0.08, 0, 1.5)), (bone, (0.08, 0, 0)))
    body = as_body(spec, ligaments=("cord" if cord else "strut",), joint_stiffness=np.zeros(1))
    simulator = run(body.simulator(), 3.0)
    assert simulator.ligament_force()[0] == pytest.approx(2.0 * 5.0 * 9.81, rel=5e-3)


def test_a_joint_spring_bears_a_torque(statue):
    fixed = replace(statue, joint_stiffness=np.array([10.0]))
    simulator = Simulator(fixed, 0.005, World())
    simulator.push((2.0, 0.0, 0.0), "head")
    run(simulator, 4.0)
    lever = simulator.data.xipos[2] - simulator.data.xpos[2]
    torque = 2.0 * lever[2] + 9.81 * lever[0]
    assert simulator.joint_angles[0] == pytest.approx(torque / 10.0, rel=0.02)
    assert simulator.joint_torque()[0] == pytest.approx(-torque, rel=0.02)


def test_an_unknown_bone_or_a_missing_effector_is_refused(statue):
    simulator = statue.simulator()
    with pytest.raises(UserError, match="no bone or effector 'tail'"):
        simulator.push((1.0, 0.0, 0.0), "tail")
    with pytest.raises(UserError, match="no effector 'hand_r'; it has: none"):
        simulator.effector_position("hand_r")


# Contact


@pytest.mark.parametrize("step", [0.005, 0.007])
def test_a_standing_body_sinks_by_millimetres_and_bears_its_weight(statue, step):
    simulator = run(Simulator(statue, step, World()), 3.0)
    force = simulator.contact_force()
    np.testing.assert_allclose(force.sum(axis=0), (0.0, 0.0, MASS * 9.81), atol=0.01)
    depth = 0.51 - simulator.qpos[2]
    assert (force[:, 2] > 0.0).all() and 0.001 < depth < 0.005
    assert np.abs(simulator.qvel).max() < 1e-3


@pytest.mark.parametrize("step", [0.005, 0.007])
@pytest.mark.parametrize("height", [0.0, 0.02, 0.5])
def test_a_dropped_body_comes_to_rest_and_gains_no_energy(statue, step, height):
    simulator = Simulator(statue, step, World())
    pose = simulator.qpos.copy()
    pose[2] += height
    simulator.reset(pose)
    assert energy_growth(simulator, round(3.0 / step)) < 1e-3
    assert np.abs(simulator.qvel).max() < 1e-3 and simulator.qpos[2] == pytest.approx(0.5075, abs=0.002)


def test_contacts_push_and_never_pull(statue):
    simulator = Simulator(statue, 0.005, World())
    pose = simulator.qpos.copy()
    pose[2] -= 0.002
    for speed in (-0.5, 0.0, 0.5, 5.0):
        simulator.reset(pose, np.r_[0.0, 0.0, speed, np.zeros(4)])
        lift = simulator.contact_force()[:, 2]
        np.testing.assert_allclose(lift, max(5e4 * 0.002 - 1e3 * speed, 0.0))
    pose[2] += 0.003
    simulator.reset(pose, np.r_[0.0, 0.0, -5.0, np.zeros(4)])
    assert not simulator.contact_force().any()


@pytest.mark.parametrize("share", [0.6, 1.4])
def test_friction_holds_below_coulombs_limit_and_slips_above(sled, share):
    """A push of ``share`` times mu m g: at rest it creeps below the creep speed, or it accelerates as it should."""
    world = World(friction=0.5)
    simulator = run(Simulator(sled, 0.005, world), 2.0)
    pushed = share * 0.5 * MASS * 9.81
    simulator.push((0.0, pushed, 0.0), "trunk")
    run(simulator, 0.5)
    force, speed = simulator.contact_force(), simulator.qvel[1]
    within = np.hypot(force[:, 0], force[:, 1]) <= 0.5 * force[:, 2] * 1.0001
    assert within.all()
    if share < 1.0:
        assert abs(speed) == pytest.approx(share * world.creep_speed, rel=0.1)
    else:
        assert speed == pytest.approx((share - 1.0) * 0.5 * 9.81 * 0.5, rel=0.1)


def test_a_sliding_body_stops_where_coulomb_says(sled):
    """1 m/s on mu 0.5: after v^2 / 2 mu g = 0.10 m."""
    simulator = run(Simulator(sled, 0.005, World(friction=0.5)), 2.0)
    start = simulator.qpos[1]
    simulator.qvel[1] = 1.0
    simulator.refresh()
    run(simulator, 1.0)
    assert abs(simulator.qvel[1]) < 1e-3
    assert simulator.qpos[1] - start == pytest.approx(1.0 / (2.0 * 0.5 * 9.81), rel=0.1)


def test_halving_the_step_halves_the_error_on_the_ground(sled):
    def end(step):
        simulator = Simulator(sled, step, World())
        pose = simulator.qpos.copy()
        pose[2] -= 0.003
        simulator.reset(pose, np.r_[1.5, 1.0, np.zeros(4), 1.0])
        return run(simulator, 0.105, None).qpos.copy()

    reference = end(5e-5)
    error = [np.linalg.norm(end(step) - reference) for step in (7e-3, 3.5e-3, 1.75e-3)]
    assert 1.5 < error[0] / error[1] < 2.8 and 1.5 < error[1] / error[2] < 2.8


def test_a_seat_bears_only_what_is_above_it_and_may_sit(statue):
    seat = Seat(height=0.4, centre=(0.0, 0.1), half_size=(0.3, 0.05))
    simulator = Simulator(statue, 0.005, World(ground=False, seat=seat))
    pose = simulator.qpos.copy()
    pose[2] += 0.399
    simulator.reset(pose)
    lift = simulator.contact_force()[:, 2]
    np.testing.assert_array_equal(lift > 0.0, [y > 0.0 for _, y, _ in FEET])
    walker = replace(statue, contacts=replace(statue.contacts, surfaces=(frozenset({"ground"}),) * 6))
    simulator = Simulator(walker, 0.005, World(ground=False, seat=seat))
    simulator.reset(pose)
    assert not simulator.contact_force().any()


def test_sitting_body_rests_on_its_seat(statue):
    seat = Seat(height=0.4, half_size=(0.3, 0.3))
    simulator = Simulator(statue, 0.005, World(seat=seat))
    pose = simulator.qpos.copy()
    pose[2] += 0.41
    simulator.reset(pose)
    run(simulator, 3.0)
    assert simulator.qpos[2] == pytest.approx(0.51 + 0.4 - 0.0025, abs=0.001)
    assert simulator.contact_force()[:, 2].sum() == pytest.approx(MASS * 9.81, rel=1e-4)


def test_empty_space_has_no_contact(statue):
    simulator = statue.simulator()
    simulator.qpos[2] = -1.0
    simulator.refresh()
    assert not simulator.contact_force().any()


@pytest.mark.parametrize("wrong", [{"stiffness": 0.0}, {"damping": -1.0}, {"friction": np.nan}, {"creep_speed": 0.0}])
def test_a_world_of_nonsense_is_refused(wrong):
    with pytest.raises(UserError, match=next(iter(wrong))):
        World(**wrong)


# The step's system


def test_an_amended_system_is_solved_as_a_new_one():
    rng, system = np.random.default_rng(5), System(12, 4)
    root, slope = rng.normal(size=(12, 12)), rng.normal(size=(3, 12))
    matrix, weight, push, bias = (
        root @ root.T + np.eye(12),
        np.array([2.0, 0.0, -0.01]),
        rng.normal(size=3),
        np.ones(12),
    )
    system.lower[:], system.force[:] = np.tril(matrix), rng.normal(size=12)
    system.begin()
    assert system.factorize() == 0
    np.testing.assert_allclose(system.solve(0.1, bias), np.linalg.solve(matrix, 0.1 * (system.force - bias)))
    for count in (3, 1, 0):
        system.changes.slope[:3], system.changes.weight[:3], system.changes.push[:3] = slope, weight, push
        system.amend(count)
        new = matrix + slope[:count].T @ (weight[:count, None] * slope[:count])
        right = system.force + slope[:count].T @ push[:count]
        np.testing.assert_allclose(system.solve(0.1, bias), np.linalg.solve(new, 0.1 * (right - bias)))
    system.lower[5, 5] = -1.0
    system.begin()
    assert system.factorize() > 0


@pytest.mark.parametrize("seed", range(3))
def test_amending_for_stops_gives_the_step_of_factoring_anew(seed, monkeypatch):
    """A limp column falls on its corners, joints at their limits; from the same states, to 1e-9."""
    rng, body = np.random.default_rng(seed), make_column(("cord", "cord"), feet=True)
    amending, factoring = (Simulator(body, 0.005, World()) for _ in range(2))
    pose = amending.qpos.copy()
    pose[2], pose[7:] = 0.1, rng.uniform(-0.6, 0.6, 9)
    amending.reset(pose, np.r_[rng.normal(0.0, 1.0, 6), rng.normal(0.0, 3.0, 9)])
    amended, amend = [], System.amend
    monkeypatch.setattr(System, "amend", lambda self, count: (amended.append(count), amend(self, count)))
    for _ in range(150):
        factoring.reset(amending.qpos, amending.qvel)
        for simulator, few in ((amending, np.inf), (factoring, 0.0)):
            monkeypatch.setattr(simulation, "FEW", few)
            simulator.step(np.zeros(10))
        np.testing.assert_allclose(amending.qvel, factoring.qvel, rtol=0.0, atol=1e-9)
    assert np.count_nonzero(amended) > 20


# Files


def save(body, folder):
    """Write a body as the builder does."""
    folder.mkdir()
    mujoco.mj_saveModel(body.model, str(folder / "model.mjb"))
    low, high = body.q_range.T
    slack = body.ligament_slack.T
    tables = {
        "joints": ("joint,region,min,max,rest,stiffness,damping", body.dof_names, body.dof_regions, low, high)
        + (body.q_rest, body.joint_stiffness, body.joint_damping),
        "muscles": ("muscle,region,group,max_force,slack_length,tendon_length", body.muscle_names)
        + (body.muscle_regions, body.muscle_groups, body.max_force, body.slack_length, body.tendon_length),
        "ligaments": ("ligament,stiffness,damping,slack_low,slack_high", body.ligament_names)
        + (body.ligament_stiffness, body.ligament_damping, *slack),
        "contacts": ("contact,radius,surfaces", body.contacts.names, body.contacts.radius)
        + ([" ".join(sorted(met)) for met in body.contacts.surfaces],),
    }
    for name, (header, *columns) in tables.items():
        with (folder / f"{name}.csv").open("w", newline="") as stream:
            writer = csv.writer(stream, lineterminator="\n")
            writer.writerow(header.split(","))
            writer.writerows(zip(*columns, strict=True))
    return folder


@pytest.mark.parametrize("which", ["statue", "column"])
def test_a_saved_body_comes_back(which, tmp_path, request):
    body = request.getfixturevalue(which)
    loaded = Body.load(save(body, tmp_path / "small"))
    assert loaded.root_free and loaded.effectors == {} and loaded.contacts.names == body.contacts.names
    assert loaded.contacts.surfaces == body.contacts.surfaces and loaded.ligament_names == body.ligament_names
    np.testing.assert_array_equal(loaded.ligament_slack, body.ligament_slack)
    ends = [run(Simulator(each, 0.005, World()), 0.1).qpos.tobytes() for each in (body, loaded)]
    assert ends[0] == ends[1]


@pytest.mark.parametrize(
    ("table", "old", "new", "told"),
    [
        ("contacts", "ground seat", "ground sofa", "surfaces must be of ground, seat"),
        ("contacts", "0,0.01", "9,0.01", "no site contact_9"),
        ("contacts", "0.01", "thick", "thick"),
        ("joints", "stiffness", "stiff", "column stiffness is missing"),
        ("joints", "nod", "nod,core,0,0,0,0,0\nnod", "disagree"),
        ("ligaments", "slack_low", "low", "column slack_low is missing"),
    ],
)
def test_a_damaged_table_is_refused_by_name(statue, tmp_path, table, old, new, told):
    folder = save(statue, tmp_path / "small")
    path = folder / f"{table}.csv"
    path.write_text(path.read_text().replace(old, new, 1))
    with pytest.raises(UserError, match=told):
        Body.load(folder)


@pytest.mark.parametrize("table", ["ligaments", "contacts"])
def test_a_missing_table_is_refused_by_name(statue, tmp_path, table):
    folder = save(statue, tmp_path / "small")
    (folder / f"{table}.csv").unlink()
    with pytest.raises(UserError, match=f"{table}.csv: missing"):
        Body.load(folder)
