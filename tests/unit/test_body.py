"""Tables, bodies built of them, fibers, postures; the right arm's signs and the whole body's counts."""

import shutil
from pathlib import Path

import mujoco
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from anthro.body import Body, build, hill
from anthro.body.fit import HARD_LIMITS, fit_fibers, twins_share
from anthro.body.parts import BODIES, REGIONS, body_plan, both_sides, is_paired, left_name, load_part
from anthro.body.postures import PostureSampler
from anthro.body.tables import Bone, Contact, Effector, Joint, Ligament, Muscle, PathPoint, Wrap, read_table
from anthro.errors import UserError

TABLES = Path(__file__).resolve().parents[2] / "config" / "body"
ROWS = {
    "bones": Bone,
    "joints": Joint,
    "muscles": Muscle,
    "paths": PathPoint,
    "wraps": Wrap,
    "ligaments": Ligament,
    "contacts": Contact,
}
MUSCLES = (
    "DELT1 DELT2 DELT3 SUPSP INFSP SUBSC TMIN TMAJ PECM1 PECM2 PECM3 CORB TRIlong TRIlat TRImed ANC "
    "SUP BIClong BICshort BRA BRD ECRL ECRB ECU FCR FCU PL PT PQ"
).split()
DOF = (
    "shoulder_flexion shoulder_abduction shoulder_rotation elbow_flexion forearm_pronation "
    "wrist_deviation wrist_flexion"
).split()


@pytest.fixture
def tables(tmp_path):
    shutil.copytree(TABLES, tmp_path / "tables")
    return tmp_path / "tables"


def change(tables, name, old, new):
    path = tables / "arm" / f"{name}.csv"
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new, 1))


# -- tables -----------------------------------------------------------------------------------------


@pytest.mark.parametrize("region", REGIONS)
def test_every_row_names_its_source_and_quality(region):
    for path in (TABLES / region).glob("*.csv"):
        if path.stem not in ROWS:
            continue
        for row in read_table(path, ROWS[path.stem]):
            assert row.source and row.quality in {"measured", "transferred", "estimated"}, row


@pytest.mark.parametrize(
    ("name", "old", "new", "told"),
    [
        (
            "bones",
            "humerus_r,scapula_r,humerus,",
            "humerus_r,scapula_r,humerus,x",
            "bones.csv:2: origin_x_m is not a num",
        ),
        ("joints", "rest_deg", "rest", "joints.csv: columns are"),
        ("muscles", "optimal_fiber_length_m,", "", "muscles.csv: columns are"),
        ("muscles", "DELT2_r,", "DELT1_r,", "muscle DELT1_r stands more than once"),
        ("joints", "wrist_flexion_r,", "wrist_deviation_r,", "joint wrist_deviation_r stands more"),
        ("bones", "radius_r,ulna_r", "radius_r,elbow", "elbow"),
        ("bones", ",humerus,", ",humorous,", "humorous"),
        ("joints", "elbow_flexion_r,ulna_r", "elbow_flexion_r,elna_r", "elna_r"),
        ("muscles", ",R,", ",right,", "side is 'right', none of R, M"),
        ("paths", ",origin,", ",via,", "does not run from one origin to one insertion"),
        ("paths", "DELT1_r,1,", "DELT9_r,1,", "DELT9_r is no muscle of this region"),
        ("paths", "DELT1_r,2,", "DELT1_r,1,", "DELT1_r 1 stands more than once"),
        ("paths", "DELT1_r,1,origin,", "DELT1_r,1.5,origin,", "order is not a number: '1.5'"),
    ],
)
def test_bad_tables_are_refused_by_name(tables, tmp_path, refusal, name, old, new, told):
    change(tables, name, old, new)
    arguments = ["--body", "right_arm", "--tables", tables, "--out", tmp_path / "out"]
    assert told in refusal(build.main, arguments)
    assert not (tmp_path / "out" / "model.mjb").exists()


def test_missing_table_is_refused_by_name(tables):
    (tables / "arm" / "muscles.csv").unlink()
    with pytest.raises(UserError, match=r"muscles\.csv: anatomy table is missing"):
        load_part("arm", tables)


def test_an_absent_muscle_must_be_one(tables, tmp_path, refusal):
    path = tables / BODIES["nakada2018"].absent
    path.write_text(path.read_text() + "nonsense_r,no reason\n")
    arguments = ["--body", "nakada2018", "--tables", tables, "--out", tmp_path / "out"]
    assert "nonsense_r is no muscle" in refusal(build.main, arguments)


def test_unknown_body_names_the_known_ones(tmp_path, refusal):
    arguments = ["--body", "left_tail", "--tables", TABLES, "--out", tmp_path]
    line = refusal(build.main, arguments)
    assert "left_tail" in line and all(name in line for name in BODIES)
    assert not list(tmp_path.iterdir())


def test_no_such_folder_of_tables(tmp_path, refusal):
    arguments = ["--body", "right_arm", "--tables", tmp_path / "no", "--out", tmp_path]
    assert "no such folder" in refusal(build.main, arguments)


@pytest.mark.parametrize("name", ["model.mjb", "joints.csv", "muscles.csv"])
@pytest.mark.parametrize("damage", ["missing", "truncated"])
def test_damaged_body_is_refused_by_name(arm_folder, tmp_path, name, damage):
    folder = tmp_path / "body"
    shutil.copytree(arm_folder, folder)
    whole = (folder / name).read_bytes()
    (folder / name).unlink() if damage == "missing" else (folder / name).write_bytes(whole[: len(whole) // 2])
    with pytest.raises(UserError, match=r"body"):
        Body.load(folder)


def test_a_number_that_is_none_in_a_built_body(arm_folder, tmp_path):
    folder = tmp_path / "body"
    shutil.copytree(arm_folder, folder)
    text = (folder / "joints.csv").read_text()
    (folder / "joints.csv").write_text(text.replace("1.05", "stiff", 1))
    with pytest.raises(UserError, match=r"joints\.csv.*stiff"):
        Body.load(folder)


# -- mirror -----------------------------------------------------------------------------------------


@pytest.mark.parametrize("region", REGIONS)
def test_the_left_is_the_mirrored_right(region):
    part = load_part(region, TABLES)
    whole = both_sides(part)
    assert len(whole.bones) == sum(1 + is_paired(bone.bone) for bone in part.bones)
    bones = {bone.bone: bone for bone in whole.bones}
    for bone in part.bones:
        if is_paired(bone.bone):
            left = bones[left_name(bone.bone)]
            np.testing.assert_array_equal(np.array(left.origin) * (1, -1, 1), bone.origin)
            assert left.mass_kg == bone.mass_kg and left.mesh == bone.mesh
        else:
            assert bone.origin_y_m == bone.com_y_m == 0.0
    for name, rows in part.paths.items():
        for row, left in zip(rows, whole.paths[left_name(name)], strict=True):
            assert left.bone == left_name(row.bone) and left.order == row.order


def test_equal_angles_are_mirrored_motions(whole):
    """Every left joint turned as its right twin puts every left bone where the mirror has it."""
    model, data = whole.model, mujoco.MjData(whole.model)
    rng = np.random.default_rng(0)
    angle = {name: rng.uniform(*bounds) for name, bounds in zip(whole.dof_names, whole.q_range, strict=True)}
    for name in whole.dof_names:
        if name.endswith("_l"):
            angle[name] = angle[name[:-1] + "r"]
        elif not name.endswith("_r") and name.endswith(("_lateral", "_axial")):
            angle[name] = 0.0
        data.qpos[model.joint(name).qposadr] = angle[name]
    data.qpos[:7] = 0, 0, 1, 1, 0, 0, 0
    mujoco.mj_kinematics(model, data)
    for body in range(1, model.nbody):
        name = model.body(body).name
        if name.endswith("_r"):
            left = data.body(name[:-1] + "l").xpos * (1, -1, 1)
            np.testing.assert_allclose(left, data.xpos[body], atol=1e-12)


# -- the whole body ---------------------------------------------------------------------------------


def test_counts_of_the_whole_body(whole):
    """Zhou et al. 2021, Sec. 2: 193 bones, 163 DoF, 823 muscles; arm 29 and leg 39 a side."""
    assert whole.model.nbody - 1 == 193
    assert whole.dof_count == 163 and whole.root_free and whole.model.nv == 169
    assert whole.muscle_count == 823
    assert whole.model.body_mass.sum() == pytest.approx(75.0, abs=1e-6)


@pytest.mark.parametrize(("region", "muscles"), [("core", 443), ("neck", 244), ("arm", 58), ("leg", 78)])
def test_counts_by_region(region, muscles):
    assert len(both_sides(load_part(region, TABLES)).muscles) == muscles


def test_the_seated_body_drives_352_muscles(load_body):
    """Nakada et al. 2018, Sec. 4: 216 + 2 x 29 + 2 x 39."""
    body = load_body("nakada2018")
    assert body.muscle_count == 352 and not body.root_free
    neck = {muscle.muscle for muscle in both_sides(load_part("neck", TABLES)).muscles}
    assert len(neck & set(body.muscle_names)) == 216
    assert not any(name.startswith(("L", "T1", "rib", "sternum", "clav", "scap")) for name in body.dof_names)
    assert body.dof_count == 21 + 2 * 7 + 2 * 8


def test_a_step_of_the_whole_body_keeps_the_mirror(whole):
    """Limp and let fall upright, it has not left the mirror's plane after half a second."""
    simulator = whole.simulator()
    for _ in range(100):
        simulator.step(np.zeros(whole.muscle_count))
    angles = dict(zip(whole.dof_names, simulator.joint_angles, strict=True))
    assert max(abs(angles[n] - angles[n[:-1] + "l"]) for n in angles if n.endswith("_r")) < 1e-6
    assert abs(simulator.centre_of_mass[1]) < 1e-6


def test_passive_joints_settle_where_their_ligaments_rest(whole):
    """A bent spine takes the ribs along; settling them lowers the energy of ligaments and springs."""
    sampler = PostureSampler(whole.model)
    posture = sampler.draw(1, np.random.default_rng(3))[0]

    def energy(angles):
        ligaments = slice(whole.muscle_count, None)
        low, high = whole.ligament_slack.T
        length = sampler.lengths(angles)[ligaments]
        stretch = length - np.clip(length, low, high)
        return 0.5 * whole.ligament_stiffness @ stretch**2 + 0.5 * whole.joint_stiffness @ angles**2

    ribs = np.array([name.startswith(("rib", "sternum", "patella")) for name in whole.dof_names])
    stiff = np.where(ribs, 0.0, posture)
    assert energy(posture) < energy(stiff)
    assert (posture >= sampler.low - 1e-12).all() and (posture <= sampler.high + 1e-12).all()


# -- fibers -----------------------------------------------------------------------------------------


@given(
    st.floats(0.05, 0.5),
    st.lists(st.floats(0.0, 1.0), min_size=20, max_size=60),
    st.floats(0.01, 0.4),
    st.floats(0.001, 0.2),
)
def test_a_fitted_fiber_is_no_shorter_than_the_sources_and_its_tendon_is_real(base, shares, optimal, excursion):
    lengths = base + excursion * np.array(shares)[:, None]
    neutral = lengths[0]
    fit = fit_fibers(lengths, np.array([optimal]), neutral)
    assert fit.tendon_length[0] >= -1e-12
    longest = np.quantile(lengths, 0.995)
    assert fit.slack_length[0] >= min(optimal, longest / 1.08) - 1e-12
    assert (longest - fit.tendon_length[0]) / fit.slack_length[0] <= 1.08 + 1e-9
    assert (neutral[0] - fit.tendon_length[0]) / fit.slack_length[0] <= 1.02 + 1e-9


def test_both_sides_get_one_fit():
    rng = np.random.default_rng(0)
    lengths = rng.uniform(0.1, 0.2, (50, 3))
    shared = twins_share(lengths, ["a_r", "a_l", "m"])
    np.testing.assert_array_equal(shared[:, 0], shared[:, 1])
    assert shared[:, 2].min() == lengths[:, 2].min()


def test_no_fiber_of_the_arm_leaves_its_limits(arm):
    """Over postures the fit never saw."""
    sampler = PostureSampler(arm.model)
    lengths = np.array([sampler.lengths(q) for q in sampler.draw(1500, np.random.default_rng(17))])
    fiber = (lengths - arm.tendon_length) / arm.slack_length
    assert fiber.min() > HARD_LIMITS[0] - 0.02 and fiber.max() < 1.3
    assert (arm.tendon_length >= 0.0).all()


def test_passive_force_is_small_at_rest(arm, whole):
    for body in (arm, whole):
        simulator = body.simulator()
        passive = hill.passive_force(simulator.strain, simulator.strain_rate, body.max_force)
        assert (passive < 0.15 * body.max_force).all()


# -- bodies of one family ---------------------------------------------------------------------------

FAMILY = [name for name, plan in BODIES.items() if plan.fibers_of]


def rows_of(part, whole):
    """Place of a body's muscles among those of another."""
    return [whole.muscle_names.index(name) for name in part.muscle_names]


@pytest.mark.parametrize("name", FAMILY)
def test_given_fibers_are_the_other_bodys_exactly(name, load_body, whole):
    body = load_body(name)
    rows = rows_of(body, whole)
    for column in ("slack_length", "tendon_length", "max_force"):
        np.testing.assert_array_equal(getattr(body, column), getattr(whole, column)[rows])


def test_fibers_on_the_command_line(whole_folder, arm_folder, tmp_path, refusal, monkeypatch):
    given = ["--body", "right_arm", "--tables", TABLES, "--out", tmp_path / "right_arm", "--fibers"]
    monkeypatch.setattr(build.build, "__defaults__", (5, None))
    assert build.main([str(argument) for argument in [*given, whole_folder]]) == 0
    assert (tmp_path / "right_arm" / "muscles.csv").read_bytes() == (arm_folder / "muscles.csv").read_bytes()
    leg = ["--body", "right_leg", "--tables", TABLES, "--out", tmp_path / "leg", "--fibers"]
    assert "right_arm: has no muscle" in refusal(build.main, [*leg, arm_folder])
    assert "nothing: " in refusal(build.main, [*leg, tmp_path / "nothing"]).replace("/model.mjb", "")
    assert not (tmp_path / "leg" / "model.mjb").exists()


@pytest.mark.parametrize(("limb", "effectors"), [("arm", ("hand", "finger")), ("leg", ("foot",))])
def test_a_left_body_is_the_right_one_in_the_mirror(load_body, limb, effectors):
    """Equal angles and velocities give equal strains, moment arms and rates, and mirrored places."""
    right, left = load_body(f"right_{limb}"), load_body(f"left_{limb}")
    assert left.muscle_names == tuple(left_name(name) for name in right.muscle_names)
    assert left.dof_names == tuple(left_name(name) for name in right.dof_names)
    np.testing.assert_array_equal(left.q_range, right.q_range)
    rng, pair = np.random.default_rng(2), [right.simulator(), left.simulator()]
    for _ in range(5):
        q, v = rng.uniform(*right.q_range.T), rng.normal(size=right.dof_count)
        for simulator in pair:
            simulator.reset(q, v)
        one, other = pair
        np.testing.assert_allclose(other.strain, one.strain, atol=1e-7)
        np.testing.assert_allclose(other.moment_arms(), one.moment_arms(), atol=1e-6)
        np.testing.assert_allclose(other.strain_rate, one.strain_rate, atol=1e-5)
        for name in effectors:
            mirrored = other.effector_position(f"{name}_l") * (1, -1, 1)
            np.testing.assert_allclose(mirrored, one.effector_position(f"{name}_r"), atol=1e-9)


@pytest.mark.parametrize(
    ("name", "effectors"),
    [
        ("zhou2021", "T1 finger_l finger_r foot_l foot_r hand_l hand_r head"),
        ("right_arm", "T1 finger_r hand_r"),
        ("left_arm", "T1 finger_l hand_l"),
        ("left_leg", "T1 foot_l"),
        ("neck_seated", "T1 head"),
    ],
)
def test_effectors_stand_where_the_table_says_and_along_the_world(load_body, name, effectors):
    body = load_body(name)
    assert sorted(body.effectors) == effectors.split()
    data = mujoco.MjData(body.model)
    mujoco.mj_kinematics(body.model, data)
    # the assembly frame stands where the root bone's origin is
    table = {row.effector: row for row in read_table(TABLES / "effectors.csv", Effector)}
    root = next(bone for bone in load_part("core", TABLES).bones if bone.parent == "world")
    shift = data.xpos[1] - root.origin
    for effector, site in body.effectors.items():
        row = table[effector[:-1] + "r" if effector.endswith("_l") else effector]
        at = np.array([row.x_m, row.y_m, row.z_m]) * (1, -1 if effector.endswith("_l") else 1, 1)
        np.testing.assert_allclose(data.site_xpos[site] - shift, at, atol=1e-9)
        np.testing.assert_allclose(data.site_xmat[site].reshape(3, 3), np.eye(3), atol=1e-9)
    with pytest.raises(UserError, match="has no effector 'tail'; it has: "):
        body.effector("tail")


def test_a_movable_body_may_be_placed_elsewhere_alone(load_body):
    still = load_body("right_arm")
    moved = still.movable()
    moved.model.body_pos[1] += (0.0, 0.0, 0.5)
    gap = moved.simulator().effector_position("hand_r") - still.simulator().effector_position("hand_r")
    np.testing.assert_allclose(gap, (0.0, 0.0, 0.5), atol=1e-12)


# -- the right arm ----------------------------------------------------------------------------------


def test_counts_and_names_of_the_arm(arm):
    assert arm.muscle_names == tuple(f"{name}_r" for name in MUSCLES)
    assert arm.dof_names == tuple(f"{name}_r" for name in DOF)
    assert set(arm.muscle_groups) == {"shoulder", "elbow", "forearm", "wrist"}
    assert arm.model.nv == arm.model.nq == 7


def test_building_twice_gives_the_same_tables(arm_folder, whole_folder, tmp_path):
    build.build("right_arm", TABLES, tmp_path / "again", 1, 10, whole_folder)
    for name in ("model.mjb", "muscles.csv", "joints.csv", "fit.json"):
        assert (tmp_path / "again" / name).read_bytes() == (arm_folder / name).read_bytes()


def test_the_rest_posture_lies_in_the_ranges(arm, whole):
    for body in (arm, whole):
        low, high = body.q_range.T
        assert (low < high).all() and (low <= body.q_rest).all() and (body.q_rest <= high).all()


def test_the_builder_knows_its_plans():
    assert body_plan("zhou2021").regions == REGIONS


HANGING, BENT = [0.0] * 7, [0.0, 0.0, 0.0, 90.0, 0.0, 0.0, 0.0]


def displacement(arm, dof, bone, pose):
    """How a bone's origin moves, m, x forward, y left, z up, when a DoF grows by 0.2 rad."""
    places = []
    for angle in (0.0, 0.2):
        data = mujoco.MjData(arm.model)
        data.qpos[:] = np.deg2rad(pose)
        data.qpos[DOF.index(dof)] += angle
        mujoco.mj_kinematics(arm.model, data)
        places.append(data.body(bone).xpos.copy())
    return places[1] - places[0]


@pytest.mark.parametrize(
    ("dof", "bone", "pose", "axis", "sign"),
    [
        ("shoulder_flexion", "metacarpal_3_r", HANGING, 0, 1),  # forward
        ("shoulder_abduction", "metacarpal_3_r", HANGING, 1, -1),  # to the right
        ("shoulder_rotation", "metacarpal_3_r", BENT, 1, 1),  # inwards: the forearm swings to the left
        ("elbow_flexion", "metacarpal_3_r", BENT, 2, 1),  # up
        ("forearm_pronation", "metacarpal_1_r", BENT, 1, 1),  # the thumb goes to the left
        ("wrist_deviation", "distal_phalanx_3_r", BENT, 2, 1),  # radial: towards the thumb, which is up
        ("wrist_flexion", "distal_phalanx_3_r", BENT, 1, 1),  # towards the palm, which faces left
    ],
)
def test_which_way_a_degree_of_freedom_is_positive(arm, dof, bone, pose, axis, sign):
    moved = displacement(arm, dof, bone, pose)
    assert np.sign(moved[axis]) == sign and abs(moved[axis]) > 0.005


def test_muscles_move_only_the_joints_they_cross(arm):
    groups = dict(zip(arm.muscle_names, arm.muscle_groups, strict=True))
    arms = np.abs(arm.simulator().jacobian)
    for i, muscle in enumerate(arm.muscle_names):
        if groups[muscle] == "shoulder":
            assert arms[i, 3:].max() < 1e-9
        else:
            assert arms[i, :3].max() < 1e-9 or muscle in {"TRIlong_r", "BIClong_r", "BICshort_r"}
        if groups[muscle] == "wrist":
            assert arms[i, 5:].max() > 5e-3
