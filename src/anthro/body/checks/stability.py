"""The simulated body survives a minute of drops and random activations, and makes no energy.

Each start drops the body from a random posture and orientation just above the ground, once with muscles off, once with
white and once with band-limited noise in all of them. A start's result is kept, so that a killed run goes on where it
was.
"""

from __future__ import annotations

import math
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from pathlib import Path

import mujoco
import numpy as np

from anthro.body.checks.outcome import Outcome
from anthro.body.checks.subject import Subject
from anthro.body.contact import World
from anthro.errors import UserError
from anthro.files import digest, read_json, write_json
from anthro.progress import progress

STEP = 0.005  # s
DROP = 0.05  # m, from the lowest contact to the ground
MODES = ("off", "white", "band_limited")
CUTOFF = 3.0  # Hz, of the noise
MEAN, SPREAD = 0.2, 0.25  # of the noise before it is cut to 0..1
LIMIT_EXCESS = 10.0  # degrees
ENERGY_RISE = 1e-3  # of the energy at the start, in one step without input
SPEED_LIMIT = 1e4  # rad/s or m/s: what is faster has blown up


def check(subject: Subject) -> Outcome:
    """Run all starts in all modes and take the worst."""
    out = Outcome(subject.plan.name, "stability")
    tasks = [(mode, start) for mode in MODES for start in range(subject.options.starts)]
    found = list(progress(_all(subject, tasks), len(tasks), "stability, starts"))
    source = f"{subject.options.starts} starts of {subject.options.seconds:g} s, step {1e3 * STEP:g} ms"
    for mode in MODES:
        runs = [run for (kind, _), run in zip(tasks, found, strict=True) if kind == mode]
        broken = sum(run["broken"] != "" for run in runs)
        excess = max((run["limit_excess_deg"] for run in runs), default=0.0)
        out.add("runs that broke", broken, "1", 0, "equal", source, mode)
        out.add("largest excess over a joint limit", excess, "deg", LIMIT_EXCESS, "max", source, mode)
        if mode == "off":
            rise = max((run["energy_rise"] for run in runs), default=0.0)
            out.add("largest rise of energy in a step, of the start's", rise, "1", ENERGY_RISE, "max", source, mode)
            whole = max((run["energy_gain"] for run in runs), default=0.0)
            out.add("largest rise of energy in all, of the start's", whole, source=source, part=mode)
    out.details = {"runs": [{"mode": m, "start": s} | run for (m, s), run in zip(tasks, found, strict=True)]}
    return out


def drop(subject: Subject, rng: np.random.Generator) -> np.ndarray:
    """A random posture (nq,) within the joint ranges, turned at random, `DROP` above the ground."""
    body, model = subject.body, subject.model
    pose = model.qpos0.copy()
    pose[-body.dof_count :] = rng.uniform(*body.q_range.T)
    if body.root_free:
        turn = rng.normal(size=4)
        pose[3:7] = turn / np.linalg.norm(turn)
        pose[2] += DROP - lowest(subject, pose)
    return pose


def lowest(subject: Subject, pose: np.ndarray, surface: str = "ground") -> float:
    """Height in m of the lowest point of the spheres that meet a surface, or of any bone's frame without spheres."""
    data, contacts = mujoco.MjData(subject.model), subject.body.contacts
    data.qpos[:] = pose
    mujoco.mj_kinematics(subject.model, data)
    met = [i for i, surfaces in enumerate(contacts.surfaces) if surface in surfaces]
    if not met:
        return float(data.xpos[1:, 2].min())
    return float((data.site_xpos[contacts.sites[met], 2] - contacts.radius[met]).min())


class BandLimited:
    """Activations (n,): white noise twice through a first-order filter, cut to 0..1."""

    def __init__(self, count: int, step: float, rng: np.random.Generator):
        self._keep, self._rng = math.exp(-2.0 * math.pi * CUTOFF * step), rng
        self._first, self._second = np.zeros((2, count))
        a, b = self._keep, 1.0 - self._keep
        # variance of two equal filters in a row, driven by unit noise
        self._scale = SPREAD / math.sqrt(b**4 * (1.0 + a * a) / (1.0 - a * a) ** 3)

    def __call__(self) -> np.ndarray:
        a, b = self._keep, 1.0 - self._keep
        self._first = a * self._first + b * self._rng.normal(size=len(self._first))
        self._second = a * self._second + b * self._first
        return np.clip(MEAN + self._scale * self._second, 0.0, 1.0)


def run(subject: Subject, task: tuple[str, int]) -> dict:
    """One start: why it broke ("" if it did not), excess over limits, and rises of energy without input."""
    mode, start = task
    rng = subject.random(f"stability.{mode}", start)
    body = subject.body
    simulator = body.simulator(STEP, World(ground=True) if body.root_free else None)
    simulator.reset(drop(subject, rng))
    count = body.muscle_count
    activations = {
        "off": lambda: np.zeros(count),
        "white": lambda: rng.uniform(size=count),
        "band_limited": BandLimited(count, STEP, rng),
    }[mode]
    low, high = body.q_range.T
    energy = first = simulator.energy()
    excess, rise, lowest_yet, gain, broken, joint, when = 0.0, 0.0, energy, 0.0, "", "", 0.0
    for _ in range(round(subject.options.seconds / STEP)):
        try:
            simulator.step(activations())
        except UserError as error:
            broken = str(error)
            break
        q = simulator.joint_angles
        over = np.maximum(q - high, low - q)
        if not np.abs(simulator.qvel).max() < SPEED_LIMIT:
            broken = f"speed over {SPEED_LIMIT:g} at {simulator.time:.3f} s"
            break
        if over.max() > excess:
            excess, joint, when = float(over.max()), body.dof_names[int(over.argmax())], simulator.time
        if mode == "off":
            before, energy = energy, simulator.energy()
            rise = max(rise, energy - before)
            lowest_yet = min(lowest_yet, energy)
            gain = max(gain, energy - lowest_yet)
    scale = max(abs(first), 1.0)
    return {
        "broken": broken,
        "limit_excess_deg": float(np.rad2deg(excess)),
        "joint": joint,
        "at_s": round(when, 3),
        "energy_rise": rise / scale,
        "energy_gain": gain / scale,
        "energy_start_J": first,
        "energy_end_J": energy,
    }


def kept(subject: Subject, folder: Path | None, spec: str, task: tuple[str, int]) -> dict:
    """The result of one start, from ``folder`` if an equal run has left it there."""
    if folder is None:
        return run(subject, task)
    path = folder / f"{task[0]}_{task[1]:03d}.json"
    if path.is_file():
        found = read_json(path)
        if found.get("spec") == spec:
            return found["result"]
    result = run(subject, task)
    write_json(path, {"spec": spec, "result": result})
    return result


def _spec(subject: Subject) -> str:
    """What decides the results: seed, duration and the body's numbers."""
    body, model, options = subject.body, subject.model, subject.options
    arrays = [body.q_range, body.joint_stiffness, body.joint_damping, body.max_force, body.slack_length]
    arrays += [body.tendon_length, body.ligament_stiffness, body.ligament_damping, body.ligament_slack]
    arrays += [model.body_mass, model.body_pos, model.body_ipos, model.body_inertia, model.jnt_axis, model.site_pos]
    arrays += [model.wrap_objid, model.geom_size[:, 0], body.contacts.radius]
    content = {"arrays": [np.asarray(values).tobytes().hex() for values in arrays]}
    return digest(content | {"seed": options.seed, "seconds": options.seconds, "step": STEP, "drop": DROP})


def _all(subject: Subject, tasks):
    folder = subject.options.folder and subject.options.folder / "stability"
    work = partial(kept, subject, folder, _spec(subject))
    if subject.options.jobs == 1:
        yield from map(work, tasks)
        return
    with ProcessPoolExecutor(subject.options.jobs) as pool:
        yield from pool.map(work, tasks)
