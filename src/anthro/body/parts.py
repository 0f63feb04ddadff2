"""The parts of which bodies are composed: a body is a list of parts, not a script."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from anthro.body.tables import Bone, Joint, Muscle, read_table
from anthro.errors import UserError


@dataclass(frozen=True)
class Part:
    """One region of anatomy.

    Attributes
    ----------
    name : table folder below ``config/body``.
    source_model : myo-sim model that bones, meshes and paths are copied from.
    """

    name: str
    source_model: str
    bones: tuple[Bone, ...]
    joints: tuple[Joint, ...]
    muscles: tuple[Muscle, ...]


@dataclass(frozen=True)
class BodyPlan:
    """A body: its parts in order, and the bone and point that count as its hand."""

    name: str
    parts: tuple[str, ...]
    hand_bone: str
    hand_point_m: tuple[float, float, float]


SOURCES = {"arm": "myoarm_r"}
# The hand's point: the head of the third metacarpal's shaft, in the middle of the palm.
BODIES = {
    "right_arm": BodyPlan("right_arm", ("arm",), "metacarpal_3", (0.0, 0.0, 0.0)),
}


def load_part(name: str, tables: Path) -> Part:
    """Read one part's three tables from ``tables/<name>``."""
    folder = Path(tables) / name
    return Part(
        name=name,
        source_model=SOURCES[name],
        bones=tuple(read_table(folder / "bones.csv", Bone)),
        joints=tuple(read_table(folder / "joints.csv", Joint)),
        muscles=tuple(read_table(folder / "muscles.csv", Muscle)),
    )


def body_plan(name: str) -> BodyPlan:
    """The named body's plan; UserError lists the known ones."""
    if name not in BODIES:
        raise UserError(f"unknown body {name!r}: known are {', '.join(sorted(BODIES))}")
    return BODIES[name]
