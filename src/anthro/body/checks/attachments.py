"""Muscles begin and end on the surface of their bones, unless on soft tissue that a bone carries."""

from __future__ import annotations

import numpy as np
import trimesh

from anthro.body.checks.outcome import Outcome
from anthro.body.checks.subject import Subject

MEDIAN, WORST = 0.005, 0.025  # m
CARRIED = "carried by"  # so a path's source says that a point is on a linea, sling or aponeurosis


def check(subject: Subject) -> Outcome:
    """Distances of all right and midline origins and insertions from their bones' surfaces."""
    out = Outcome(subject.plan.name, "attachments")
    found = distances(subject)
    table = [row for row in found if not row["carried"]]
    far = np.array([row["distance_m"] for row in table])
    if len(far):
        out.add("median distance from the bone", np.median(far), "m", MEDIAN, "max", "bone surfaces")
        out.add("largest distance from the bone", far.max(), "m", WORST, "max", "bone surfaces")
        out.add("attachments to soft tissue", len(found) - len(table), source="tables")
    table.sort(key=lambda row: -row["distance_m"])
    carried = [row for row in found if row["carried"]]
    out.details = {"attachments": len(table), "farthest": table[:60], "soft_tissue": carried}
    return out


def distances(subject: Subject) -> list[dict]:
    """One row for each attachment: muscle, end, bone and distance in m."""
    names = {row.muscle for row in subject.muscle_rows if not row.muscle.endswith("_l")}
    by_bone: dict[str, list] = {}
    for part in subject.parts:
        for muscle, rows in part.paths.items():
            for row in rows if muscle in names else ():
                if row.kind in ("origin", "insertion"):
                    by_bone.setdefault(row.bone, []).append(row)
    table = []
    for bone, rows in by_bone.items():
        side = -1.0 if bone.endswith("_l") else 1.0
        surface = subject.meshes.get(subject.bones[bone].mesh)
        points = np.array([row.point for row in rows]) * [1.0, side, 1.0]
        _, far, _ = trimesh.proximity.closest_point(surface, points)
        table += [
            {
                "muscle": row.muscle,
                "end": row.kind,
                "bone": bone,
                "distance_m": float(distance),
                "carried": CARRIED in row.source,
            }
            for row, distance in zip(rows, far, strict=True)
        ]
    return table
