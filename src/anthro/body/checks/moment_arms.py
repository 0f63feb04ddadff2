"""Moment arms of muscle groups next to published ones.

A group's moment arm is the strength-weighted mean over the fascicles that cross the joint. Arms of the neck are, as the
published ones, about its lowest level, C7-T1; groups that do not cross it are not compared.
"""

from __future__ import annotations

import re

import numpy as np

from anthro.body.checks import references
from anthro.body.checks.motions import hinges, posture
from anthro.body.checks.outcome import Outcome, factor
from anthro.body.checks.subject import Subject

ALLOWED = 1.5  # median factor to the published values of a joint
QUADRICEPS = "quadriceps (recfem, vasint, vaslat, vasmed)"
ALIASES = {"patellar tendon": QUADRICEPS}
ANGLE_OF = {  # the motion in which a table's angle is positive, where it is not flexion
    "ankle": "plantarflexion",
    "forearm": "pronation",
}
BENT_ELBOW = {("elbow", "flexion"): 90.0}
CROSSED = 1e-6  # m: a fascicle with a smaller arm does not cross the joint
KNEE_RANGE = np.arange(0.0, 91.0, 10.0)  # degrees, for rows without an angle


def check(subject: Subject) -> Outcome:
    """Ratio of ours to every published moment arm, and the median factor of each joint."""
    out = Outcome(subject.plan.name, "moment_arms")
    table, left_out = compare(subject)
    for part in sorted({_region(row["joint"]) for row in table}):
        rows = [row for row in table if _region(row["joint"]) == part]
        off = np.array([row["factor"] for row in rows])
        out.add("median factor to the published", np.median(off), "1", ALLOWED, "max", "references", part)
        out.add("share within a factor of 1.5", np.mean(off <= ALLOWED), source="references", part=part)
        wrong = sum(row["ratio"] <= 0.0 for row in rows)
        out.add("groups of the other sign", wrong, "1", 0, "equal", "references", part)
    out.details = {"table": table, "not_compared": left_out}
    return out


def compare(subject: Subject) -> tuple[list[dict], list[dict]]:
    """One row for each published value with ours, and the rows that this body cannot answer."""
    table, left_out = [], []
    for row in references.read(subject.tables, "moment_arms"):
        told = {key: row[key] for key in ("muscle_group", "joint", "motion", "angle_deg", "source", "verified")}
        muscles = subject.muscles_of(ALIASES.get(row["muscle_group"], row["muscle_group"]))
        pairs = hinges(subject, row["joint"], row["motion"])
        arm = moment_arm(subject, muscles, row, pairs) if muscles and pairs else np.nan
        if np.isnan(arm):
            left_out.append(told)
            continue
        ratio = arm / row["moment_arm_m"]
        table.append(
            told
            | {
                "published_m": row["moment_arm_m"],
                "ours_m": arm,
                "ratio": ratio,
                "factor": factor(arm, row["moment_arm_m"]),
                "fascicles": len(muscles),
            }
        )
    return table, left_out


def moment_arm(subject: Subject, muscles: list[int], row: dict, pairs) -> float:
    """Strength-weighted mean moment arm of a group in m, positive in the row's motion.

    Without an angle it is the least, the largest or the mean over the knee's range, as the row's source says.
    """
    force = subject.body.max_force[muscles]
    dof, sense = pairs[0]

    def at(angle: float) -> float:
        arms = sense * subject.moment_arms(_posture(subject, row, angle))[muscles, dof]
        across = np.abs(arms) > CROSSED
        return float(force[across] @ arms[across] / force[across].sum()) if across.any() else np.nan

    if row["angle_deg"] is not None:
        return at(row["angle_deg"])
    over = [at(angle) for angle in KNEE_RANGE]
    kind = row["source"].partition(" ")[0]
    return float({"lowest": np.min, "highest": np.max}.get(kind, np.mean)(over))


def _posture(subject: Subject, row: dict, angle: float) -> np.ndarray:
    joint = row["joint"]
    sideways = row["motion"] in ("abduction", "adduction")
    moved = "abduction" if sideways else ANGLE_OF.get(joint, "flexion")
    return posture(subject, {(joint, moved): angle} | (BENT_ELBOW if joint == "forearm" else {}))


def _region(joint: str) -> str:
    return "lumbar" if re.match(r"L\d", joint) else joint.removesuffix("_total")
