"""Anatomy tables: what the CSV files in ``config/body`` hold, row by row.

Every number is given in the assembly frame: x forward, y left, z up, metres, the floor at z = 0,
the body standing in its neutral posture. Names that end in ``_r`` have a twin on the left.
"""

from __future__ import annotations

import csv
import math
from dataclasses import dataclass, fields
from pathlib import Path

from anthro.errors import UserError

QUALITIES = ("measured", "transferred", "estimated")


@dataclass(frozen=True)
class Bone:
    """One bone: parent, surface, joint centre, mass in kg, centre of mass, radii of gyration in m."""

    bone: str
    parent: str
    mesh: str
    origin_x_m: float
    origin_y_m: float
    origin_z_m: float
    mass_kg: float
    com_x_m: float
    com_y_m: float
    com_z_m: float
    gyration_x_m: float
    gyration_y_m: float
    gyration_z_m: float
    segment: str
    quality: str
    source: str

    origin = property(lambda self: (self.origin_x_m, self.origin_y_m, self.origin_z_m))
    com = property(lambda self: (self.com_x_m, self.com_y_m, self.com_z_m))
    gyration = property(lambda self: (self.gyration_x_m, self.gyration_y_m, self.gyration_z_m))


@dataclass(frozen=True)
class Joint:
    """One hinge through its bone's joint centre; degrees, N m/rad about neutral, N m s/rad."""

    joint: str
    bone: str
    axis_x: float
    axis_y: float
    axis_z: float
    min_deg: float
    max_deg: float
    rest_deg: float
    stiffness_Nm_rad: float
    damping_Nms_rad: float
    quality: str
    source: str

    axis = property(lambda self: (self.axis_x, self.axis_y, self.axis_z))


@dataclass(frozen=True)
class Muscle:
    """One fascicle: side R (has a left twin) or M (midline), area in cm^2, fiber length in m."""

    muscle: str
    anatomical_name: str
    group: str
    side: str
    pcsa_cm2: float
    optimal_fiber_length_m: float
    quality: str
    source: str


@dataclass(frozen=True)
class PathPoint:
    """One element of a muscle's path: a point on a bone, or a wrap with an optional side point."""

    muscle: str
    order: int
    kind: str
    bone: str
    x_m: float | None
    y_m: float | None
    z_m: float | None
    wrap: str
    side_x_m: float | None
    side_y_m: float | None
    side_z_m: float | None
    quality: str
    source: str

    point = property(lambda self: (self.x_m, self.y_m, self.z_m))
    side_point = property(lambda self: (self.side_x_m, self.side_y_m, self.side_z_m))


@dataclass(frozen=True)
class Wrap:
    """A sphere, or a cylinder with its axis and half length, that paths run around."""

    wrap: str
    bone: str
    kind: str
    x_m: float
    y_m: float
    z_m: float
    axis_x: float | None
    axis_y: float | None
    axis_z: float | None
    radius_m: float
    half_length_m: float | None
    quality: str
    source: str

    point = property(lambda self: (self.x_m, self.y_m, self.z_m))
    axis = property(lambda self: (self.axis_x, self.axis_y, self.axis_z))


@dataclass(frozen=True)
class Ligament:
    """A passive band between two bones at rest in neutral: strut (both ways) or cord (pulls only)."""

    ligament: str
    side: str
    bone_a: str
    ax_m: float
    ay_m: float
    az_m: float
    bone_b: str
    bx_m: float
    by_m: float
    bz_m: float
    kind: str
    stiffness_N_m: float
    damping_Ns_m: float
    quality: str
    source: str

    ends = property(
        lambda self: (
            (self.bone_a, (self.ax_m, self.ay_m, self.az_m)),
            (self.bone_b, (self.bx_m, self.by_m, self.bz_m)),
        )
    )


@dataclass(frozen=True)
class Contact:
    """A sphere that may touch the surfaces named: ``ground``, ``seat`` or both."""

    contact: str
    side: str
    bone: str
    x_m: float
    y_m: float
    z_m: float
    radius_m: float
    surfaces: str
    quality: str
    source: str

    point = property(lambda self: (self.x_m, self.y_m, self.z_m))


@dataclass(frozen=True)
class Effector:
    """A point of a bone that a controller moves; its frame is parallel to the world in the neutral posture."""

    effector: str
    side: str
    bone: str
    x_m: float
    y_m: float
    z_m: float
    quality: str
    source: str

    point = property(lambda self: (self.x_m, self.y_m, self.z_m))


@dataclass(frozen=True)
class Absent:
    """A fascicle that a variant lacks, and why."""

    muscle: str
    reason: str


_CHOICES = {
    "quality": QUALITIES,
    "side": ("R", "M"),
    ("PathPoint", "kind"): ("origin", "via", "insertion", "wrap"),
    ("Wrap", "kind"): ("sphere", "cylinder"),
    ("Ligament", "kind"): ("strut", "cord"),
    "surfaces": ("ground", "seat", "ground seat"),
}


def read_table(path: Path, row_type: type) -> list:
    """Read one CSV into ``row_type`` records, numbers converted, names unique.

    The first column is the name; rows of a path are told apart by ``muscle`` and ``order``.

    Raises
    ------
    UserError
        Missing file, wrong columns or cells, a number that is none, an unknown word where only
        some are meant, or a name that stands twice.
    """
    if not path.is_file():
        raise UserError(f"{path}: anatomy table is missing")
    names = [f.name for f in fields(row_type)]
    with path.open(newline="") as stream:
        reader = csv.DictReader(stream)
        if reader.fieldnames != names:
            raise UserError(f"{path}: columns are {reader.fieldnames}, expected {names}")
        rows = [_row(path, line, row_type, raw) for line, raw in enumerate(reader, start=2)]
    seen, twice = set(), []
    for row in rows:
        key = (row.muscle, row.order) if row_type is PathPoint else getattr(row, names[0])
        if key in seen:
            twice.append(key if isinstance(key, str) else f"{key[0]} {key[1]}")
        seen.add(key)
    if twice:
        raise UserError(f"{path}: {names[0]} {', '.join(sorted(twice))} stands more than once")
    return rows


def _row(path: Path, line: int, row_type: type, raw: dict):
    if None in raw or None in raw.values():
        raise UserError(f"{path}:{line}: not as many cells as columns")
    values = {}
    for field in fields(row_type):
        text, where = raw[field.name], f"{path}:{line}: {field.name}"
        if field.type == "str":
            known = _CHOICES.get(field.name, _CHOICES.get((row_type.__name__, field.name)))
            if known and text not in known:
                raise UserError(f"{where} is {text!r}, none of {', '.join(known)}")
            values[field.name] = text
        elif field.type == "float | None" and not text:
            values[field.name] = None
        else:
            number = _number(text)
            if not math.isfinite(number) or (field.type == "int" and number != int(number)):
                raise UserError(f"{where} is not a number: {text!r}")
            values[field.name] = int(number) if field.type == "int" else number
    return row_type(**values)


def _number(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        return math.nan
