"""Muscles act as textbooks say: the sign of a group's torque, statement by statement."""

from __future__ import annotations

import re

import numpy as np

from anthro.body.checks import references
from anthro.body.checks.motions import hinges
from anthro.body.checks.outcome import Outcome
from anthro.body.checks.subject import Subject

LEAST = 80  # statements to evaluate
NEGLIGIBLE = 1e-6  # m: a mean moment arm below it has no sign
LOWER_NECK = "lower joints"  # a statement's note that means C2-C3 to C7-T1
RIBS = re.compile(r"rib(\d+)_[rl]")


def check(subject: Subject) -> Outcome:
    """Count the published statements that hold in the neutral posture, and list those that do not."""
    out = Outcome(subject.plan.name, "signs")
    table, left_out = statements(subject)
    false = [row for row in table if not row["holds"]]
    if subject.plan.name == "zhou2021":
        out.add("statements evaluated", len(table), "1", LEAST, "min", "textbooks")
    else:
        out.add("statements evaluated", len(table), "1", source="textbooks")
    out.add("statements that do not hold", len(false), "1", 0, "equal", "textbooks")
    out.details = {"false": false, "not_evaluated": left_out, "table": table}
    return out


def statements(subject: Subject) -> tuple[list[dict], list[dict]]:
    """Statements with our moment arms, and those that cannot be evaluated with the reason."""
    arms = subject.moment_arms(np.zeros(subject.body.dof_count))
    table, left_out = [], []
    for row in references.read(subject.tables, "statements"):
        told = {key: row[key] for key in ("number", "muscle", "joint", "motion")}
        muscles = fascicles(subject, row)
        if not muscles:
            left_out.append(told | {"reason": "no such muscle in this body"})
            continue
        if row["joint"] == "ribN":
            arm = rib_arm(subject, arms, muscles, row["motion"], rib_numbers(row["note"]))
        else:
            joint = "neck_lower" if LOWER_NECK in row["note"] else row["joint"]
            pairs = [hit for part in _together(joint, row["motion"]) for hit in hinges(subject, *part)]
            arm = mean_arm(subject, arms, muscles, pairs) if pairs else None
        if arm is None:
            left_out.append(told | {"reason": "no hinge of this body stands for the motion"})
        else:
            holds = abs(arm) > NEGLIGIBLE and (arm > 0.0) == bool(row["positive"])
            table.append(told | {"moment_arm_m": arm, "fascicles": len(muscles), "holds": holds})
    return table, left_out


def _together(joint: str, motion: str) -> list[tuple[str, str]]:
    """A shoulder girdle's motion as anatomy means it: raised and lowered, the scapula stays upright on the thorax."""
    keep_upright = {"elevation": "downward_rotation", "depression": "upward_rotation"}
    if joint == "sternoclavicular" and motion in keep_upright:
        return [(joint, motion), ("acromioclavicular", keep_upright[motion])]
    return [(joint, motion)]


def mean_arm(subject: Subject, arms: np.ndarray, muscles: list[int], pairs) -> float:
    """Strength-weighted moment arm of a group, m, all hinges turning equally."""
    force = subject.body.max_force[muscles]
    whole = sum(sense * arms[muscles, dof] for dof, sense in pairs)
    return float(force @ whole / force.sum())


def rib_arm(subject: Subject, arms, muscles: list[int], motion: str, numbers: range | None) -> float | None:
    """The same on the ribs of each path, equal turns of pump and bucket; positive in the named motion."""
    force, total, used = subject.body.max_force, 0.0, 0.0
    for i in muscles:
        ribs = sorted({int(hit[1]) for bone in subject.path_bones[i] if (hit := RIBS.fullmatch(bone))})
        dofs = [
            subject.dof[name]
            for rib in ribs
            if numbers is None or rib in numbers
            for kind in ("pump", "bucket")
            if (name := f"rib{rib}_{kind}_r") in subject.dof
        ]
        if dofs:
            total += force[i] * arms[i, dofs].sum()
            used += force[i]
    if not used:
        return None
    return float(total / used) * (1.0 if motion == "raise" else -1.0)


def rib_numbers(note: str) -> range | None:
    """The ribs that a note names, ``N = 2 to 5`` or ``N = 1``; None for all."""
    found = re.search(r"N = (\d+)(?: to (\d+))?", note)
    return range(int(found[1]), int(found[2] or found[1]) + 1) if found else None


def fascicles(subject: Subject, row: dict) -> list[int]:
    """The fascicles that a statement is about, as its note restricts them."""
    muscles, note = subject.muscles_of(row["muscle"]), row["note"]
    bones = subject.path_bones

    def has(i: int, wanted) -> bool:
        return any(wanted(bone) for bone in (bones[i][0], bones[i][-1]))

    def level(bone: str) -> int:
        return int(bone[1:]) if re.fullmatch(r"T\d+", bone) else 0

    if "ending on the clavicle and acromion" in note:
        return [i for i in muscles if has(i, lambda bone: bone in ("clavicle_r", "scapula_r"))]
    if "from T6 and below" in note:
        return [i for i in muscles if has(i, lambda bone: level(bone) >= 6)]
    if "from ribs 5-9" in note:
        return [i for i in muscles if has(i, lambda bone: bone in {f"rib{k}_r" for k in range(5, 10)})]
    if "interosseous part" in note:
        return [i for i in muscles if "interchondral" not in subject.muscle_rows[i].anatomical_name]
    if row["joint"] == "ribN" and rib_numbers(note) is not None:
        wanted = {f"rib{k}_r" for k in rib_numbers(note)}
        return [i for i in muscles if has(i, lambda bone: bone in wanted)]
    return muscles
