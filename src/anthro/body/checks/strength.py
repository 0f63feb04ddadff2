"""Isometric strength of joints: the largest active torque that the muscles can give, next to published ones.

A linear program chooses activations between 0 and 1. Forces are those of the active element at the posture's fiber
lengths. As on a dynamometer, other joints are braced: their torques are free. What is not free:

* a limb's joint with several axes: no net torque about its other axes (hip, shoulder, wrist);
* neck and trunk: torque about the lowest level (C7-T1, L5-S1), none about that level's other axes, and at each level
  above no torque against the motion.

Left and right muscles take part alike.
"""

from __future__ import annotations

import numpy as np
from scipy.optimize import linprog

from anthro.body import hill
from anthro.body.checks import references
from anthro.body.checks.motions import LIMBS, TOTALS, hinges, posture
from anthro.body.checks.outcome import Outcome, factor
from anthro.body.checks.subject import Subject

ALLOWED = 1.5
SEATED = {("hip", "flexion"): 85.0, ("knee", "flexion"): 85.0}
BENT_ELBOW = {("elbow", "flexion"): 90.0}
POSTURES = {  # what the table's postures mean, degrees; others are neutral
    ("shoulder", "45 deg flexion, seated"): {("shoulder", "flexion"): 45.0},
    ("shoulder", "arm at 30-45 deg abduction"): {("shoulder", "abduction"): 37.5},
    ("shoulder", "neutral, elbow 90"): BENT_ELBOW,
    ("elbow", "90 deg, supinated"): BENT_ELBOW | {("forearm", "supination"): 80.0},
    ("elbow", "90 deg"): BENT_ELBOW,
    ("forearm", "neutral forearm, elbow 90"): BENT_ELBOW,
    ("hip", "45-60 deg flexion"): {("hip", "flexion"): 52.5, ("knee", "flexion"): 52.5},
    ("hip", "neutral to 45 deg flexion"): {("hip", "flexion"): 22.5, ("knee", "flexion"): 22.5},
    ("hip", "neutral to 10 deg abduction"): {("hip", "abduction"): 5.0},
    ("hip", "hip 90 deg, seated"): {("hip", "flexion"): 90.0, ("knee", "flexion"): 90.0},
    ("knee", "mid-range (about 60 deg)"): SEATED | {("knee", "flexion"): 60.0},
    ("knee", "mid-range"): SEATED | {("knee", "flexion"): 60.0},
    ("knee", "extended"): SEATED | {("knee", "flexion"): 15.0},
    ("knee", "flexed"): SEATED | {("knee", "flexion"): 90.0},
    ("knee", "80 deg flexion"): SEATED | {("knee", "flexion"): 80.0},
    ("ankle", "neutral, knee near straight"): {("knee", "flexion"): 10.0},
    ("ankle", "10 deg plantarflexion"): {("ankle", "plantarflexion"): 10.0},
}


def check(subject: Subject) -> Outcome:
    """Torque and factor to the published one; the scorecard takes each motion's first row of the table."""
    out = Outcome(subject.plan.name, "strength")
    table, left_out, seen = [], [], set()
    for row in references.read(subject.tables, "strength"):
        told = {key: row[key] for key in ("joint", "motion", "posture", "source", "verified")}
        torque = strongest(subject, row["joint"], row["motion"], row["posture"])
        if torque is None:
            left_out.append(told)
            continue
        off = factor(torque, row["torque_Nm"])
        table.append(told | {"published_Nm": row["torque_Nm"], "ours_Nm": torque, "factor": off})
        if (row["joint"], row["motion"]) not in seen:
            seen.add((row["joint"], row["motion"]))
            part = f"{row['joint'].removesuffix('_total')} {row['motion'].replace('_', ' ')}"
            out.add("torque", torque, "N m", source=row["source"][:80], part=part)
            out.add("factor to the published", off, "1", ALLOWED, "max", row["source"][:80], part)
    if table:
        out.add("share within a factor of 1.5", np.mean([row["factor"] <= ALLOWED for row in table]))
    out.details = {"table": table, "not_compared": left_out}
    return out


def strongest(subject: Subject, joint: str, motion: str, text: str) -> float | None:
    """Largest torque in N m in a motion of a joint at a posture in the table's words; None without its hinges."""
    pairs = hinges(subject, joint, motion)
    if not pairs:
        return None
    q = posture(subject, POSTURES.get((joint, text), {}))
    torque = torques(subject, q)
    (lowest, sense), above = pairs[0], pairs[1:]
    held = [dof for dof in _axes(subject, joint) if dof != lowest]
    limits = {}
    if held:
        limits |= {"A_eq": torque[:, held].T, "b_eq": np.zeros(len(held))}
    if above:
        against = -np.array([s * torque[:, dof] for dof, s in above])
        limits |= {"A_ub": against, "b_ub": np.zeros(len(above))}
    found = linprog(-sense * torque[:, lowest], bounds=(0.0, 1.0), method="highs", **limits)
    return float(-found.fun) if found.success else 0.0


def torques(subject: Subject, q: np.ndarray) -> np.ndarray:
    """Torques (n, m) N m of each fully active muscle alone, without its passive part."""
    body = subject.body
    arms = subject.moment_arms(q)
    q, _ = subject.settle_patella(q)
    length = subject.at(q)[0][: body.muscle_count]
    strain = hill.strain(length - body.tendon_length, body.slack_length)
    return arms * hill.active_force(strain, np.zeros_like(strain), body.max_force)[:, None]


def _axes(subject: Subject, joint: str) -> list[int]:
    """Hinges of a joint, or of a region's lowest level."""
    bone = TOTALS[joint][0] if joint in TOTALS else LIMBS[joint][0]
    return [dof for dof, moved in enumerate(subject.bone_of_dof) if moved == bone]
