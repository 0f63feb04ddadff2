"""Mass, centre of mass and inertia of the segments against de Leva 1996, and no mass from nowhere."""

from __future__ import annotations

import numpy as np

from anthro.body.checks import references
from anthro.body.checks.outcome import Outcome, factor
from anthro.body.checks.subject import Subject

TOTAL = 75.0  # kg
SOURCE = "de Leva 1996"
SEGMENTS = {  # our segment: de Leva's row, its proximal and distal end
    "head": ("head_and_neck", "vertex", "cervicale"),
    "upper_trunk": ("upper_trunk", "suprasternale", "xiphion"),
    "middle_trunk": ("middle_trunk", "xiphion", "omphalion"),
    "lower_trunk": ("lower_trunk", "omphalion", "sacrum"),
    "upper_arm": ("upper_arm", "humerus_r", "ulna_r"),
    "forearm": ("forearm", "ulna_r", "lunate_r"),
    "hand": ("hand", "lunate_r", "proximal_phalanx_3_r"),
    "thigh": ("thigh", "femur_r", "tibia_r"),
    "shank": ("shank", "tibia_r", "talus_r"),
    "foot": ("foot", "heel", "toe_tip"),
}
# De Leva's levels of a male of 1.741 m, carried to our stature of 1.75 m; m above the floor.
LEVELS = {"vertex": 1.755, "cervicale": 1.503, "suprasternale": 1.466, "xiphion": 1.283, "omphalion": 1.055}
AXIAL = ("head", "upper_trunk", "middle_trunk", "lower_trunk")
FOOT_LENGTH = 0.2595  # m, 258.1 mm at 1.741 m
FOOT_HEIGHT = 0.03  # m, of the foot's long axis
X, Y, Z = np.eye(3)
# De Leva's sagittal and transverse axes, palms forward, where ours are not x and y: our palms face the thighs.
CROSS_AXES = {"hand": (Y, X), "forearm": (Y, X), "foot": (Z, Y)}


def check(subject: Subject) -> Outcome:
    """Whole mass within 1 %, each segment's within 15 %; nothing that no bone's row has."""
    out = Outcome(subject.plan.name, "mass")
    rows, built = list(subject.bones.values()), float(subject.model.body_mass.sum())
    phantom = built - sum(row.mass_kg for row in rows)
    out.add("phantom mass", abs(phantom), "kg", 1e-9, "max", "tables")
    out.details = {"total_kg": built, "phantom_kg": phantom, "segments": {}}
    if subject.plan.both_sides:
        out.add("distance of the whole from 75 kg", abs(built / TOTAL - 1.0), "1", 0.01, "max", SOURCE)
    published = {row["segment"]: row for row in references.read(subject.tables, "de_leva")}
    for segment, (name, near, far) in SEGMENTS.items():
        axial = segment in AXIAL
        bones = [row for row in rows if row.segment == segment and (axial or not row.bone.endswith("_l"))]
        ends = landmark(subject, near), landmark(subject, far)
        if not bones or ends[0] is None or ends[1] is None or (axial and not subject.plan.both_sides):
            continue
        found = compare(bones, published[name], *ends)
        out.details["segments"][segment] = found
        out.add("distance of the mass", abs(found["mass_ratio"] - 1.0), "1", 0.15, "max", SOURCE, segment)
    segments = out.details["segments"].values()
    if segments:
        out.add("largest distance of a centre of mass, of the length", max(s["com_off"] for s in segments))
        ratios = [r for s in segments for r in s["gyration_ratio"].values()]
        out.add("largest factor of a radius of gyration", max(factor(r, 1.0) for r in ratios))
    return out


def combine(bones: list) -> tuple[float, np.ndarray, np.ndarray]:
    """Mass (kg), centre of mass (3,) m and inertia about it (3, 3) kg m^2 of bones together."""
    masses = np.array([row.mass_kg for row in bones])
    points = np.array([row.com for row in bones])
    centre = masses @ points / masses.sum()
    inertia = np.zeros((3, 3))
    for mass, point, row in zip(masses, points, bones, strict=True):
        arm = point - centre
        inertia += mass * (np.diag(np.square(row.gyration)) + arm @ arm * np.eye(3) - np.outer(arm, arm))
    return float(masses.sum()), centre, inertia


def compare(bones: list, published: dict, start: np.ndarray, end: np.ndarray) -> dict:
    """Ratios of mass and radii of gyration, and the centre's distance along the segment over its length."""
    mass, centre, inertia = combine(bones)
    length = float(np.linalg.norm(end - start))
    along = (end - start) / length
    sagittal, transverse = CROSS_AXES.get(published["segment"], (X, Y))
    axes = {"longitudinal": along, "sagittal": sagittal, "transverse": transverse}
    gyration = {name: float(np.sqrt(np.dot(axis, inertia @ axis) / mass)) / length for name, axis in axes.items()}
    fraction = float((centre - start) @ along) / length
    return {
        "mass_kg": mass,
        "mass_ratio": mass / (published["mass_fraction"] * TOTAL),
        "length_m": length,
        "com_fraction": fraction,
        "com_off": abs(fraction - published["com_fraction"]),
        "gyration_ratio": {name: value / published[f"r_{name}"] for name, value in gyration.items()},
    }


def landmark(subject: Subject, name: str) -> np.ndarray | None:
    """A segment's end (3,) m: a level of the trunk, an end of the foot, or a bone's joint centre; None without it."""
    if name in LEVELS:
        return np.array([0.0, 0.0, LEVELS[name]])
    if name in ("heel", "toe_tip"):
        if "calcaneus_r" not in subject.bones:
            return None
        surface = subject.meshes.get(subject.bones["calcaneus_r"].mesh).vertices
        heel = np.array([surface[:, 0].min(), subject.bones["calcaneus_r"].origin_y_m, FOOT_HEIGHT])
        return heel if name == "heel" else heel + [FOOT_LENGTH, 0.0, 0.0]
    return np.array(subject.bones[name].origin) if name in subject.bones else None
