"""Checks of a body: a small good body passes, and each check sees the fault put into it."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import trimesh

from anthro import cli
from anthro.body import check as command
from anthro.body.builder import compose
from anthro.body.checks import (
    CHECKS,
    attachments,
    convergence,
    inventory,
    mass,
    moment_arms,
    motions,
    paths,
    quiet,
    ranges,
    references,
    signs,
    stability,
    strength,
    symmetry,
)
from anthro.body.checks.outcome import Outcome, factor, factor_to_band
from anthro.body.checks.subject import Options, Subject
from anthro.body.model import Body, Contacts
from anthro.body.parts import BodyPlan, Part, both_sides
from anthro.body.tables import Bone, Contact, Joint, Muscle, PathPoint, Wrap
from anthro.errors import UserError
from anthro.scorecard import judge

TABLES = Path(__file__).resolve().parents[2] / "config" / "body"
SURFACE = 0.03  # m, radius of every bone's surface about its joint centre
ORIGINS = {"sacrum": (0, 0, 1.0), "L5": (0, 0, 1.1), "femur_r": (0, -0.1, 0.9), "tibia_r": (0, -0.1, 0.5)}
PARENTS = {"sacrum": "world", "L5": "sacrum", "femur_r": "sacrum", "tibia_r": "femur_r"}
MASSES = {
    "sacrum": ("lower_trunk", 10.0),
    "L5": ("middle_trunk", 25.0),
    "femur_r": ("thigh", 10.62),
    "tibia_r": ("shank", 3.2475),
}
HINGES = {
    "L5_flexion": ("L5", (0, 1, 0), -5.1, 11.9),
    "L5_lateral": ("L5", (1, 0, 0), -3.0, 3.0),
    "L5_axial": ("L5", (0, 0, 1), -1.0, 1.0),
    "hip_flexion_r": ("femur_r", (0, -1, 0), -15.0, 115.0),
    "hip_adduction_r": ("femur_r", (1, 0, 0), -40.0, 30.0),
    "hip_rotation_r": ("femur_r", (0, 0, 1), -40.0, 40.0),
    "knee_flexion_r": ("tibia_r", (0, 1, 0), 0.0, 135.0),
}
BEHIND_THE_KNEE = [("femur_r", (-0.03, 0, 0)), ("knee_r", (-0.04, 0, 0)), ("tibia_r", (-0.018, 0, -0.024))]
ERECTOR = [("sacrum", (-0.024, -0.018, 0)), ("L5", (-0.024, -0.018, 0))]
# muscle: group, cm^2, and its elements: a bone with a point about its joint centre, or a wrap with its side point
MUSCLES = {
    "iliacus_r": ("hip", 30.0, [("sacrum", (0.03, 0, 0)), ("femur_r", (0.03, 0, 0))]),
    "glmax1_r": ("hip", 60.0, [("sacrum", (-0.03, 0, 0)), ("femur_r", (-0.03, 0, 0))]),
    "bfsh_r": ("knee", 10.0, BEHIND_THE_KNEE),
    "multifidus_lumborum_r": ("multifidus lumborum", 5.0, ERECTOR),
    "rectus_abdominis": ("rectus abdominis", 5.0, [("sacrum", (0.03, 0, 0)), ("L5", (0.03, 0, 0))]),
}  # fmt: skip
SMALL = Options(seed=1, poses=60, seconds=0.5, starts=1, jobs=1)


class Spheres:
    """Every bone's surface is a sphere about its joint centre; the cell is the right bone's name."""

    def get(self, cell):
        return trimesh.creation.icosphere(4, SURFACE).apply_translation(ORIGINS[cell])


def add(bone, offset):
    return tuple(float(a + b) for a, b in zip(ORIGINS[bone], offset, strict=True))


def tables(hinges, muscles, masses):
    """One region with all rows of the small body."""
    tail = ("estimated", "test")
    bones = [
        Bone(b, PARENTS[b], b, *at, masses[b][1], *at, 0.1, 0.1, 0.1, masses[b][0], *tail) for b, at in ORIGINS.items()
    ]
    joints = [Joint(n, b, *axis, low, high, 0.0, 2.0, 2.0, *tail) for n, (b, axis, low, high) in hinges.items()]
    rows = [Muscle(n, f"{n} in words", g, "R", area, 0.1, *tail) for n, (g, area, _) in muscles.items()]
    paths_of = {}
    for name, (_, _, elements) in muscles.items():
        out = []
        for order, (on, point) in enumerate(elements, start=1):
            kind = "origin" if order == 1 else "insertion" if order == len(elements) else "wrap"
            if kind == "wrap":
                row = PathPoint(name, order, kind, "", None, None, None, on, *add("tibia_r", point), *tail)
            else:
                row = PathPoint(name, order, kind, on, *add(on, point), "", None, None, None, *tail)
            out.append(row)
        paths_of[name] = tuple(out)
    wraps = (Wrap("knee_r", "femur_r", "cylinder", *ORIGINS["tibia_r"], 0, 1, 0, 0.02, 0.1, *tail),)
    contacts = (Contact("foot_r", "R", "tibia_r", 0.0, -0.1, 0.05, 0.02, "ground seat", *tail),)
    contacts += (Contact("seat", "M", "sacrum", 0.0, 0.0, 0.9, 0.05, "ground seat", *tail),)
    contacts += (Contact("back", "M", "L5", -0.1, 0.0, 1.3, 0.05, "ground", *tail),)
    return Part("core", tuple(bones), tuple(joints), tuple(rows), paths_of, wraps, (), contacts)


def subject(hinges=HINGES, muscles=MUSCLES, masses=MASSES, options=SMALL, name="small"):
    """The small body of both sides, its root free, its fibers at rest when it stands."""
    part = both_sides(tables(hinges, muscles, masses))
    plan = BodyPlan(name, ("core",), ("core",), ("core",), root_free=True)
    builder = compose(plan, [part], Spheres())
    model = builder.compile()
    rows = {joint.joint: joint for joint in part.joints}
    names = [model.joint(j).name for j in range(1, model.njnt)]
    slack = np.full(len(builder.muscles), 0.1)
    body = Body(
        name=name,
        model=model,
        dof_names=tuple(names),
        dof_regions=("core",) * len(names),
        q_rest=np.zeros(len(names)),
        q_range=np.deg2rad([(rows[n].min_deg, rows[n].max_deg) for n in names]),
        joint_stiffness=np.array([rows[n].stiffness_Nm_rad for n in names]),
        joint_damping=np.array([rows[n].damping_Nms_rad for n in names]),
        muscle_names=tuple(row.muscle for row in builder.muscles),
        muscle_regions=tuple(builder.muscle_regions),
        muscle_groups=tuple(row.group for row in builder.muscles),
        max_force=np.array([row.pcsa_cm2 * 60.0 for row in builder.muscles]),
        slack_length=slack,
        tendon_length=model.tendon_length0 - slack,
        ligament_names=(),
        ligament_stiffness=np.zeros(0),
        ligament_damping=np.zeros(0),
        ligament_slack=np.zeros((0, 2)),
        contacts=Contacts(
            tuple(row.contact for row in builder.contacts),
            np.array([model.site(f"contact_{row.contact}").id for row in builder.contacts]),
            np.array([row.radius_m for row in builder.contacts]),
            tuple(frozenset(row.surfaces.split()) for row in builder.contacts),
        ),
        effectors={},
        root_free=True,
    )
    return Subject(body, plan, [part], Spheres(), TABLES, options)


@pytest.fixture(scope="module")
def small():
    return subject()


def changed(good, **numbers):
    """The same subject with other numbers in its body."""
    body = replace(good.body, **numbers)
    return Subject(body, good.plan, good.parts, good.meshes, good.tables, good.options)


def verdicts(outcome):
    return {(row["item"].rpartition(", ")[2], row["metric"]): judge(row)["status"] for row in outcome.rows}


def missed(outcome, metric):
    """Whether a metric of this name is a miss or near, in any part."""
    found = [judge(row)["status"] for row in outcome.rows if row["metric"] == metric]
    assert found, f"no row {metric}"
    return any(status in ("miss", "near") for status in found)


def test_factors():
    assert factor(2.0, 4.0) == 2.0 == factor(4.0, 2.0) and factor(-1.0, 2.0) == np.inf == factor(0.0, 1.0)
    assert factor_to_band(5.0, 4.0, 6.0) == 1.0 and factor_to_band(8.0, 4.0, 6.0) == 8.0 / 6.0
    assert factor_to_band(2.0, 4.0, 6.0) == 2.0


def test_rows_fit_the_scorecard():
    out = Outcome("zhou2021", "mass")
    out.add("phantom mass", 0.0, "kg", 1e-9, "max", part="head")
    assert judge(out.rows[0])["status"] == "pass" and out.rows[0]["paper"] == "zhou2021"


def test_tables_of_another_body_are_refused(small):
    with pytest.raises(UserError, match="build the body again"):
        changed(small, muscle_names=small.body.muscle_names[::-1])


def test_inventory_counts_and_names(small):
    assert not any(missed(inventory.check(small), row["metric"]) for row in inventory.check(small).rows)
    assert missed(inventory.check(subject(name="right_arm")), "muscles")
    nameless = subject()
    nameless.parts[0] = replace(
        nameless.parts[0], muscles=tuple(replace(row, anatomical_name=" ") for row in nameless.parts[0].muscles)
    )
    del nameless.muscle_rows
    assert missed(inventory.check(nameless), "muscles without an anatomical name")
    backward = subject(HINGES | {"hip_flexion_r": ("femur_r", (0, 1, 0), -115.0, 15.0)})
    assert inventory.wrong_senses(backward) == ["hip_flexion_r"]
    assert missed(inventory.check(backward), "hinges against the sense of their name")


def test_mass_of_segments_and_phantoms(small):
    out = verdicts(mass.check(small))
    assert out["thigh", "distance of the mass"] == "pass" and out["body small: mass", "phantom mass"] == "pass"
    heavy = subject(masses=MASSES | {"femur_r": ("thigh", 15.0)})
    assert verdicts(mass.check(heavy))["thigh", "distance of the mass"] == "miss"
    haunted = subject()
    haunted.model.body_mass[2] += 0.5
    assert missed(mass.check(haunted), "phantom mass")


def test_bones_combine_by_parallel_axes():
    bones = [row for row in tables(HINGES, MUSCLES, MASSES).bones if row.bone in ("femur_r", "tibia_r")]
    whole, centre, inertia = mass.combine(bones)
    first, second = 10.62, 3.2475
    reduced = first * second / (first + second)
    assert whole == pytest.approx(first + second)
    assert centre == pytest.approx([0.0, -0.1, (0.9 * first + 0.5 * second) / whole])
    assert np.diag(inertia) == pytest.approx(0.01 * whole + reduced * 0.16 * np.array([1.0, 1.0, 0.0]))


def test_symmetry(small):
    assert set(verdicts(symmetry.check(small)).values()) == {"pass"}
    force = small.body.max_force.copy()
    force[1] += 1e-6
    assert missed(symmetry.check(changed(small, max_force=force)), "max force")
    crooked = subject()
    crooked.model.body_ipos[3, 1] += 1e-6
    assert missed(symmetry.check(crooked), "centre of mass")
    site = crooked.model.site("glmax1_l_2").id
    crooked.model.site_pos[site, 0] += 1e-6
    assert missed(symmetry.check(crooked), "muscle length") and missed(symmetry.check(crooked), "moment arm")


def test_mirrored_posture_changes_sides(small):
    q = np.zeros(small.body.dof_count)
    q[small.dof["hip_flexion_r"]], q[small.dof["L5_axial"]] = 0.3, 0.01
    mirror = symmetry.mirrored_posture(small, q)
    assert mirror[small.dof["hip_flexion_l"]] == 0.3 and mirror[small.dof["hip_flexion_r"]] == 0.0
    assert mirror[small.dof["L5_axial"]] == -0.01


def test_ranges(small):
    out = verdicts(ranges.check(small))
    assert out["knee flexion", "factor to the published band"] == "pass"
    stiff = subject(HINGES | {"knee_flexion_r": ("tibia_r", (0, 1, 0), 0.0, 60.0)})
    assert verdicts(ranges.check(stiff))["knee flexion", "factor to the published band"] == "miss"
    wide = subject(HINGES | {"L5_axial": ("L5", (0, 0, 1), -5.0, 5.0)})
    values = {row["metric"]: row["value"] for row in ranges.check(wide).rows}
    assert values["largest factor to it"] == pytest.approx(5.0)


def test_paths_that_jump_are_seen(small):
    good = paths.check(small)
    assert not missed(good, "largest jump over 0.2 degrees") and good.details["wrapped_muscles"] == 2
    over = [("femur_r", (0, 0, -0.03)), ("knee_r", (0.017, 0, 0.047)), ("tibia_r", (0, 0, -0.03))]
    slipping = subject(muscles=MUSCLES | {"bfsh_r": ("knee", 10.0, over)}, options=replace(SMALL, poses=1500))
    out = paths.check(slipping)
    assert missed(out, "largest jump over 0.2 degrees") and missed(out, "muscles that jump")
    assert {row["muscle"] for row in out.details["jumps"]} >= {"bfsh_r"}
    assert out.details["jumps"][0]["hinge"].startswith("knee_flexion")


def test_fibers_outside_are_listed(small):
    short = changed(small, tendon_length=small.body.tendon_length + 0.08)
    out = paths.check(short)
    assert missed(out, "fibers outside 0.5 to 1.6 of slack length") and "glmax1_r" in out.details["fibers_outside"]


def test_hinges_are_turned_together_unless_they_share_a_muscle():
    crossed = np.array([[1, 1, 0, 0, 0], [0, 0, 1, 1, 0], [0, 0, 0, 1, 0]], bool)
    groups = paths.colours(crossed)
    assert sorted(dof for members in groups for dof in members) == [0, 1, 2, 3] and len(groups) == 2
    assert all(crossed[:, members].sum(axis=1).max() == 1 for members in groups)


def test_attachments(small):
    assert not missed(attachments.check(small), "largest distance from the bone")
    far = MUSCLES | {"glmax1_r": ("hip", 60.0, [("sacrum", (-0.09, 0, 0)), ("femur_r", (-0.03, 0, 0))])}
    out = attachments.check(subject(muscles=far))
    assert missed(out, "largest distance from the bone")
    assert out.details["farthest"][0] | {"distance_m": 0} == {
        "muscle": "glmax1_r", "end": "origin", "bone": "sacrum", "distance_m": 0, "carried": False,
    }  # fmt: skip


def test_motions_ask_geometry_and_not_names(small):
    ((dof, sense),) = motions.hinges(small, "hip", "abduction")
    assert small.body.dof_names[dof] == "hip_adduction_r" and sense == -1.0
    assert motions.hinges(small, "hip", "adduction") == [(dof, 1.0)]
    assert motions.hinges(small, "lumbar_total", "axial_same") == [(small.dof["L5_axial"], -1.0)]
    assert motions.hinges(small, "elbow", "flexion") == [] == motions.hinges(small, "knee", "abduction")


def test_muscles_by_group_name_and_list(small):
    def named(text):
        return [small.body.muscle_names[i] for i in small.muscles_of(text)]

    assert named("rectus abdominis") == ["rectus_abdominis"] and named("psoas") == []
    assert named("gluteus maximus (glmax1-3)") == ["glmax1_r"]
    assert named("biceps femoris (bflh, bfsh)") == ["bfsh_r"]


def test_signs(small):
    out = signs.check(small)
    assert out.details["false"] == [] and len(out.details["table"]) >= 6
    front = MUSCLES | {"glmax1_r": ("hip", 60.0, [("sacrum", (0.03, 0, 0)), ("femur_r", (0.03, 0, 0))])}
    found = signs.check(subject(muscles=front))
    assert missed(found, "statements that do not hold")
    assert ("glmax1", "extension") in {(row["muscle"], row["motion"]) for row in found.details["false"]}


def test_notes_name_ribs():
    assert signs.rib_numbers("N = 2 to 5") == range(2, 6) and signs.rib_numbers("N = 1, neck fixed") == range(1, 2)
    assert signs.rib_numbers("summed") is None


def test_moment_arms(small):
    out = moment_arms.check(small)
    ours = {(row["muscle_group"], row["angle_deg"]): row for row in out.details["table"] if row["joint"] == "hip"}
    row = ours["gluteus maximus (glmax1-3)", 0.0]
    assert row["ours_m"] == pytest.approx(0.03 * np.cos(np.arctan2(0.0, 0.1)), abs=0.02) and row["ratio"] > 0.0
    front = MUSCLES | {"glmax1_r": ("hip", 60.0, [("sacrum", (0.03, 0, 0)), ("femur_r", (0.03, 0, 0))])}
    assert missed(moment_arms.check(subject(muscles=front)), "groups of the other sign")


def test_strength_is_that_of_the_muscles(small):
    out = strength.check(small)
    rows = {(row["joint"], row["motion"]): row for row in out.details["table"]}
    flexion = rows["knee", "flexion"]
    q = motions.posture(small, strength.POSTURES["knee", flexion["posture"]])
    alone = strength.torques(small, q)[small.muscles_of("bfsh")[0], small.dof["knee_flexion_r"]]
    assert flexion["ours_Nm"] <= alone * 1.2 and flexion["ours_Nm"] > 0.0
    giant = changed(small, max_force=1e3 * small.body.max_force)
    part = [row for row in strength.check(giant).rows if row["item"].endswith("knee flexion")]
    assert judge(part[-1])["status"] == "miss"


def test_strength_holds_the_other_axes(small):
    """The lumbar extensor of the right also bends and turns; both sides together do not."""
    q = np.zeros(small.body.dof_count)
    torque = strength.torques(small, q)
    right, left = (small.body.muscle_names.index(f"multifidus_lumborum_{side}") for side in "rl")
    ours = strength.strongest(small, "lumbar_total", "extension", "upright")
    assert ours == pytest.approx(-torque[[right, left], small.dof["L5_flexion"]].sum())


def test_stability_sees_energy_that_is_made(small, tmp_path):
    kept = Subject(small.body, small.plan, small.parts, small.meshes, TABLES, replace(SMALL, folder=tmp_path))
    out = stability.check(kept)
    metric = "largest rise of energy in a step, of the start's"
    assert not missed(out, metric) and not missed(out, "runs that broke")
    pushed = changed(small, joint_damping=np.full(small.body.dof_count, -2.0))
    assert missed(stability.check(pushed), metric)
    broken = changed(small, joint_damping=np.full(small.body.dof_count, -30.0))
    assert missed(stability.check(broken), "runs that broke")


def test_stability_goes_on_where_it_was(small, tmp_path, monkeypatch):
    kept = Subject(small.body, small.plan, small.parts, small.meshes, TABLES, replace(SMALL, folder=tmp_path))
    first = stability.check(kept)
    monkeypatch.setattr(stability, "run", lambda *_: pytest.fail("ran again"))
    assert stability.check(kept).rows == first.rows
    (tmp_path / "stability" / "off_000.json").unlink()
    with pytest.raises(pytest.fail.Exception, match="ran again"):
        stability.check(kept)


def test_noise_is_band_limited():
    noise = stability.BandLimited(2000, 0.005, np.random.default_rng(0))
    values = np.array([noise() for _ in range(600)])[300:]
    assert values.min() >= 0.0 and values.max() <= 1.0
    steps = np.abs(np.diff(values, axis=0)).mean()
    assert 0.2 < values.mean() < 0.3 and steps < 0.03


def test_convergence(small, monkeypatch):
    assert not missed(convergence.check(small), "least ratio of errors when the step is halved")
    monkeypatch.setattr(convergence, "rollout", lambda subject, step, _: np.full(7, step**0.25))
    assert missed(convergence.check(small), "least ratio of errors when the step is halved")
    monkeypatch.setattr(convergence, "rollout", lambda subject, step, _: np.full(7, step**2))
    assert missed(convergence.check(small), "largest ratio of errors when the step is halved")


def test_quiet(small, monkeypatch):
    monkeypatch.setattr(quiet, "SECONDS", 3.0)
    still = "hanging", "largest joint speed"
    assert verdicts(quiet.check(small))[still] == "pass"
    monkeypatch.setattr(quiet, "SECONDS", 0.5)
    bent = changed(small, q_range=small.body.q_range + 0.2)
    assert verdicts(quiet.check(bent))[still] == "miss"
    broken = changed(small, joint_damping=np.full(small.body.dof_count, -30.0))
    assert verdicts(quiet.check(broken))[still] == "miss"


def test_pinned_root_stays(small):
    simulator = quiet.pinned(small.body).simulator(0.005)
    before = simulator.qpos[:7].copy()
    for _ in range(100):
        simulator.step(np.zeros(small.body.muscle_count))
    assert simulator.qpos[:7] == pytest.approx(before, abs=1e-5)
    assert np.abs(simulator.model.dof_armature[:6]).min() > 1.0 and small.model.dof_armature[:6].max() < 1.0


def test_missing_references_are_told(tmp_path):
    with pytest.raises(UserError, match="published values is missing"):
        references.read(tmp_path, "strength")


def test_command_refuses_unknown_checks(capsys):
    given = ["--variant", "zhou2021", "--body", "none", "--out", "none", "--only", "spelling"]
    assert cli.run(command.main, given) == 2
    told = capsys.readouterr().err
    assert "spelling" in told and all(name in told for name in CHECKS)


def test_command_writes_rows_and_report(small, tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(Subject, "load", classmethod(lambda *_: small))
    given = ["--variant", "zhou2021", "--body", "none", "--tables", str(TABLES), "--out", str(tmp_path)]
    assert cli.run(command.main, [*given, "--only", "mass", "attachments", "--json"]) == 0
    printed = json.loads(capsys.readouterr().out)
    rows = json.loads((tmp_path / "rows.json").read_text())
    assert [judge(row) for row in rows] == printed and len(rows) > 5
    assert set(json.loads((tmp_path / "report.json").read_text())) == {"mass", "attachments"}
    assert (tmp_path / "run_card.json").is_file()
