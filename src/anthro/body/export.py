"""Write a body as an MJCF file that plain MuJoCo loads: ``python -m anthro.body.export --variant zhou2021 --out DIR``.

Geometry, masses, joints and ligaments are the same numbers. MuJoCo's own muscle stands in for the papers' Hill muscle:

* activation is direct: the control is the activation, without dynamics (``dyntype none``);
* active force over length: the papers' line through 0 at 0.3 and 1 at 1.0 optimal fiber lengths becomes MuJoCo's
  S-curve between the same two points (0.13 of the greatest force off at most), and stays within 2 % of flat beyond,
  where the papers' line goes on rising;
* over velocity: the papers' line 1 + v / 8 becomes (1 + v / 16)^2, of the same slope at rest (0.25 off at most);
* passive force: the papers' 0.8 (exp(6 e) - 1) becomes a parabola that runs into a line (0.09 off at most up to a
  strain of 0.2, softer beyond); the damper beside it is left out;
* joint limits are MuJoCo's constraints instead of springs, contacts too.
"""

from __future__ import annotations

import argparse
import shutil
import sys
import tempfile
import xml.etree.ElementTree as ElementTree
from pathlib import Path

import mujoco
import numpy as np
import trimesh

from anthro import cli
from anthro.body.build import assemble, build
from anthro.body.builder import Builder
from anthro.body.inventory import take, write_csv
from anthro.body.model import Body
from anthro.body.parts import body_plan
from anthro.errors import UserError
from anthro.files import atomic
from anthro.runcard import RunCard

STEP = 0.002
FIBER_RANGE = (0.5, 1.6)  # of the optimal length; fixes MuJoCo's unit of length, does not clip
ACTIVE = {"lmin": 0.3, "lmax": 10.0, "vmax": 16.0, "fpmax": 1.0, "fvmax": 1.0}
PASSIVE = {"lmin": 0.3, "lmax": 1.1285, "vmax": 16.0, "fpmax": 0.677, "fvmax": 1.0}
LIMIT_TIME = 0.01  # s, time constant of the joint limits
MUSCLE_COLOUR, LIGAMENT_COLOUR = (0.70, 0.20, 0.18, 1.0), (0.85, 0.82, 0.70, 1.0)
MUSCLE_WIDTH, LIGAMENT_WIDTH = 0.002, 0.001
# What of each kind of element is a number that the body was built from, by MJCF's and MjSpec's name.
NUMBERS = {
    "body": {"pos": "pos"},
    "joint": {name: name for name in ("axis", "range", "stiffness", "damping")},
    "geom": {name: name for name in ("pos", "size", "quat")},
    "site": {"pos": "pos"},
    "spatial": {name: name for name in ("springlength", "stiffness", "damping")},
    "general": {name: name for name in ("lengthrange", "gainprm", "biasprm")},
}
LOOKUP = {"spatial": "tendon", "general": "actuator"}
INERTIAL = {"pos": "ipos", "mass": "mass", "diaginertia": "inertia"}

SCENE = """<mujoco model="{name} scene">
  <include file="{name}.xml"/>
  <statistic center="0 0 0.9" extent="1.8"/>
  <visual>
    <headlight diffuse="0.5 0.5 0.5" ambient="0.3 0.3 0.3" specular="0 0 0"/>
  </visual>
  <asset>
    <texture name="floor" type="2d" builtin="checker" rgb1="0.8 0.8 0.8" rgb2="0.7 0.7 0.7" width="256" height="256"/>
    <material name="floor" texture="floor" texrepeat="20 20" reflectance="0"/>
  </asset>
  <worldbody>
    <light name="sun" pos="1 -2 4" dir="-0.2 0.4 -0.9" type="directional" diffuse="0.6 0.6 0.6"/>
    <geom name="floor" type="plane" size="10 10 0.1" material="floor" contype="1" conaffinity="0" condim="3"
      friction="0.8 0.005 0.0001"/>
  </worldbody>
</mujoco>
"""

README = """# {name}

A muscle-driven human body by Anthro: {bones} bones, {dof} hinges{root}, {muscles} muscles, {ligaments} ligaments,
{mass:.1f} kg.

```python
import mujoco
data = mujoco.MjData(model := mujoco.MjModel.from_xml_path("{name}.xml"))
mujoco.mj_step(model, data, 100)  # 0.2 s; data.ctrl holds the activations, 0 to 1
```

`{name}.xml` is the body alone, `scene.xml` the body on a floor, which its contact spheres meet (hidden group 3). Zero
angles are the neutral posture (key `neutral`); frames are x forward, y left, z up, in m, kg, s, N. `inventory.csv`
lists bones, joints and muscles, each with quality and source.

Geometry, masses, joints and ligaments are those of Anthro. Forces differ, as MuJoCo's own elements stand in:

{approximations}
Made with MuJoCo {mujoco}. Licence: `LICENSE`; sources and their conditions: `NOTICE`.
"""


def export(body: Body, builder: Builder, tables: Path, out: Path) -> mujoco.MjModel:
    """Write ``builder``'s body, with the lengths and strengths of ``body``, to the folder ``out``.

    Parameters
    ----------
    body : the built body.
    builder : what composed the same body; its MjSpec is turned into that of plain MuJoCo.
    tables : the anatomy tables that both came from.

    Returns
    -------
    The exported model, loaded from its file.

    Raises
    ------
    UserError
        ``body`` and ``builder`` are not of the same tables, or licence files are not there.
    """
    spec, out = builder.spec, Path(out)
    names = tuple(muscle.muscle for muscle in builder.muscles)
    if names != body.muscle_names or not np.allclose(_sizes(spec.compile()), _sizes(body.model)):
        raise UserError(f"{body.name}: not built from {tables} as they are; build the body again")
    inventory, legal = take(body, tables), _legal_files()
    _options(spec)
    _meshes(spec, out / "assets")
    _contacts(builder)
    _tendons(spec, body)
    _muscles(spec, body)
    _keys(spec, body)
    _write(out / f"{body.name}.xml", exact_xml(spec))
    _write(out / "scene.xml", SCENE.format(name=body.name))
    model = mujoco.MjModel.from_xml_path(str(out / f"{body.name}.xml"))
    _write(out / "README.md", _readme(body, model))
    write_csv(inventory, out / "inventory.csv")
    for path in legal:
        shutil.copyfile(path, out / path.name)
    return model


def _sizes(model) -> np.ndarray:
    return np.r_[model.nbody, model.nv, model.ntendon, model.body_mass.sum(), model.tendon_length0.sum()]


def _legal_files() -> list[Path]:
    paths = [Path(__file__).parents[3] / name for name in ("LICENSE", "NOTICE")]
    for path in paths:
        if not path.is_file():
            raise UserError(f"{path}: missing; export from a source tree of Anthro")
    return paths


def _options(spec) -> None:
    spec.option.disableflags = 0
    spec.option.timestep = STEP
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    for joint in spec.joints:
        if joint.type == mujoco.mjtJoint.mjJNT_HINGE:
            joint.solref_limit = (LIMIT_TIME, 1.0)


def _meshes(spec, folder: Path) -> None:
    """Write each bone's surface as STL and refer to the file instead of holding the vertices."""
    folder.mkdir(parents=True, exist_ok=True)
    spec.modelfiledir, spec.meshdir = str(folder.parent), folder.name
    for mesh in spec.meshes:
        vertices, faces = (np.reshape(values, (-1, 3)) for values in (mesh.uservert, mesh.userface))
        content = trimesh.Trimesh(vertices, faces, process=False).export(file_type="stl")
        with atomic(folder / f"{mesh.name}.stl") as path:
            path.write_bytes(content)
        mesh.uservert, mesh.userface, mesh.file = [], [], f"{mesh.name}.stl"


def _contacts(builder: Builder) -> None:
    """A small sphere at each contact point; they meet the floor, not each other."""
    for row in builder.contacts:
        site = builder.spec.site(f"contact_{row.contact}")
        site.parent.add_geom(
            name=site.name,
            type=mujoco.mjtGeom.mjGEOM_SPHERE,
            size=(row.radius_m, 0.0, 0.0),
            pos=site.pos,
            contype=0,
            conaffinity=1,
            condim=3,
            mass=0.0,
            group=3,
        )


def _tendons(spec, body: Body) -> None:
    for names, colour, width in (
        (body.muscle_names, MUSCLE_COLOUR, MUSCLE_WIDTH),
        (body.ligament_names, LIGAMENT_COLOUR, LIGAMENT_WIDTH),
    ):
        for name in names:
            tendon = spec.tendon(name)
            tendon.rgba, tendon.width = colour, width


def _muscles(spec, body: Body) -> None:
    """One actuator for each muscle's tendon: its length range is that of the fiber plus the tendon's length."""
    for i, name in enumerate(body.muscle_names):
        actuator = spec.add_actuator(
            name=name,
            trntype=mujoco.mjtTrn.mjTRN_TENDON,
            target=name,
            dyntype=mujoco.mjtDyn.mjDYN_NONE,
            gaintype=mujoco.mjtGain.mjGAIN_MUSCLE,
            biastype=mujoco.mjtBias.mjBIAS_MUSCLE,
            ctrllimited=mujoco.mjtLimited.mjLIMITED_TRUE,
            ctrlrange=(0.0, 1.0),
            lengthrange=body.tendon_length[i] + body.slack_length[i] * np.array(FIBER_RANGE),
        )
        actuator.gainprm[:9] = muscle_parameters(body.max_force[i], ACTIVE)
        actuator.biasprm[:9] = muscle_parameters(body.max_force[i], PASSIVE)


def muscle_parameters(max_force: float, shape: dict) -> np.ndarray:
    """MuJoCo's nine numbers of a muscle: range, force, scale, lmin, lmax, vmax, fpmax, fvmax."""
    return np.array([*FIBER_RANGE, max_force, 1.0, *(shape[key] for key in ("lmin", "lmax", "vmax", "fpmax", "fvmax"))])


def _keys(spec, body: Body) -> None:
    root = body.model.qpos0[: body.model.nq - body.dof_count]
    spec.add_key(name="neutral", qpos=np.r_[root, np.zeros(body.dof_count)])
    spec.add_key(name="rest", qpos=np.r_[root, body.q_rest])


def exact_xml(spec) -> str:
    """The spec as MJCF with twelve digits of what the body was built from (MuJoCo's writer keeps six)."""
    root = ElementTree.fromstring(spec.to_xml())
    for tag, numbers in NUMBERS.items():
        for element in root.iter(tag):
            if "name" in element.attrib:
                item = getattr(spec, LOOKUP.get(tag, tag))(element.get("name"))
                _refine(element, item, numbers)
                if tag == "body":
                    _refine(element.find("inertial"), item, INERTIAL)
    return ElementTree.tostring(root, encoding="unicode") + "\n"


def _refine(element, item, numbers: dict[str, str]) -> None:
    for attribute, field in numbers.items():
        if written := element.get(attribute):
            values = np.atleast_1d(getattr(item, field))[: len(written.split())]
            element.set(attribute, " ".join(f"{value:.12g}" for value in values))


def _readme(body: Body, model: mujoco.MjModel) -> str:
    approximations = __doc__[__doc__.index("* ") :]
    return README.format(
        name=body.name,
        bones=model.nbody - 1,
        dof=body.dof_count,
        root=" and a free pelvis" if body.root_free else "",
        muscles=body.muscle_count,
        ligaments=body.ligament_count,
        mass=model.body_mass.sum(),
        approximations=approximations,
        mujoco=mujoco.__version__,
    )


def _write(path: Path, text: str) -> None:
    with atomic(path) as temporary:
        temporary.write_text(text, encoding="utf-8")


def main(argv=None) -> int:
    """Export a body that is built already, or build it first."""
    parser = argparse.ArgumentParser(prog="anthro.body.export", description=__doc__.partition("\n")[0])
    parser.add_argument("--variant", required=True, help="body to export: zhou2021, nakada2018 or right_arm")
    parser.add_argument("--body", type=Path, help="folder of the built body (default: build it now)")
    parser.add_argument("--tables", type=Path, default=Path("config/body"), help="anatomy tables")
    parser.add_argument("--seed", type=int, default=1, help="seed of the postures that a new build samples")
    parser.add_argument("--out", type=Path, required=True, help="folder to write")
    args = parser.parse_args(argv)
    name = body_plan(args.variant).name
    if not args.tables.is_dir():
        raise UserError(f"{args.tables}: no such folder of anatomy tables")
    with RunCard(args.out / "run_card.json", {"export": name}, args.seed), tempfile.TemporaryDirectory() as scratch:
        if args.body is None:
            build(name, args.tables, Path(scratch) / name, args.seed)
        body = Body.load(args.body or Path(scratch) / name)
        if body.name != name:
            raise UserError(f"{args.body}: is {body.name}, not {name}")
        model = export(body, assemble(name, args.tables)[0], args.tables, args.out)
    print(f"{args.out}: {model.nbody - 1} bones, {body.dof_count} hinges, {model.nu} muscles")
    return 0


if __name__ == "__main__":
    sys.exit(cli.run(main))
