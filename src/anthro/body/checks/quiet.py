"""Without activations the body comes to rest lying, hanging and sitting; intercostals raise the ribs."""

from __future__ import annotations

import copy
from dataclasses import replace

import numpy as np

from anthro.body.checks.motions import posture
from anthro.body.checks.outcome import Outcome
from anthro.body.checks.stability import STEP, lowest
from anthro.body.checks.subject import Subject
from anthro.body.contact import Seat, World
from anthro.body.model import Body
from anthro.errors import UserError
from anthro.progress import progress

SECONDS = 10.0
SETTLED = 0.05  # rad/s, largest joint speed over the last half second
WATCHED = 0.5  # s
PINNED = 1e9  # kg and kg m^2 added to the root: it does not move
SUPINE = np.array([np.sqrt(0.5), 0.0, -np.sqrt(0.5), 0.0])  # face up
SEATED = {("hip", "flexion"): 88.0, ("knee", "flexion"): 88.0}
CLEARANCE = 0.002  # m above ground and seat at the start
BREATH_SECONDS = 2.0
ACTIVATIONS = (0.5, 1.0)
PUMPED, BUCKETED = range(2, 7), range(7, 11)  # ribs that lift their front, and their side


def check(subject: Subject) -> Outcome:
    """Largest joint speed at rest in each place, and by how much external intercostals raise the ribs."""
    out = Outcome(subject.plan.name, "quiet")
    places = {"hanging": hanging} | ({"supine": supine, "sitting": sitting} if subject.body.root_free else {})
    for name, place in progress(places.items(), len(places), "quiet, places"):
        found = settle(*place(subject), SECONDS)
        out.details[name] = found
        source = f"no activation, {SECONDS:g} s"
        out.add("largest joint speed", found["speed_rad_s"], "rad/s", SETTLED, "max", source, name)
        out.add("largest excess over a joint limit", found["limit_excess_deg"], "deg", 10.0, "max", source, name)
    muscles = subject.muscles_of("external intercostal")
    if muscles and "rib2_pump_r" in subject.dof:
        out.details["ribs"] = table = breathe(subject)
        for level, lifts in table.items():
            for kind, ribs in (("pump", PUMPED), ("bucket", BUCKETED)):
                values = [lifts[f"rib{rib}_{kind}_r"] for rib in ribs]
                part = f"ribs {ribs[0]} to {ribs[-1]} at activation {level}"
                out.add(f"least {kind} of external intercostals", min(values), "deg", 0.0, "min", "Gray 1918", part)
                out.add(f"mean {kind} of external intercostals", np.mean(values), "deg", source="Gray 1918", part=part)
    return out


def pinned(body: Body) -> Body:
    """The same body with its root held in space."""
    if not body.root_free:
        return body
    model = copy.copy(body.model)
    model.dof_armature[:6] = PINNED
    return replace(body, model=model)


def hanging(subject: Subject):
    """Held at the pelvis, upright; no ground."""
    simulator = pinned(subject.body).simulator(STEP)
    simulator.reset(subject.model.qpos0.copy())
    return simulator, subject.body


def supine(subject: Subject):
    """On the back, a little above the ground."""
    pose = subject.model.qpos0.copy()
    pose[3:7] = SUPINE
    pose[2] += CLEARANCE - lowest(subject, pose)
    simulator = subject.body.simulator(STEP, World(ground=True))
    simulator.reset(pose)
    return simulator, subject.body


def sitting(subject: Subject):
    """On a seat as high as the thighs are when the feet stand on the ground."""
    pose = subject.model.qpos0.copy()
    q = posture(subject, SEATED)
    q, _ = subject.settle_patella(q)
    for name, i in subject.dof.items():
        if name.endswith("_l") and (right := f"{name[:-2]}_r") in subject.dof:
            q[i] = q[subject.dof[right]]
    pose[-len(q) :] = q
    pose[2] += CLEARANCE - lowest(subject, pose)
    height = lowest(subject, pose, "seat") - CLEARANCE
    simulator = subject.body.simulator(STEP, World(ground=True, seat=Seat(height)))
    simulator.reset(pose)
    return simulator, subject.body


def settle(simulator, body: Body, seconds: float) -> dict:
    """Run without activations; speeds at the end, and what is still moving."""
    off = np.zeros(body.muscle_count)
    speed, excess = np.zeros(body.dof_count), 0.0
    low, high = body.q_range.T
    steps = round(seconds / STEP)
    for k in range(steps):
        try:
            simulator.step(off)
        except UserError as error:
            return {"speed_rad_s": np.nan, "limit_excess_deg": np.nan, "broken": str(error)}
        if k >= steps - round(WATCHED / STEP):
            speed = np.maximum(speed, np.abs(simulator.joint_velocities))
            q = simulator.joint_angles
            excess = max(excess, float(np.maximum(q - high, low - q).max()))
    fastest = np.argsort(-speed)[:8]
    bent = np.argsort(-np.abs(simulator.joint_angles))[:12]
    return {
        "speed_rad_s": float(speed.max()),
        "fastest": {body.dof_names[i]: float(speed[i]) for i in fastest},
        "limit_excess_deg": float(np.rad2deg(excess)),
        "root": simulator.qpos[:7].tolist() if body.root_free else [],
        "angles_deg": {body.dof_names[i]: float(np.rad2deg(simulator.joint_angles[i])) for i in bent},
    }


def breathe(subject: Subject) -> dict:
    """Turns of the ribs in degrees by external intercostals of both sides, beyond those without them."""
    body = pinned(subject.body)
    names = [f"rib{rib}_{kind}_r" for rib in range(1, 13) for kind in ("pump", "bucket")]
    names = [name for name in names if name in subject.dof]
    dofs = [subject.dof[name] for name in names]
    right = {body.muscle_names[i] for i in subject.muscles_of("external intercostal")}
    both = [i for i, name in enumerate(body.muscle_names) if name in right or f"{name[:-2]}_r" in right]
    simulator, angles = body.simulator(STEP), {}
    for level in (0.0, *ACTIVATIONS):
        activation = np.zeros(body.muscle_count)
        activation[both] = level
        simulator.reset(subject.model.qpos0.copy())
        for _ in range(round(BREATH_SECONDS / STEP)):
            simulator.step(activation)
        angles[level] = np.rad2deg(simulator.joint_angles[dofs])
    return {
        f"{level:g}": dict(zip(names, (angles[level] - angles[0.0]).tolist(), strict=True)) for level in ACTIVATIONS
    }
