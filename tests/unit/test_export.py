"""The exported MJCF: the same body, in plain MuJoCo; the inventory beside it."""

import csv
import json
import subprocess
import sys
from pathlib import Path

import mujoco
import numpy as np
import pytest

from anthro import cli
from anthro.body import Body, hill, inventory
from anthro.body.build import build
from anthro.body.export import ACTIVE, PASSIVE, main, muscle_parameters

TABLES = Path(__file__).resolve().parents[2] / "config" / "body"

LOAD_AND_STEP = """
import json, sys
import mujoco, numpy as np
model = mujoco.MjModel.from_xml_path(sys.argv[1])
data = mujoco.MjData(model)
fastest = 0.0
while data.time < 2.0:
    mujoco.mj_step(model, data)
    fastest = max(fastest, float(np.abs(data.qvel[-model.nu:]).max()))
print(json.dumps({
    "bones": model.nbody - 1, "muscles": model.nu, "mass": float(model.body_mass.sum()),
    "hinges": int((model.jnt_type == mujoco.mjtJoint.mjJNT_HINGE).sum()),
    "finite": bool(np.isfinite(data.qpos).all()), "warnings": int(data.warning.number.sum()),
    "step": model.opt.timestep, "anthro": "anthro" in sys.modules, "fastest": fastest,
}))
"""


def alone(path):
    """What plain MuJoCo, without Anthro on the path, makes of a file: loaded, then 2 s without control."""
    call = [sys.executable, "-I", "-c", LOAD_AND_STEP, str(path)]
    done = subprocess.run(call, capture_output=True, text=True, timeout=120, cwd="/")
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


def assert_same_body(body, exported):
    """Masses, ranges and springs are the same; so are path lengths at random poses."""
    ours = body.model
    assert (ours.nbody, ours.nv, ours.ntendon) == (exported.nbody, exported.nv, exported.ntendon)
    for index in range(ours.nbody):
        assert ours.body(index).name == exported.body(index).name
    for field in ("body_mass", "body_inertia", "body_ipos", "body_pos", "jnt_range", "jnt_stiffness", "dof_damping"):
        np.testing.assert_allclose(getattr(exported, field), getattr(ours, field), atol=1e-9, err_msg=field)
    for field in ("tendon_stiffness", "tendon_damping", "tendon_lengthspring", "tendon_length0"):
        np.testing.assert_allclose(getattr(exported, field), getattr(ours, field), atol=1e-9, err_msg=field)
    rng, datas = np.random.default_rng(3), [(m, mujoco.MjData(m)) for m in (ours, exported)]
    for _ in range(50):
        angles = rng.uniform(*body.q_range.T)
        for model, data in datas:
            data.qpos[model.nq - body.dof_count :] = angles
            mujoco.mj_fwdPosition(model, data)
        np.testing.assert_allclose(datas[1][1].ten_length, datas[0][1].ten_length, atol=1e-6)
        np.testing.assert_allclose(datas[1][1].xipos, datas[0][1].xipos, atol=1e-6)


@pytest.fixture(scope="module")
def folder(arm_folder, tmp_path_factory):
    """Folder of the exported right arm."""
    out = tmp_path_factory.mktemp("export") / "arm"
    given = ["--variant", "right_arm", "--body", str(arm_folder), "--tables", str(TABLES), "--out", str(out)]
    assert main(given) == 0
    return out


def test_plain_mujoco_loads_and_steps_it(arm, folder):
    told = alone(folder / "right_arm.xml")
    assert told["bones"] == arm.model.nbody - 1
    assert (told["hinges"], told["muscles"], told["step"]) == (7, 29, 0.002)
    assert told["finite"] and told["warnings"] == 0 and not told["anthro"]


def test_it_is_the_same_body(arm, folder):
    assert_same_body(arm, mujoco.MjModel.from_xml_path(str(folder / "right_arm.xml")))


def test_bones_look_the_same(arm, folder):
    exported = mujoco.MjModel.from_xml_path(str(folder / "right_arm.xml"))
    for name in (arm.model.mesh(index).name for index in range(arm.model.nmesh)):
        mine, theirs = arm.model.geom(name).id, exported.geom(name).id
        np.testing.assert_allclose(exported.geom_pos[theirs], arm.model.geom_pos[mine], atol=1e-5)
        np.testing.assert_allclose(exported.geom_aabb[theirs], arm.model.geom_aabb[mine], atol=1e-4)


def test_muscles_carry_strength_and_fiber_lengths(arm, folder):
    exported = mujoco.MjModel.from_xml_path(str(folder / "right_arm.xml"))
    assert tuple(exported.actuator(i).name for i in range(exported.nu)) == arm.muscle_names
    np.testing.assert_allclose(exported.actuator_gainprm[:, 2], arm.max_force, rtol=1e-9)
    unit = np.ptp(exported.actuator_lengthrange, axis=1) / np.ptp(exported.actuator_gainprm[:, :2], axis=1)
    np.testing.assert_allclose(unit, arm.slack_length, rtol=1e-9)
    tendon = exported.actuator_lengthrange[:, 0] - exported.actuator_gainprm[:, 0] * unit
    np.testing.assert_allclose(tendon, arm.tendon_length, atol=1e-9)


def mujoco_force(activation, e, e_rate):
    """Force of a muscle of 1 N and 1 m as it is exported."""
    span = np.array([0.5, 1.6])
    gain = mujoco.mju_muscleGain(1.0 + e, e_rate, span, 1.0, muscle_parameters(1.0, ACTIVE))
    return -activation * gain - mujoco.mju_muscleBias(1.0 + e, span, 1.0, muscle_parameters(1.0, PASSIVE))


def test_muscle_is_as_near_to_the_papers_as_the_export_says():
    def off(activation, strains, rates):
        cases = [(activation, e, r) for e in strains for r in rates]
        papers = [activation * hill.active_force(e, r, 1.0) + hill.passive_force(e, 0.0, 1.0) for _, e, r in cases]
        return max(abs(mujoco_force(*case) - force) for case, force in zip(cases, papers, strict=True))

    assert off(1.0, np.linspace(-0.7, 0.0, 50), [0.0]) < 0.13
    assert off(1.0, [0.0], np.linspace(-8.0, 8.0, 50)) <= 0.25 + 1e-9
    assert off(0.0, np.linspace(-0.5, 0.2, 50), [0.0]) < 0.09
    assert mujoco_force(1.0, 0.0, 0.0) == pytest.approx(1.0)
    beyond = [mujoco_force(1.0, e, 0.0) - mujoco_force(0.0, e, 0.0) for e in np.linspace(0.0, 0.6, 20)]
    assert min(beyond) > 0.98


def test_scene_has_a_floor_that_spheres_meet(folder):
    scene = mujoco.MjModel.from_xml_path(str(folder / "scene.xml"))
    floor = scene.geom("floor")
    spheres = [i for i in range(scene.ngeom) if scene.geom(i).name.startswith("contact_")]
    assert floor.contype[0] and not floor.conaffinity[0]
    assert all(scene.geom_conaffinity[i] == 1 and scene.geom_contype[i] == 0 for i in spheres)


def test_papers_come_with_it(folder):
    assert {"LICENSE", "NOTICE", "README.md", "inventory.csv", "run_card.json"} <= {p.name for p in folder.iterdir()}
    text = (folder / "README.md").read_text()
    lines = text.split("```")[1].splitlines()[1:]
    assert len(lines) == 3
    snippet = "\n".join(lines)
    subprocess.run([sys.executable, "-I", "-c", snippet], cwd=folder, check=True, timeout=60)


def test_inventory_lists_everything_with_its_source(arm, folder):
    with (folder / "inventory.csv").open(newline="") as stream:
        rows = list(csv.DictReader(stream))
    kinds = [row["kind"] for row in rows]
    assert (kinds.count("bone"), kinds.count("joint"), kinds.count("muscle")) == (arm.model.nbody - 1, 7, 29)
    assert all(row["quality"] in ("measured", "transferred", "estimated") and row["source"] for row in rows)
    muscles = {row["name"]: row for row in rows if row["kind"] == "muscle"}
    for index, name in enumerate(arm.muscle_names):
        assert float(muscles[name]["max_force_N"]) == pytest.approx(arm.max_force[index])
        assert muscles[name]["origin"] and muscles[name]["insertion"]


def test_inventory_page_stands_alone(arm_folder, tmp_path, capsys):
    out = tmp_path / "inventory.html"
    assert inventory.main(["--body", str(arm_folder), "--tables", str(TABLES), "--out", str(out)]) == 0
    text = out.read_text()
    assert "29 muscles" in capsys.readouterr().out
    assert text.count("<table>") == 3 and "http" not in text and "src=" not in text
    assert "7 joints" in text and "29 muscles" in text


def test_other_tables_are_told(arm_folder, tmp_path, capsys):
    lines = (arm_folder / "muscles.csv").read_text().splitlines(keepends=True)
    other = tmp_path / "right_arm"
    other.mkdir()
    for name in ("model.mjb", "joints.csv", "ligaments.csv", "contacts.csv"):
        (other / name).write_bytes((arm_folder / name).read_bytes())
    (other / "muscles.csv").write_text("".join([lines[0], *lines[:0:-1]]))
    given = ["--variant", "right_arm", "--body", str(other), "--tables", str(TABLES), "--out", str(tmp_path / "out")]
    assert cli.run(main, given) == 2
    assert "build the body again" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("given", "told"),
    [
        (["--variant", "left_foot"], "unknown body"),
        (["--variant", "right_arm", "--tables", "nowhere"], "no such folder"),
        (["--variant", "right_arm", "--tables", str(TABLES), "--body", "nowhere"], "model.mjb"),
    ],
)
def test_bad_input_is_told(given, told, tmp_path, capsys):
    assert cli.run(main, [*given, "--out", str(tmp_path / "out")]) == 2
    assert told in capsys.readouterr().err


@pytest.mark.slow
def test_whole_body(tmp_path):
    build("zhou2021", TABLES, tmp_path / "zhou2021", seed=1)
    body, out = Body.load(tmp_path / "zhou2021"), tmp_path / "out"
    given = ["--variant", "zhou2021", "--body", str(tmp_path / "zhou2021"), "--tables", str(TABLES)]
    assert main([*given, "--out", str(out)]) == 0
    assert_same_body(body, mujoco.MjModel.from_xml_path(str(out / "zhou2021.xml")))
    for name in ("zhou2021.xml", "scene.xml"):
        told = alone(out / name)
        assert (told["bones"], told["hinges"], told["muscles"]) == (193, 163, 823)
        assert told["finite"] and told["warnings"] == 0 and told["fastest"] < 100.0
        assert told["mass"] == pytest.approx(75.0, abs=0.01)
