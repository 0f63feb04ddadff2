"""Counts of bones, hinges and muscles, and what their names say."""

from __future__ import annotations

from collections import Counter

import numpy as np

from anthro.body.checks.motions import LIMBS, OPPOSITE, SPINE
from anthro.body.checks.outcome import Outcome
from anthro.body.checks.subject import Subject

COUNTS = {
    "zhou2021": {
        "bones": 193,
        "hinges": 163,
        "muscles": 823,
        "core bones": 50,
        "core hinges": 112,
        "core muscles": 443,
        "neck hinges": 21,
        "neck muscles": 244,
        "arm muscles": 58,
        "arm hinges": 14,
        "leg muscles": 78,
        "leg hinges": 16,
    },
    "nakada2018": {
        "hinges": 51,
        "muscles": 352,
        "neck muscles": 216,
        "neck hinges": 21,
        "arm muscles": 58,
        "leg muscles": 78,
    },
    "right_arm": {"hinges": 7, "muscles": 29},
}
SHARED_NAMES = "anatomical names of several fascicles"
SOURCES = {"zhou2021": "Sec. 2", "nakada2018": "Sec. 3 and 4", "right_arm": "Sec. 3"}


def check(subject: Subject) -> Outcome:
    """Compare counts with the paper's; names are unique, and every muscle has one of anatomy."""
    out = Outcome(subject.plan.name, "inventory")
    found = counts(subject)
    source = SOURCES.get(subject.plan.name, "tables")
    for what, target in COUNTS.get(subject.plan.name, {}).items():
        out.add(what, found[what], "1", target, "equal", source)
    bad = offenders(subject)
    for metric, names in bad.items():
        judged = ("info", None) if metric == SHARED_NAMES else ("equal", 0)
        out.add(metric, len(names), "1", judged[1], judged[0], "tables")
    out.details = {"counts": dict(found), **bad}
    return out


def counts(subject: Subject) -> Counter:
    """How many bones, hinges and muscles there are, in all and by region."""
    body, found = subject.body, Counter()
    found["bones"] = subject.model.nbody - 1
    found["hinges"], found["muscles"] = body.dof_count, body.muscle_count
    built = set(body.muscle_names)
    for part in subject.parts:
        found[f"{part.name} bones"] = len(part.bones)
        found[f"{part.name} hinges"] = sum(row.joint in subject.dof for row in part.joints)
        found[f"{part.name} muscles"] = sum(row.muscle in built for row in part.muscles)
    return found


def offenders(subject: Subject) -> dict[str, list[str]]:
    """Names that stand twice, that anatomy does not know, or that say another sense than the hinge has."""
    rows = subject.muscle_rows
    anatomical = Counter(row.anatomical_name for row in rows if not row.muscle.endswith("_l"))
    names = [*subject.body.muscle_names, *subject.body.dof_names, *subject.body.ligament_names]
    twice = [name for name, count in Counter(names).items() if count > 1]
    return {
        "names that stand twice": twice,
        "muscles without an anatomical name": [
            row.muscle for row in rows if not row.anatomical_name.strip() or not row.group.strip()
        ],
        SHARED_NAMES: [name for name, count in anatomical.items() if count > 1],
        "bones of the model that no table has": [
            name for i in range(1, subject.model.nbody) if (name := subject.model.body(i).name) not in subject.bones
        ],
        "hinges against the sense of their name": wrong_senses(subject),
    }


def wrong_senses(subject: Subject) -> list[str]:
    """Hinges named after a motion whose positive sense is the opposite one."""
    senses = {bone: axes for bone, axes in LIMBS.values()}
    wrong = []
    for name, axis, bone in zip(subject.body.dof_names, subject.axes, subject.bone_of_dof, strict=True):
        known = senses.get(bone, {} if bone.endswith(("_r", "_l")) else SPINE)
        known = known | {word: -known[other] for word, other in OPPOSITE.items() if other in known}
        for motion, wanted in known.items():
            if f"_{motion}_" in f"{name}_" and float(np.dot(axis, wanted)) < 0.0:
                wrong.append(name)
    return wrong
