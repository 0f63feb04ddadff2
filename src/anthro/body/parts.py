"""Regions of anatomy and the bodies composed of them: a body is a list of parts, not a script."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from anthro.body.tables import (
    Absent,
    Bone,
    Contact,
    Effector,
    Joint,
    Ligament,
    Muscle,
    PathPoint,
    Wrap,
    read_table,
)
from anthro.errors import UserError

REGIONS = ("core", "neck", "arm", "leg")


@dataclass(frozen=True)
class Part:
    """One region's tables, as authored (``sides`` R) or completed by :func:`both_sides`."""

    name: str
    bones: tuple[Bone, ...]
    joints: tuple[Joint, ...]
    muscles: tuple[Muscle, ...]
    paths: dict[str, tuple[PathPoint, ...]]
    wraps: tuple[Wrap, ...]
    ligaments: tuple[Ligament, ...]
    contacts: tuple[Contact, ...]


@dataclass(frozen=True)
class BodyPlan:
    """What a body is made of.

    Attributes
    ----------
    regions : its regions in order, each parent before its child.
    moving : regions whose joints are free; the others' bones are welded.
    muscular : regions whose muscles are there.
    sides : "both", or the one side that it has besides the midline: "right" or "left".
    absent : table of right fascicles, below ``config/body``, that this body lacks.
    root_free : the pelvis floats; otherwise it is fixed at ``root_height_m``.
    rest_deg : rest angles of joints other than their table's, right side's name.
    fibers_of : body whose fitted fibers it has, so that a controller moves it as it moves that one; None fits its own.
    """

    name: str
    regions: tuple[str, ...]
    moving: tuple[str, ...]
    muscular: tuple[str, ...]
    sides: str = "both"
    absent: str | None = None
    root_free: bool = False
    root_height_m: float | None = None
    rest_deg: dict[str, float] = field(default_factory=dict)
    fibers_of: str | None = "zhou2021"

    both_sides = property(lambda self: self.sides == "both")


# Seated: thighs level, shanks upright, so the hips stand as high as the knees do in standing.
SEATED = {"hip_flexion_r": 85.0, "knee_flexion_r": 85.0, "patella_flexion_r": 55.0}
SEATED_ROOT = {"root_height_m": 0.50, "rest_deg": SEATED}


def _limb(name: str, region: str, **details) -> BodyPlan:
    """One region that moves on a core whose bones are welded together: what a limb's controller is trained on."""
    return BodyPlan(name, ("core", region), (region,), (region,), **details)


BODIES = {
    plan.name: plan
    for plan in (
        BodyPlan("zhou2021", REGIONS, REGIONS, REGIONS, root_free=True, fibers_of=None),
        BodyPlan("whole_fixed", REGIONS, REGIONS, REGIONS, rest_deg=SEATED),
        BodyPlan(
            "nakada2018",
            REGIONS,
            ("neck", "arm", "leg"),
            ("neck", "arm", "leg"),
            absent="neck/absent_nakada2018.csv",
            **SEATED_ROOT,
        ),
        _limb("neck", "neck"),
        _limb("neck_seated", "neck", absent="neck/absent_nakada2018.csv", **SEATED_ROOT),
        *(_limb(f"{side}_arm", "arm", sides=side) for side in ("right", "left")),
        *(_limb(f"{side}_leg", "leg", sides=side, **SEATED_ROOT) for side in ("right", "left")),
    )
}


def body_plan(name: str) -> BodyPlan:
    """The named body's plan; UserError lists the known ones."""
    if name not in BODIES:
        raise UserError(f"unknown body {name!r}: known are {', '.join(sorted(BODIES))}")
    return BODIES[name]


def load_part(name: str, tables: Path) -> Part:
    """Read one region's tables from ``tables/<name>``.

    Raises
    ------
    UserError
        A table is missing or wrong, a muscle has no path, or a path no muscle.
    """
    folder = Path(tables) / name
    muscles = tuple(read_table(folder / "muscles.csv", Muscle))
    return Part(
        name=name,
        bones=tuple(read_table(folder / "bones.csv", Bone)),
        joints=tuple(read_table(folder / "joints.csv", Joint)),
        muscles=muscles,
        paths=_paths(folder / "paths.csv", muscles),
        wraps=_optional(folder / "wraps.csv", Wrap),
        ligaments=_optional(folder / "ligaments.csv", Ligament),
        contacts=_optional(folder / "contacts.csv", Contact),
    )


def load_parts(plan: BodyPlan, tables: Path) -> list[Part]:
    """The regions of a body in order, with the sides that it has."""
    parts = [load_part(region, tables) for region in plan.regions]
    if plan.sides == "right":
        return parts
    return [part if plan.both_sides else left_alone(part) for part in map(both_sides, parts)]


def load_effectors(plan: BodyPlan, tables: Path) -> list[Effector]:
    """The effectors of all bodies, with the sides that this one has."""
    rows = read_table(Path(tables) / "effectors.csv", Effector)
    if plan.sides != "right":
        rows = [row for row in _twinned(tuple(rows), _left_point_of) if plan.both_sides or not is_paired(row.effector)]
    return rows


def absent_muscles(plan: BodyPlan, tables: Path) -> set[str]:
    """Fascicles that the plan's body lacks, with their left twins where it has those."""
    if plan.absent is None:
        return set()
    absent = {row.muscle for row in read_table(Path(tables) / plan.absent, Absent)}
    return absent if plan.sides == "right" else absent | {left_name(name) for name in absent}


def _optional(path: Path, row_type: type) -> tuple:
    return tuple(read_table(path, row_type)) if path.exists() else ()


def _paths(path: Path, muscles: tuple[Muscle, ...]) -> dict[str, tuple[PathPoint, ...]]:
    paths = {muscle.muscle: [] for muscle in muscles}
    for row in read_table(path, PathPoint):
        if row.muscle not in paths:
            raise UserError(f"{path}: {row.muscle} is no muscle of this region")
        paths[row.muscle].append(row)
    for name, rows in paths.items():
        rows.sort(key=lambda row: row.order)
        kinds = [row.kind for row in rows]
        inner = {"via", "wrap"}
        if kinds[:1] != ["origin"] or kinds[-1:] != ["insertion"] or not set(kinds[1:-1]) <= inner:
            raise UserError(f"{path}: {name} does not run from one origin to one insertion")
        for row in rows:
            if not (row.wrap if row.kind == "wrap" else row.bone and None not in row.point):
                raise UserError(f"{path}: {name} {row.order}: {row.kind} lacks its cells")
    return {name: tuple(rows) for name, rows in paths.items()}


def left_name(name: str) -> str:
    """The left twin's name; midline names stay."""
    return name[:-2] + "_l" if name.endswith("_r") else name


def twin_name(name: str) -> str:
    """The name on the other side; midline names stay."""
    return name[:-2] + "_r" if name.endswith("_l") else left_name(name)


def twins(names: Sequence[str]) -> np.ndarray:
    """Index of each name's twin; itself where the twin is missing."""
    place = {name: i for i, name in enumerate(names)}
    return np.array([place.get(twin_name(name), i) for i, name in enumerate(names)], int)


def is_paired(name: str) -> bool:
    """Whether a bone, joint, muscle or wrap of this name has a left twin."""
    return name.endswith("_r")


def both_sides(part: Part) -> Part:
    """The region with the left twin after every right row: y mirrored, equal angles mirror motions."""
    return replace(
        part,
        bones=_twinned(part.bones, _left_bone),
        joints=_twinned(part.joints, _left_joint),
        muscles=_twinned(part.muscles, lambda row: replace(row, muscle=left_name(row.muscle))),
        paths=part.paths
        | {left_name(n): tuple(map(_left_point, rows)) for n, rows in part.paths.items() if is_paired(n)},
        wraps=_twinned(part.wraps, _left_wrap),
        ligaments=_twinned(part.ligaments, _left_ligament),
        contacts=_twinned(part.contacts, _left_contact),
    )


def left_alone(part: Part) -> Part:
    """Both sides' region without what the right side has."""
    kept = {
        name: tuple(row for row in getattr(part, name) if not is_paired(next(iter(vars(row).values()))))
        for name in ("bones", "joints", "muscles", "wraps", "ligaments", "contacts")
    }
    paths = {name: rows for name, rows in part.paths.items() if not is_paired(name)}
    return replace(part, **kept, paths=paths)


def _twinned(rows: tuple, mirror) -> tuple:
    out = []
    for row in rows:
        out.append(row)
        if is_paired(next(iter(vars(row).values()))):
            out.append(mirror(row))
    return tuple(out)


def _left_bone(row: Bone) -> Bone:
    return replace(
        row,
        bone=left_name(row.bone),
        parent=left_name(row.parent),
        origin_y_m=-row.origin_y_m,
        com_y_m=-row.com_y_m,
    )


def _left_joint(row: Joint) -> Joint:
    return replace(
        row,
        joint=left_name(row.joint),
        bone=left_name(row.bone),
        axis_x=-row.axis_x,
        axis_z=-row.axis_z,
    )


def _left_point(row: PathPoint) -> PathPoint:
    return replace(
        row,
        muscle=left_name(row.muscle),
        bone=left_name(row.bone),
        y_m=_minus(row.y_m),
        wrap=left_name(row.wrap),
        side_y_m=_minus(row.side_y_m),
    )


def _left_wrap(row: Wrap) -> Wrap:
    return replace(row, wrap=left_name(row.wrap), bone=left_name(row.bone), y_m=-row.y_m, axis_y=_minus(row.axis_y))


def _left_ligament(row: Ligament) -> Ligament:
    return replace(
        row,
        ligament=left_name(row.ligament),
        bone_a=left_name(row.bone_a),
        ay_m=-row.ay_m,
        bone_b=left_name(row.bone_b),
        by_m=-row.by_m,
    )


def _left_contact(row: Contact) -> Contact:
    return replace(row, contact=left_name(row.contact), bone=left_name(row.bone), y_m=-row.y_m)


def _left_point_of(row: Effector) -> Effector:
    return replace(row, effector=left_name(row.effector), bone=left_name(row.bone), y_m=-row.y_m)


def _minus(value: float | None) -> float | None:
    return None if value is None else -value
