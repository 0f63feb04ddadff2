"""Muscle paths never jump, and fibers stay where they can work, at random postures.

A path without wraps is smooth by construction: over a small turn d of a hinge its length changes by |dl/dq| d. A path
with wraps is tested by turning each hinge it crosses. Hinges that share no wrapped muscle are turned together. A jump
is what the change goes beyond the two slopes dl/dq at its ends, so that a kink, where a path meets its wrap, is none.
"""

from __future__ import annotations

import copy
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from functools import partial

import mujoco
import numpy as np

from anthro.body import hill
from anthro.body.checks.outcome import Outcome
from anthro.body.checks.subject import Subject, place
from anthro.body.fit import HARD_LIMITS
from anthro.body.postures import PostureSampler
from anthro.progress import progress

TURN = np.deg2rad(0.2)
ALLOWED = 1e-3  # m
SHARD = 500  # postures of one random stream
CROSSED = 1e-6  # m: slopes below it everywhere count as none
PROBES = 64  # postures that tell which hinges a path crosses


def check(subject: Subject) -> Outcome:
    """Jumps, changes over 0.2 degrees, and fiber lengths over the joint ranges."""
    out = Outcome(subject.plan.name, "paths")
    body, count = subject.body, subject.options.poses
    turns = turns_of(subject, crossings(subject))
    shards = [(k, min(SHARD, count - k * SHARD)) for k in range(-(-count // SHARD))]
    found = [part for part in progress(_shards(subject, turns, shards), len(shards), "paths, 500 postures each")]
    jump, where = _worst([part["jump"] for part in found], [part["where"] for part in found])
    change = np.max([part["change"] for part in found], axis=0)
    short = np.min([part["short"] for part in found], axis=0)
    long = np.max([part["long"] for part in found], axis=0)
    outside = np.flatnonzero((short < HARD_LIMITS[0]) | (long > HARD_LIMITS[1]))
    source = f"{count} random postures"
    out.add("largest jump over 0.2 degrees", jump.max(initial=0.0), "m", ALLOWED, "max", source)
    out.add("muscles that jump", (jump > ALLOWED).sum(), "1", 0, "equal", source)
    out.add("largest change over 0.2 degrees, jump or not", change.max(initial=0.0), "m", source=source)
    out.add("fibers outside 0.5 to 1.6 of slack length", len(outside), "1", 0, "equal", source)
    out.add("shortest fiber over slack length", short.min(initial=np.inf), source=source)
    out.add("longest fiber over slack length", long.max(initial=-np.inf), source=source)
    names = body.muscle_names
    neutral, passive = _neutral(subject)
    out.add("largest passive force at neutral, of the strength", (passive / body.max_force).max(initial=0.0))
    out.details = {
        "postures": count,
        "wrapped_muscles": int(wrapped(subject).sum()),
        "turns_a_posture": len(turns),
        "jumps": [
            {"muscle": names[i], "jump_m": float(jump[i])} | where[i] for i in np.argsort(-jump)[:40] if jump[i] > 1e-5
        ],
        "largest_changes_m": {names[i]: float(change[i]) for i in np.argsort(-change)[:10]},
        "fibers_outside": {names[i]: [float(short[i]), float(long[i])] for i in outside},
        "passive_at_neutral": [
            {
                "muscle": names[i],
                "strain": float(neutral[i]),
                "force_N": float(passive[i]),
                "share": float(passive[i] / body.max_force[i]),
            }
            for i in np.argsort(-passive / body.max_force)[:40]
            if passive[i] > 0.0
        ],
    }
    return out


def wrapped(subject: Subject) -> np.ndarray:
    """(n,) bool: muscles whose path has a wrap."""
    model = subject.model
    kinds = [
        model.wrap_type[first : first + count] for first, count in zip(model.tendon_adr, model.tendon_num, strict=True)
    ]
    sites = int(mujoco.mjtWrap.mjWRAP_SITE)
    return np.array([bool((kind != sites).any()) for kind in kinds[: subject.body.muscle_count]], bool)


def crossings(subject: Subject) -> np.ndarray:
    """(n, m) bool: the hinges that change the length of each wrapped muscle."""
    body, rng = subject.body, subject.random("paths.crossings")
    crossed = np.zeros((body.muscle_count, body.dof_count), bool)
    for q in PostureSampler(subject.model).draw(PROBES, rng):
        crossed |= np.abs(subject.at(q)[1][: body.muscle_count]) > CROSSED
    crossed[~wrapped(subject)] = False
    return crossed


def colours(crossed: np.ndarray) -> list[list[int]]:
    """Sets of hinges such that no muscle crosses two of one set; hinges without a muscle are left out."""
    groups: list[tuple[list[int], np.ndarray]] = []
    for dof in np.argsort(-crossed.sum(axis=0), kind="stable"):
        if not crossed[:, dof].any():
            continue
        for members, taken in groups:
            if not (taken & crossed[:, dof]).any():
                members.append(int(dof))
                taken |= crossed[:, dof]
                break
        else:
            groups.append(([int(dof)], crossed[:, dof].copy()))
    return [members for members, _ in groups]


@dataclass(frozen=True)
class Turn:
    """Hinges turned together, and the muscles that each of them stretches.

    Attributes
    ----------
    dofs : hinges.  muscle : muscles, each once.  place : of each muscle's hinge in ``dofs``.
    entry : place of each muscle's slope in MuJoCo's ``ten_J``.
    """

    dofs: np.ndarray
    muscle: np.ndarray
    place: np.ndarray
    entry: np.ndarray


def turns_of(subject: Subject, crossed: np.ndarray) -> list[Turn]:
    """The turns that test every wrapped muscle about every hinge that it crosses."""
    tendon, dof, entry = subject.slope_entries
    entries = np.full((subject.model.ntendon, subject.body.dof_count), -1)
    entries[tendon, dof] = entry
    turns = []
    for members in colours(crossed):
        muscle, place = np.nonzero(crossed[:, members])
        dofs = np.array(members)
        turns.append(Turn(dofs, muscle, place, entries[muscle, dofs[place]]))
    return turns


def jumps(subject: Subject, turns: list[Turn], shard: tuple[int, int]) -> dict:
    """One shard of postures: largest jump and change (n,) m, where it jumps, and extreme fiber lengths (n,)."""
    body, data, n = subject.body, subject.data, subject.body.muscle_count
    model_there, there = wraps_alone(subject)
    postures = PostureSampler(subject.model).draw(shard[1], subject.random("paths", shard[0]))
    jump, change, long = np.zeros(n), np.zeros(n), np.full(n, -np.inf)
    short, where, steepest = np.full(n, np.inf), [{} for _ in range(n)], np.zeros(len(data.ten_J))
    for q in postures:
        place(subject.model, data, q)
        length, slope = data.ten_length.copy(), data.ten_J.copy()
        fiber = (length[:n] - body.tendon_length) / body.slack_length
        short, long = np.minimum(short, fiber), np.maximum(long, fiber)
        steepest = np.maximum(steepest, np.abs(slope))
        for turn in turns:
            step = np.where(q[turn.dofs] + TURN <= body.q_range[turn.dofs, 1], TURN, -TURN)
            turned = q.copy()
            turned[turn.dofs] += step
            place(model_there, there, turned)
            moved = there.ten_length[turn.muscle] - length[turn.muscle]
            ends = np.stack([slope[turn.entry], there.ten_J[turn.entry]]) * step[turn.place]
            beyond = np.maximum(moved - ends.max(axis=0), ends.min(axis=0) - moved)
            change[turn.muscle] = np.maximum(change[turn.muscle], np.abs(moved))
            for k in np.flatnonzero(beyond > jump[turn.muscle]):
                muscle, hinge = turn.muscle[k], body.dof_names[turn.dofs[turn.place[k]]]
                jump[muscle] = beyond[k]
                where[muscle] = {"hinge": hinge, "posture_deg": _told(subject, turns, muscle, q)}
    tendon, _, entry = subject.slope_entries
    rows = tendon < n
    np.maximum.at(change, tendon[rows], steepest[entry[rows]] * TURN)
    return {"jump": jump, "change": change, "where": where, "short": short, "long": long}


def wraps_alone(subject: Subject) -> tuple[mujoco.MjModel, mujoco.MjData]:
    """A model in which all paths but the wrapped ones are cut to their first point, for speed."""
    model = copy.copy(subject.model)
    cut = np.ones(model.ntendon, bool)
    cut[: subject.body.muscle_count] = ~wrapped(subject)
    model.tendon_num[cut] = 1
    return model, mujoco.MjData(model)


def _told(subject: Subject, turns: list[Turn], muscle: int, q) -> dict:
    dofs = [dof for turn in turns for dof in turn.dofs[turn.place[turn.muscle == muscle]]]
    return {subject.body.dof_names[dof]: round(float(np.rad2deg(q[dof])), 2) for dof in sorted(dofs)}


def _shards(subject: Subject, turns, shards):
    if subject.options.jobs == 1:
        yield from (jumps(subject, turns, shard) for shard in shards)
        return
    with ProcessPoolExecutor(subject.options.jobs) as pool:
        yield from pool.map(partial(jumps, subject, turns), shards)


def _worst(jumps: list[np.ndarray], where: list[list[dict]]):
    best = np.argmax(jumps, axis=0)
    return np.max(jumps, axis=0), [where[k][i] for i, k in enumerate(best)]


def _neutral(subject: Subject) -> tuple[np.ndarray, np.ndarray]:
    """Strains and passive forces (n,) N in the neutral posture, the patella in place."""
    body = subject.body
    q, _ = subject.settle_patella(np.zeros(body.dof_count))
    length = subject.at(q)[0][: body.muscle_count]
    strain = hill.strain(length - body.tendon_length, body.slack_length)
    return strain, hill.passive_force(strain, np.zeros_like(strain), body.max_force)
