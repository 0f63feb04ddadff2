"""Joints and motions in words, as signed hinges of the right side or the midline.

The sense of a motion is an axis in the assembly frame, standing with the arms hanging and the thumbs forward; a hinge
carries the motion if its axis points along or against it, so names and signs of hinges need not be trusted.
"""

from __future__ import annotations

import re

import numpy as np

from anthro.body.checks.subject import Subject

X, Y, Z = np.eye(3)
LIMBS = {  # joint: the bone that it moves, and motions of the right side
    "shoulder": ("humerus_r", {"flexion": -Y, "abduction": -X, "internal_rotation": Z}),
    "elbow": ("ulna_r", {"flexion": -Y}),
    "forearm": ("radius_r", {"pronation": Z}),
    "wrist": ("lunate_r", {"flexion": X, "radial_deviation": -Y}),
    "hip": ("femur_r", {"flexion": -Y, "abduction": -X, "internal_rotation": Z}),
    "knee": ("tibia_r", {"flexion": Y}),
    "ankle": ("talus_r", {"dorsiflexion": -Y}),
    "subtalar": ("calcaneus_r", {"inversion": X}),
    "toes": ("proximal_phalanx_foot_1_r", {"flexion": Y}),
    "sternoclavicular": ("clavicle_r", {"protraction": Z, "elevation": -X, "posterior_rotation": -Y}),
    "acromioclavicular": ("scapula_r", {"internal_rotation": Z, "upward_rotation": -X, "posterior_tilt": -Y}),
}
SPINE = {"flexion": Y, "lateral_same": X, "axial_same": -Z}  # same: to the right
OPPOSITE = {
    "extension": "flexion",
    "adduction": "abduction",
    "external_rotation": "internal_rotation",
    "supination": "pronation",
    "ulnar_deviation": "radial_deviation",
    "plantarflexion": "dorsiflexion",
    "eversion": "inversion",
    "retraction": "protraction",
    "depression": "elevation",
    "anterior_rotation": "posterior_rotation",
    "downward_rotation": "upward_rotation",
    "anterior_tilt": "posterior_tilt",
    "lateral_opposite": "lateral_same",
    "axial_opposite": "axial_same",
}
TOTALS = {
    "neck_total": ["C7", "C6", "C5", "C4", "C3", "C2", "C1", "cranium"],
    "neck_lower": ["C7", "C6", "C5", "C4", "C3", "C2"],
    "thoracic_total": [f"T{k}" for k in range(12, 0, -1)],
    "lumbar_total": [f"L{k}" for k in range(5, 0, -1)],
}
ALONG = 0.5  # least cosine between a hinge's axis and the motion's


def hinges(subject: Subject, joint: str, motion: str) -> list[tuple[int, float]]:
    """Hinges of a motion and their senses (+1 or -1), lowest first; empty where the body has none.

    ``joint`` is one of `LIMBS`, one of `TOTALS`, or a level of the spine such as ``C0-C1`` or ``L5-S1``; ``motion`` as
    in the tables of references.
    """
    if motion in OPPOSITE:
        return [(dof, -sense) for dof, sense in hinges(subject, joint, OPPOSITE[motion])]
    bones, axes = _place(joint)
    if motion not in axes:
        return []
    found = (_along(subject, bone, axes[motion]) for bone in bones)
    return [hit for hit in found if hit]


def reach(subject: Subject, pairs: list[tuple[int, float]]) -> float:
    """How far the hinges go in a motion together, rad."""
    ranges = subject.body.q_range
    return float(sum(ranges[dof, 1] if sense > 0 else -ranges[dof, 0] for dof, sense in pairs))


def posture(subject: Subject, angles: dict) -> np.ndarray:
    """Angles (m,) rad of a posture given as {(joint, motion): degrees}, else neutral, within the ranges."""
    q = np.zeros(subject.body.dof_count)
    for (joint, motion), degrees in angles.items():
        for dof, sense in hinges(subject, joint, motion):
            q[dof] = sense * np.deg2rad(degrees)
    return np.clip(q, *subject.body.q_range.T)


def _place(joint: str) -> tuple[list[str], dict]:
    if joint in LIMBS:
        bone, axes = LIMBS[joint]
        return [bone], axes
    if joint in TOTALS:
        return TOTALS[joint], SPINE
    level = re.fullmatch(r"([CTL]\d+)-([CTLS]\d+)", joint)
    return (["cranium" if level[1] == "C0" else level[1]], SPINE) if level else ([], {})


def _along(subject: Subject, bone: str, axis: np.ndarray) -> tuple[int, float] | None:
    dofs = [i for i, moved in enumerate(subject.bone_of_dof) if moved == bone]
    cosine = {i: float(subject.axes[i] @ axis) for i in dofs}
    best = max(cosine, key=lambda i: abs(cosine[i]), default=None)
    if best is None or abs(cosine[best]) < ALONG:
        return None
    return best, float(np.sign(cosine[best]))
