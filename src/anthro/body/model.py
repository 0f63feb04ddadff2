"""A built body on disk and in memory."""

from __future__ import annotations

import csv
from copy import copy
from dataclasses import dataclass, replace
from pathlib import Path

import mujoco
import numpy as np

from anthro.errors import UserError

ROOT_VELOCITIES = ("root_x", "root_y", "root_z", "root_roll", "root_pitch", "root_yaw")
SURFACES = ("ground", "seat")
EFFECTOR = "effector_"  # before the names of their sites


@dataclass(frozen=True)
class Contacts:
    """Spheres on the bones that meet what the body stands or sits on.

    Attributes
    ----------
    names : (k,) names.  sites : (k,) MuJoCo sites of the centres.  radius : (k,) m.
    surfaces : (k,) which of :data:`SURFACES` each of them can meet.
    """

    names: tuple[str, ...]
    sites: np.ndarray
    radius: np.ndarray
    surfaces: tuple[frozenset[str], ...]

    def __len__(self) -> int:
        return len(self.names)


@dataclass(frozen=True)
class Body:
    """A compiled body of m hinges, n muscles and k ligaments, its root fixed or free.

    Attributes
    ----------
    model : MuJoCo model; tendons are the muscles' paths, then the ligaments'. Hinges come in the order of
        ``dof_names``, behind the root joint of a body whose root is free.
    q_rest : (m,) rad.  q_range : (m, 2) rad.
    joint_stiffness : (m,) N m/rad, about angle 0.  joint_damping : (m,) N m s/rad.
    max_force : (n,) N.  slack_length, tendon_length : (n,) m.
    ligament_stiffness : (k,) N/m.  ligament_damping : (k,) N s/m.
    ligament_slack : (k, 2) m, the lengths between which a ligament is without force: twice its rest length for
        a strut, 0 and its rest length for a cord.
    contacts : spheres that meet ground or seat.
    effectors : MuJoCo site of each effector that this body has, by its name in the tables.
    """

    name: str
    model: mujoco.MjModel
    dof_names: tuple[str, ...]
    dof_regions: tuple[str, ...]
    q_rest: np.ndarray
    q_range: np.ndarray
    joint_stiffness: np.ndarray
    joint_damping: np.ndarray
    muscle_names: tuple[str, ...]
    muscle_regions: tuple[str, ...]
    muscle_groups: tuple[str, ...]
    max_force: np.ndarray
    slack_length: np.ndarray
    tendon_length: np.ndarray
    ligament_names: tuple[str, ...]
    ligament_stiffness: np.ndarray
    ligament_damping: np.ndarray
    ligament_slack: np.ndarray
    contacts: Contacts
    effectors: dict[str, int]
    root_free: bool

    dof_count = property(lambda self: len(self.dof_names))
    muscle_count = property(lambda self: len(self.muscle_names))
    ligament_count = property(lambda self: len(self.ligament_names))
    velocity_names = property(lambda self: ROOT_VELOCITIES * self.root_free + self.dof_names)

    @classmethod
    def load(cls, folder: Path) -> Body:
        """Load what ``anthro.body.build`` wrote.

        Raises
        ------
        UserError
            A file is missing, unreadable, or does not fit the others.
        """
        folder = Path(folder)
        try:
            model = mujoco.MjModel.from_binary_path(str(folder / "model.mjb"))
        except ValueError as error:
            line = str(error).strip().splitlines()[0]
            raise UserError(f"{folder / 'model.mjb'}: cannot be loaded ({line})") from None
        root_free = bool((model.jnt_type == mujoco.mjtJoint.mjJNT_FREE).any())
        joints = _columns(folder / "joints.csv", ("joint", "region"), ("min", "max", "rest", "stiffness", "damping"))
        muscles = _columns(
            folder / "muscles.csv", ("muscle", "region", "group"), ("max_force", "slack_length", "tendon_length")
        )
        ligaments = _columns(
            folder / "ligaments.csv", ("ligament",), ("stiffness", "damping", "slack_low", "slack_high")
        )
        hinges, tendons = len(joints["joint"]), len(muscles["muscle"]) + len(ligaments["ligament"])
        if hinges != model.nv - 6 * root_free or tendons != model.ntendon:
            raise UserError(f"{folder}: tables and model.mjb disagree; build the body again")
        return cls(
            name=folder.name,
            model=model,
            dof_names=tuple(joints["joint"]),
            dof_regions=tuple(joints["region"]),
            q_rest=joints["rest"],
            q_range=np.stack([joints["min"], joints["max"]], axis=1),
            joint_stiffness=joints["stiffness"],
            joint_damping=joints["damping"],
            muscle_names=tuple(muscles["muscle"]),
            muscle_regions=tuple(muscles["region"]),
            muscle_groups=tuple(muscles["group"]),
            max_force=muscles["max_force"],
            slack_length=muscles["slack_length"],
            tendon_length=muscles["tendon_length"],
            ligament_names=tuple(ligaments["ligament"]),
            ligament_stiffness=ligaments["stiffness"],
            ligament_damping=ligaments["damping"],
            ligament_slack=np.stack([ligaments["slack_low"], ligaments["slack_high"]], axis=1),
            contacts=_contacts(folder / "contacts.csv", model),
            effectors=_effectors(model),
            root_free=root_free,
        )

    def muscles_of(self, region: str) -> tuple[str, ...]:
        """Names of the muscles of one region of the tables: core, neck, arm or leg."""
        return tuple(n for n, its in zip(self.muscle_names, self.muscle_regions, strict=True) if its == region)

    def effector(self, name: str) -> int:
        """MuJoCo site of an effector; UserError where this body has none of that name."""
        if name not in self.effectors:
            raise UserError(f"{self.name} has no effector {name!r}; it has: {', '.join(self.effectors) or 'none'}")
        return self.effectors[name]

    def movable(self) -> Body:
        """The same body with a model of its own, whose fixed root may be placed elsewhere."""
        return replace(self, model=copy(self.model))

    def simulator(self, step: float | None = None, world=None):
        """A fresh :class:`~anthro.body.simulator.Simulator` at rest in ``world``, nothing around it when None."""
        from anthro.body.simulator import DEFAULT_STEP, Simulator

        return Simulator(self, DEFAULT_STEP if step is None else step, world)


def _effectors(model: mujoco.MjModel) -> dict[str, int]:
    names = [model.site(i).name for i in range(model.nsite)]
    return {name.removeprefix(EFFECTOR): i for i, name in enumerate(names) if name.startswith(EFFECTOR)}


def _contacts(path: Path, model: mujoco.MjModel) -> Contacts:
    table = _columns(path, ("contact", "surfaces"), ("radius",))
    sites = [mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_SITE, f"contact_{name}") for name in table["contact"]]
    surfaces = tuple(frozenset(text.split()) for text in table["surfaces"])
    for name, site, met in zip(table["contact"], sites, surfaces, strict=True):
        if site < 0:
            raise UserError(f"{path}: model.mjb has no site contact_{name}; build the body again")
        if not met or not met <= set(SURFACES):
            raise UserError(f"{path}: {name}: surfaces must be of {', '.join(SURFACES)}")
    return Contacts(tuple(table["contact"]), np.array(sites, int), table["radius"], surfaces)


def _columns(path: Path, names: tuple[str, ...], numbers: tuple[str, ...]) -> dict:
    """Columns of a table: lists of str for ``names``, arrays for ``numbers``."""
    if not path.is_file():
        raise UserError(f"{path}: missing; build the body first")
    with path.open(newline="") as stream:
        reader = csv.DictReader(stream)
        rows = list(reader)
    missing = [name for name in names + numbers if name not in (reader.fieldnames or ())]
    if missing:
        raise UserError(f"{path}: column {missing[0]} is missing")
    columns = {name: [row[name] for row in rows] for name in names}
    try:
        return columns | {name: np.array([float(row[name]) for row in rows]) for name in numbers}
    except (TypeError, ValueError) as error:
        raise UserError(f"{path}: {error}") from None
