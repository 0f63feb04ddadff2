"""The body under test: what was built, the tables it was built from, and postures of it."""

from __future__ import annotations

import re
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import mujoco
import numpy as np
from scipy.optimize import minimize_scalar

from anthro.body.meshes import MeshLibrary
from anthro.body.model import Body
from anthro.body.parts import BodyPlan, Part, absent_muscles, body_plan, load_parts
from anthro.errors import UserError
from anthro.streams import stream

PATELLA_PER_KNEE = 55.0 / 85.0  # where no ligament holds the patella: the slope of the seated posture
_SITE = int(mujoco.mjtWrap.mjWRAP_SITE)


@dataclass(frozen=True)
class Options:
    """How much to test.

    Attributes
    ----------
    seed : of all streams.  poses : random postures of the path check.  seconds, starts : of the stability check.
    jobs : processes.  folder : where a check may keep what it has done; None keeps nothing.
    """

    seed: int = 1
    poses: int = 20000
    seconds: float = 60.0
    starts: int = 20
    jobs: int = 1
    folder: Path | None = None


class Subject:
    """A body of m hinges and n muscles with its tables.

    Parameters
    ----------
    body : the built body.  plan : what it is made of.
    parts : its regions' tables, both sides where the plan has both.
    meshes : bone surfaces, ``get(cell)``.  tables : ``config/body``, for the references.
    """

    def __init__(self, body: Body, plan: BodyPlan, parts: list[Part], meshes, tables: Path, options: Options):
        self.body, self.plan, self.parts = body, plan, parts
        self.meshes, self.tables, self.options = meshes, Path(tables), options
        self.model = body.model
        self.data = mujoco.MjData(body.model)
        self._patellas: dict[float, float] = {}
        self._compare_names()

    def _compare_names(self) -> None:
        """UserError where the tables are not those that the body was built from."""
        body = self.body
        muscles = tuple(row.muscle for row in self.muscle_rows)
        ligaments = {row.ligament for part in self.parts for row in part.ligaments}
        odd = sorted(set(muscles) ^ set(body.muscle_names) | set(body.dof_names) ^ set(self.joints))
        odd += sorted(set(body.ligament_names) - ligaments)
        if odd or muscles != body.muscle_names:
            what = odd[0] if odd else "the muscles' order"
            raise UserError(f"{body.name}: tables and built body disagree in {what}; build the body again")

    @classmethod
    def load(cls, variant: str, folder: Path, tables: Path, options: Options) -> Subject:
        """The named variant as built in ``folder`` from ``tables``."""
        plan = body_plan(variant)
        parts = load_parts(plan, tables)
        return cls(Body.load(folder), plan, parts, MeshLibrary(tables), tables, options)

    @cached_property
    def muscle_rows(self) -> list:
        """Rows of the muscles that this body has, in the order of its tendons."""
        absent = absent_muscles(self.plan, self.tables)
        parts = [part for part in self.parts if part.name in self.plan.muscular]
        return [row for part in parts for row in part.muscles if row.muscle not in absent]

    @cached_property
    def bones(self) -> dict:
        """Rows of all bones by name."""
        return {row.bone: row for part in self.parts for row in part.bones}

    @cached_property
    def joints(self) -> dict:
        """Rows of the joints that are free, by name."""
        moving = [part for part in self.parts if part.name in self.plan.moving]
        return {row.joint: row for part in moving for row in part.joints}

    @cached_property
    def dof(self) -> dict[str, int]:
        """Index of each hinge by name."""
        return {name: i for i, name in enumerate(self.body.dof_names)}

    @cached_property
    def axes(self) -> np.ndarray:
        """Hinge axes (m, 3) in the world, neutral posture."""
        hinges = self.model.jnt_type == mujoco.mjtJoint.mjJNT_HINGE
        return self.model.jnt_axis[hinges]

    @cached_property
    def bone_of_dof(self) -> tuple[str, ...]:
        """The bone that each hinge moves."""
        hinges = np.flatnonzero(self.model.jnt_type == mujoco.mjtJoint.mjJNT_HINGE)
        return tuple(self.model.body(self.model.jnt_bodyid[j]).name for j in hinges)

    @cached_property
    def path_bones(self) -> list[list[str]]:
        """Bones of each muscle's path points, origin first."""
        model = self.model
        out = []
        for first, count in zip(model.tendon_adr, model.tendon_num, strict=True):
            sites = [model.wrap_objid[k] for k in range(first, first + count) if model.wrap_type[k] == _SITE]
            out.append([model.body(model.site_bodyid[site]).name for site in sites])
        return out[: self.body.muscle_count]

    def random(self, check: str, shard: int = 0) -> np.random.Generator:
        """The random stream of one check."""
        return stream(self.options.seed, f"body.check.{self.plan.name}.{check}", shard)

    def at(self, q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Path lengths (t,) m and their slopes dl/dq (t, m) of all tendons at angles (m,) rad."""
        place(self.model, self.data, q)
        tendon, dof, entry = self.slope_entries
        slopes = np.zeros((self.model.ntendon, len(q)))
        slopes[tendon, dof] = self.data.ten_J[entry]
        return self.data.ten_length.copy(), slopes

    @cached_property
    def slope_entries(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Tendon, hinge and place in ``ten_J`` of each slope."""
        model, first = self.model, self.model.nv - self.body.dof_count
        rows = zip(model.ten_J_rowadr, model.ten_J_rownnz, strict=True)
        entry = np.concatenate([np.arange(a, a + k) for a, k in rows] or [np.empty(0)]).astype(int)
        tendon, column = np.repeat(np.arange(model.ntendon), model.ten_J_rownnz), model.ten_J_colind[entry]
        hinge = column >= first
        return tendon[hinge], column[hinge] - first, entry[hinge]

    def moment_arms(self, q: np.ndarray) -> np.ndarray:
        """Moment arms (n, m) m of the muscles, the right patella following the knee.

        Torque at the patella reaches the knee through the patella's slope in the knee's angle.
        """
        q, slope = self.settle_patella(q)
        arms = -self.at(q)[1][: self.body.muscle_count]
        if self._knee:
            knee, patella = self._knee
            arms[:, knee] += slope * arms[:, patella]
            arms[:, patella] = 0.0
        return arms

    def settle_patella(self, q: np.ndarray) -> tuple[np.ndarray, float]:
        """Angles with the right patella where its ligaments hold it, and its slope in the knee's angle."""
        q = np.array(q, float)
        if not self._knee:
            return q, 0.0
        knee, patella = self._knee
        if not self._patellar:
            q[patella] = PATELLA_PER_KNEE * q[knee]
            return q, PATELLA_PER_KNEE

        step = np.deg2rad(0.5)
        below, here, above = (self._patella_at(float(q[knee]) + turn) for turn in (-step, 0.0, step))
        q[patella] = here
        return q, (above - below) / (2.0 * step)

    def _patella_at(self, knee_angle: float) -> float:
        """The patella's angle, rad, at which its ligaments are stretched least."""
        if knee_angle in self._patellas:
            return self._patellas[knee_angle]
        knee, patella = self._knee
        q, rest = np.zeros(self.body.dof_count), self.body.ligament_slack[self._patellar, 1]
        q[knee] = knee_angle

        def stretch(angle):
            q[patella] = angle
            return float(np.square(self.at(q)[0][self.body.muscle_count :][self._patellar] - rest).sum())

        bounds = tuple(self.body.q_range[patella])
        found = minimize_scalar(stretch, bounds=bounds, method="bounded", options={"xatol": 1e-7})
        self._patellas[knee_angle] = float(found.x)
        return self._patellas[knee_angle]

    @cached_property
    def _knee(self) -> tuple[int, int] | None:
        found = [[i for i, bone in enumerate(self.bone_of_dof) if bone == b] for b in ("tibia_r", "patella_r")]
        return (found[0][0], found[1][0]) if all(found) else None

    @cached_property
    def _patellar(self) -> list[int]:
        rows = {row.ligament: row for part in self.parts for row in part.ligaments}
        names = enumerate(self.body.ligament_names)
        return [i for i, name in names if {rows[name].bone_a, rows[name].bone_b} == {"patella_r", "tibia_r"}]

    def muscles_of(self, text: str) -> list[int]:
        """Indices of the right (or midline) fascicles that a reference means by ``text``.

        ``text`` is a group, a fascicle, the start of either, or several of them in parentheses; ``glmax1-3`` means
        glmax1, glmax2 and glmax3. Empty where the body has none.
        """
        found = self._named(text)
        if found or "(" not in text:
            return found
        items = text[text.index("(") + 1 : text.rindex(")")].split(",")
        return sorted({i for item in items for key in _spread(item.strip()) for i in self._named(key)})

    def _named(self, text: str) -> list[int]:
        key = _plain(text)
        names = [_plain(re.sub("_[rl]$", "", name)) for name in self.body.muscle_names]
        groups = [_plain(group) for group in self.body.muscle_groups]
        anatomical = [_plain(row.anatomical_name) for row in self.muscle_rows]
        right = [i for i, name in enumerate(self.body.muscle_names) if not name.endswith("_l")]
        rules = (
            lambda i: groups[i] == key or names[i] == key,
            lambda i: names[i].startswith(key + "_"),
            lambda i: groups[i].startswith(key) or names[i].startswith(key),
            lambda i: anatomical[i].startswith(key),
        )
        return next((hit for rule in rules if (hit := [i for i in right if rule(i)])), [])


def place(model: mujoco.MjModel, data: mujoco.MjData, q: np.ndarray) -> None:
    """Put ``data`` at hinge angles (m,) rad: ``ten_length``, and ``ten_J`` with `Subject.slope_entries`."""
    data.qpos[model.nq - len(q) :] = q
    mujoco.mj_kinematics(model, data)
    mujoco.mj_comPos(model, data)
    mujoco.mj_tendon(model, data)


def _plain(text: str) -> str:
    """Lower case, words joined by one underscore; one spelling of iliocostalis."""
    return re.sub("[^a-z0-9]+", "_", text.lower()).strip("_").replace("illio", "ilio")


def _spread(text: str) -> list[str]:
    found = re.fullmatch(r"(.*?)(\d)-(\d)", text)
    if not found:
        return [text]
    return [f"{found[1]}{k}" for k in range(int(found[2]), int(found[3]) + 1)]
