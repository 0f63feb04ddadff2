"""How far the joints go, next to published ranges of motion."""

from __future__ import annotations

import numpy as np

from anthro.body.checks import references
from anthro.body.checks.motions import hinges, reach
from anthro.body.checks.outcome import Outcome, factor_to_band
from anthro.body.checks.subject import Subject

ALLOWED = 1.25  # factor outside the published band
JOINTS = {"glenohumeral": "shoulder", "first_metatarsophalangeal": "toes"}
WORDS = {"lateral_bending": "lateral_same", "axial_rotation": "axial_same"}
BOTH_WAYS = {
    "flexion_extension": ("flexion", "extension"),
    "internal_external_rotation": ("internal_rotation", "external_rotation"),
    "anterior_posterior_tilt": ("anterior_tilt", "posterior_tilt"),
}
SHOULDER = {  # the arm on the trunk: glenohumeral, scapula on clavicle, clavicle on sternum
    "flexion": (("shoulder", "flexion"), ("acromioclavicular", "upward_rotation"), ("sternoclavicular", "elevation")),
    "abduction": (
        ("shoulder", "abduction"),
        ("acromioclavicular", "upward_rotation"),
        ("sternoclavicular", "elevation"),
    ),
    "extension": (("shoulder", "extension"), ("acromioclavicular", "anterior_tilt")),
    "internal_rotation": (("shoulder", "internal_rotation"), ("acromioclavicular", "internal_rotation")),
    "external_rotation": (("shoulder", "external_rotation"), ("acromioclavicular", "external_rotation")),
}
RIBS = {"pump_handle": "pump", "bucket_handle": "bucket"}


def check(subject: Subject) -> Outcome:
    """Ours and the published angle of every joint and motion that both have."""
    out = Outcome(subject.plan.name, "range_of_motion")
    table, left_out = compare(subject)
    levels = [row for row in table if row["representative"]]
    if levels:
        ratios = [row["ratio"] for row in levels]
        off = [row["factor"] for row in levels]
        out.add("levels of the spine", len(levels), source="White & Panjabi 1990")
        out.add("median ratio to the representative angle", np.median(ratios), source="White & Panjabi 1990")
        out.add("largest factor to it", max(off), source="White & Panjabi 1990")
        limits = [row for row in table if "-" in row["joint"] and not row["representative"]]
        outside = sum(row["factor"] > 1.0 for row in limits)
        out.add("levels and motions outside the published limits", outside, source="White & Panjabi 1990")
    for row in table:
        if not row["representative"] and not row["joint"].startswith("rib") and "-" not in row["joint"]:
            part = f"{row['joint'].replace('_', ' ')} {row['motion'].replace('_', ' ')}"
            out.add("angle", row["ours_deg"], "deg", source=row["source"][:80], part=part)
            out.add("factor to the published band", row["factor"], "1", ALLOWED, "max", row["source"][:80], part)
    out.details = {"table": table, "not_compared": left_out}
    return out


def compare(subject: Subject) -> tuple[list[dict], list[dict]]:
    """Rows with both angles, and published rows that no hinges of ours stand for."""
    table, left_out = [], []
    for row in merged(references.read(subject.tables, "range_of_motion")):
        angle = ours(subject, row["joint_group"], row["motion"])
        if angle is None:
            left_out.append({"joint": row["joint_group"], "motion": row["motion"]})
            continue
        degrees, low, high = np.rad2deg(angle), row["low_deg"], row["high_deg"]
        table.append(
            {
                "joint": row["joint_group"],
                "motion": row["motion"],
                "ours_deg": float(degrees),
                "low_deg": low,
                "high_deg": high,
                "ratio": float(degrees / (0.5 * (low + high))),
                "factor": float(factor_to_band(degrees, low, high)),
                "representative": row["motion"].endswith("_representative"),
                "source": row["source"],
                "verified": row["verified"],
            }
        )
    return table, left_out


def merged(rows: list[dict]) -> list[dict]:
    """The skull's nodding on C1 and C1's on C2, one hinge of ours, as one level C0-C2; else unchanged."""
    out = []
    pairs = {row["motion"]: row for row in rows if row["joint_group"] == "C1-C2"}
    for row in rows:
        joined = row["motion"].startswith(("flexion_extension_total_r", "lateral_bending_one_side_r"))
        if joined and row["joint_group"] in ("C0-C1", "C1-C2"):
            if row["joint_group"] == "C0-C1":
                other = pairs[row["motion"]]
                sums = {key: row[key] + other[key] for key in ("low_deg", "high_deg")}
                out.append(row | sums | {"joint_group": "C0-C2"})
        else:
            out.append(row)
    return out


def ours(subject: Subject, joint: str, motion: str) -> float | None:
    """Our angle in rad of a published joint and motion; None where it is not an angle that we have."""
    if joint.startswith("rib"):
        return _rib(subject, joint, motion)
    motion = motion.removesuffix("_representative")
    one_side, both = motion.removesuffix("_one_side"), motion.removesuffix("_total")
    joint = JOINTS.get(joint, joint)
    joint = "C0-C1" if joint == "C0-C2" else joint
    if joint == "shoulder_total":
        parts = SHOULDER.get(motion, ())
    elif both in BOTH_WAYS:
        parts = [(joint, way) for way in BOTH_WAYS[both]]
    else:
        parts = [(joint, WORDS.get(one_side, motion))]
    pairs = [hinges(subject, *part) for part in parts]
    if not pairs or not all(pairs):
        return None
    return sum(reach(subject, part) for part in pairs)


def _rib(subject: Subject, joint: str, motion: str) -> float | None:
    kind = next((name for word, name in RIBS.items() if motion.startswith(word)), None)
    dof = subject.dof.get(f"{joint}_{kind}_r")
    return None if dof is None else float(subject.body.q_range[dof, 1])
