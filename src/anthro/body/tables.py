"""Anatomy tables: bones, joints and muscles as authored in ``config/body/<part>/*.csv``."""

from __future__ import annotations

import csv
import math
from dataclasses import dataclass, fields
from pathlib import Path

from anthro.errors import UserError


@dataclass(frozen=True)
class Bone:
    """One bone: its place in the tree, the source body it is copied from, and its mass in kg."""

    bone: str
    parent: str
    source_body: str
    mass_kg: float
    quality: str
    source: str


@dataclass(frozen=True)
class Joint:
    """One hinge degree of freedom in its bone's frame; angles in degrees, damping in N m s/rad."""

    joint: str
    bone: str
    kind: str
    axis_x: float
    axis_y: float
    axis_z: float
    min_deg: float
    max_deg: float
    rest_deg: float
    damping_Nms_rad: float
    quality: str
    source: str

    @property
    def axis(self) -> tuple[float, float, float]:
        return (self.axis_x, self.axis_y, self.axis_z)


@dataclass(frozen=True)
class Muscle:
    """One muscle: path taken from the source's tendon, force in N, optimal fiber length in m."""

    muscle: str
    anatomical_name: str
    group: str
    source_tendon: str
    max_force_N: float
    optimal_fiber_length_m: float
    quality: str
    source: str


def read_table(path: Path, row_type: type) -> list:
    """Read one CSV into ``row_type`` records, numbers converted, first column unique.

    Raises
    ------
    UserError
        Missing file, wrong columns or cells, a number that is none, or a name that stands twice.
    """
    if not path.is_file():
        raise UserError(f"{path}: anatomy table is missing")
    names = [f.name for f in fields(row_type)]
    with path.open(newline="") as stream:
        reader = csv.DictReader(stream)
        if reader.fieldnames != names:
            raise UserError(f"{path}: columns are {reader.fieldnames}, expected {names}")
        rows = [_row(path, line, row_type, raw) for line, raw in enumerate(reader, start=2)]
    keys = [getattr(row, names[0]) for row in rows]
    twice = sorted({key for key in keys if keys.count(key) > 1})
    if twice:
        raise UserError(f"{path}: {names[0]} {', '.join(twice)} stands more than once")
    return rows


def _row(path: Path, line: int, row_type: type, raw: dict):
    if None in raw or None in raw.values():
        raise UserError(f"{path}:{line}: not as many cells as columns")
    values = {}
    for field in fields(row_type):
        text = raw[field.name]
        if field.type == "float":
            values[field.name] = _number(text)
            if not math.isfinite(values[field.name]):
                raise UserError(f"{path}:{line}: {field.name} is not a number: {text!r}")
        else:
            values[field.name] = text
    return row_type(**values)


def _number(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        return math.nan
