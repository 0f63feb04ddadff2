"""Left and right are mirror images: bones, muscles, and what they do in mirrored postures."""

from __future__ import annotations

import mujoco
import numpy as np

from anthro.body.checks.outcome import Outcome
from anthro.body.checks.subject import Subject
from anthro.body.parts import twin_name, twins

TOLERANCE = 1e-9  # SI units
POSES = 50
MIRROR = np.array([1.0, -1.0, 1.0])
FLIPPED = ("_lateral", "_axial")


def check(subject: Subject) -> Outcome:
    """Largest differences between a side and its mirrored twin, and who differs most."""
    out = Outcome(subject.plan.name, "symmetry")
    if not subject.plan.both_sides:
        return out
    worst = bones(subject) | parameters(subject) | postures(subject)
    for quantity, (difference, unit, where) in worst.items():
        out.add(quantity, difference, unit, TOLERANCE, "max", "mirror")
        out.details[quantity] = {"difference": difference, "where": where}
    return out


def mirrored_posture(subject: Subject, q: np.ndarray) -> np.ndarray:
    """Angles (m,) of the mirrored posture: sides exchanged, midline bending and turning reversed."""
    return (senses(subject) * q)[twins(subject.body.dof_names)]


def senses(subject: Subject) -> np.ndarray:
    """(m,) -1 for midline hinges that mirror into their opposite, +1 for all others."""
    return np.array([-1.0 if name.endswith(FLIPPED) else 1.0 for name in subject.body.dof_names])


def bones(subject: Subject) -> dict:
    """Mass, centre of mass and inertia of the compiled bones."""
    model = subject.model
    names = [model.body(i).name for i in range(1, model.nbody)]
    other = twins(names)
    mass, centre = model.body_mass[1:], model.body_ipos[1:]
    inertia = np.array([_inertia(model, i) for i in range(1, model.nbody)])
    flip = np.outer(MIRROR, MIRROR)
    place = model.body_pos[1:]
    lonely = [name for name in names if name.endswith(("_r", "_l")) and twin_name(name) not in names]
    return {
        "bones without a twin": (float(len(lonely)), "1", lonely),
        "mass": _largest(mass - mass[other], names, "kg"),
        "joint centre": _largest(place - MIRROR * place[other], names, "m"),
        "centre of mass": _largest(centre - MIRROR * centre[other], names, "m"),
        "inertia": _largest(inertia - flip * inertia[other], names, "kg m^2"),
    }


def parameters(subject: Subject) -> dict:
    """Strength and lengths of the muscles, ranges and springs of the hinges."""
    body = subject.body
    other, joints = twins(body.muscle_names), twins(body.dof_names)
    lonely = [n for n in body.muscle_names if n.endswith(("_r", "_l")) and twin_name(n) not in body.muscle_names]
    sense = senses(subject)[:, None]
    span = np.sort(sense * body.q_range, axis=1)
    found = {"muscles without a twin": (float(len(lonely)), "1", lonely)}
    for name, unit in (("max_force", "N"), ("slack_length", "m"), ("tendon_length", "m")):
        values = getattr(body, name)
        found[name.replace("_", " ")] = _largest(values - values[other], body.muscle_names, unit)
    for name, values, unit in (
        ("joint range", span - body.q_range[joints], "rad"),
        ("joint stiffness", body.joint_stiffness - body.joint_stiffness[joints], "N m/rad"),
        ("joint damping", body.joint_damping - body.joint_damping[joints], "N m s/rad"),
    ):
        found[name] = _largest(values, body.dof_names, unit)
    return found


def postures(subject: Subject) -> dict:
    """Muscle lengths and moment arms at random postures and their mirror images."""
    body, rng = subject.body, subject.random("symmetry")
    other, joints, sense = twins(body.muscle_names), twins(body.dof_names), senses(subject)
    low, high = body.q_range.T
    length, arm = np.zeros(body.muscle_count), np.zeros(body.muscle_count)
    for _ in range(POSES):
        q = rng.uniform(low, high)
        here = [values[: body.muscle_count] for values in subject.at(q)]
        there = [values[: body.muscle_count] for values in subject.at(mirrored_posture(subject, q))]
        length = np.maximum(length, np.abs(here[0] - there[0][other]))
        arm = np.maximum(arm, np.abs(here[1] - (sense * there[1][other][:, joints])).max(axis=1))
    return {
        "muscle length": _largest(length, body.muscle_names, "m"),
        "moment arm": _largest(arm, body.muscle_names, "m"),
    }


def _inertia(model, body: int) -> np.ndarray:
    turn = np.empty(9)
    mujoco.mju_quat2Mat(turn, model.body_iquat[body])
    turn = turn.reshape(3, 3)
    return turn @ np.diag(model.body_inertia[body]) @ turn.T


def _largest(values, names, unit: str):
    values = np.abs(np.reshape(values, (len(names), -1))).max(axis=1)
    worst = int(values.argmax()) if len(values) else 0
    return (float(values[worst]), unit, names[worst]) if len(values) else (0.0, unit, "")
