"""Time on one core: networks online, the teacher offline, training pairs, the simulator; beside the papers' numbers."""

from __future__ import annotations

import itertools
import sys
import time
from collections.abc import Iterator
from functools import partial

import numpy as np

from anthro import cli, registry
from anthro.demos.criterion import task_of
from anthro.demos.session import Session, data_spec, finish, parser, row
from anthro.demos.task import card_of, title
from anthro.motor.limb import limb_plan
from anthro.motor.synthesize import Source
from anthro.motor.synthesize_reflex import wander
from anthro.progress import progress
from anthro.registry import INPUTS
from anthro.streams import stream

LIMBS = registry.TIMED  # left limbs mirror right ones
STEPS, TARGETS, LABELS, PAIRS, FIRST_PAIRS = 500, 20, 50, 100, 20
ONLINE, VOLUNTARY, REFLEX, TEACHER = "controller", "voluntary_pair", "reflex_pair", "teacher_label"
BARS = {  # s: bars of the project, by the sense of the limb
    "position": {ONLINE: 0.5e-3, VOLUNTARY: 6e-3, REFLEX: 6e-3},
    "gaze": {ONLINE: 0.5e-3, VOLUNTARY: 15e-3, REFLEX: 15e-3},
    "orientation": {ONLINE: 2e-3, VOLUNTARY: 40e-3, REFLEX: 40e-3},
}
IK_ID_MO = 0.120  # s a step at least, of the seated human (Nakada 2018, Sec. 9)
PAPERS = {  # s: what the papers say, and where
    "position": {ONLINE: (1e-3, "Sec. 9"), TEACHER: (IK_ID_MO, "Sec. 9")},
    "gaze": {ONLINE: (1e-3, "Sec. 9"), TEACHER: (IK_ID_MO, "Sec. 9"), VOLUNTARY: (0.8, "Sec. 5.1.1")},
    "orientation": {ONLINE: (2e-3, "Sec. 4.3.2"), VOLUNTARY: (8.7, "Sec. 4.3.1"), REFLEX: (0.3, "Sec. 4.3.1")},
}


def median_seconds(call, repeats: int) -> float:
    """Median wall time in s of a call, after one call that warms up."""
    call()
    times = []
    for _ in range(repeats):
        started = time.perf_counter()
        call()
        times.append(time.perf_counter() - started)
    return float(np.median(times))


def pair_seconds(pairs: Iterator, shard: int) -> float:
    """Wall time in s of a training pair; what the first ones need beyond their own is spread over a ``shard``."""
    first, each = (_seconds(pairs, count) for count in (FIRST_PAIRS, PAIRS))
    each /= PAIRS
    return each + max(first - FIRST_PAIRS * each, 0.0) / shard


def _seconds(items: Iterator, count: int) -> float:
    started = time.perf_counter()
    for _ in itertools.islice(items, count):
        pass
    return time.perf_counter() - started


def measure(session: Session, name: str, seed: int) -> dict:
    """Seconds of one limb's parts, on the body that its data are synthesized on."""
    limb, teacher = session.limb(name), session.teacher(name)
    simulator, drive = session.simulator(), np.zeros(limb.size)
    specs = {role: data_spec(session.run, name, role) for role in ("voluntary", "reflex")}
    students = [session.controller(name, inputs) for inputs in INPUTS]
    found = {}
    for inputs, student in zip(INPUTS, students, strict=True):
        student.reset(simulator)
        sensed = (np.full(limb.width, 0.1), *limb.strains(simulator))
        found[f"{ONLINE}_{inputs}"] = median_seconds(partial(student.control, *sensed), STEPS)
    targets = itertools.cycle(session.targets(name, TARGETS, task_of(limb).share, seed, "timing"))
    found["inverse_kinematics"] = median_seconds(lambda: teacher.kinematics.solve(next(targets)), TARGETS)
    teacher.aim(next(targets))
    found[TEACHER] = median_seconds(partial(teacher.voluntary, simulator, drive), LABELS)
    for who, led_by in (("teacher", []), ("students", students)):
        source = Source(specs["voluntary"], limb, led_by, stream(seed, f"demos.timing.{name}.{who}"))
        found[f"{VOLUNTARY}_{who}"] = pair_seconds(iter(source), specs["voluntary"]["pairs"])
    reflexes = wander(specs["reflex"], limb, stream(seed, f"demos.timing.{name}.reflex"))
    found[REFLEX] = pair_seconds(reflexes, specs["reflex"]["pairs"])
    silent = np.zeros(session.body.muscle_count)
    found["simulator_step"] = median_seconds(partial(simulator.step, silent), STEPS)
    return found


def compared(sense: str, found: dict) -> dict:
    """Each part: ``ours``, its ``bar`` or None; where a paper tells it ``theirs``, the ``ratio`` and its ``source``."""
    table = {}
    for part, seconds in found.items():
        bar = next((bar for beginning, bar in BARS[sense].items() if part.startswith(beginning)), None)
        entry = {"ours": seconds, "bar": bar}
        for beginning, (theirs, source) in PAPERS[sense].items():
            if part.startswith(beginning):
                entry |= {"theirs": theirs, "ratio": theirs / seconds, "source": source}
        table[part] = entry
    return table


def rows_of(limb: str, table: dict) -> list[dict]:
    """Scorecard rows of one limb: times against their bars, and how many times faster than the papers."""
    item, paper, rows = f"{title(limb, 'timing')}, one core", registry.limb(limb).paper, []
    for part, entry in table.items():
        source = entry.get("source", "project")
        sense = "max" if entry["bar"] else "info"
        rows.append(row(item, f"{part}_s", entry["ours"], "s", entry["bar"], sense, source, paper))
        if "ratio" in entry:
            rows.append(row(item, f"{part}_theirs_over_ours", entry["ratio"], "1", 1.0, "min", source, paper))
    return rows


def main(argv=None) -> int:
    arguments = parser("timing", __doc__, limb=None)
    arguments.add_argument("--limbs", nargs="+", choices=LIMBS, default=LIMBS, help="limbs to time (default: all)")
    args = arguments.parse_args(argv)
    with card_of(args, "timing", limbs=list(args.limbs)) as card:
        metrics, rows = {}, []
        for limb in progress(args.limbs, len(args.limbs), "limbs"):
            plan = limb_plan(data_spec(args.run, limb, "voluntary")["limb"])
            session = Session.open(args.run, plan.body)
            table = compared(plan.senses, measure(session, limb, args.seed))
            metrics[limb] = table
            rows += rows_of(limb, table)
        finish(args, "timing", {}, {}, metrics, rows, card)
    return 0


if __name__ == "__main__":
    sys.exit(cli.run(main))
