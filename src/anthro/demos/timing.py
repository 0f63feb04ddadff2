"""Time a control step: networks online, the teacher offline, a training pair, the simulator."""

from __future__ import annotations

import itertools
import sys
import time
from contextlib import nullcontext
from functools import partial

import numpy as np

from anthro import cli
from anthro.body.simulator import DEFAULT_STEP
from anthro.demos.reach import random_targets
from anthro.demos.session import Session, finish, parser, row
from anthro.files import read_json
from anthro.motor.synthesize import labelled_pairs
from anthro.motor.synthesize_reflex import wander, wander_regimen
from anthro.motor.teacher import Gains, TeacherPolicy
from anthro.runcard import RunCard
from anthro.streams import stream

PAPER_STEP = (0.120, 0.230)  # s a time step by IK, ID and MO (Sec. 9)


def median_seconds(call, repeats: int) -> float:
    """Median wall time in s of a call, after one call that warms up."""
    call()
    times = []
    for _ in range(repeats):
        started = time.perf_counter()
        call()
        times.append(time.perf_counter() - started)
    return float(np.median(times))


def mean_seconds(iterator, count: int) -> float:
    """Mean wall time in s of one item; what the first one needs beyond its own is spread over all."""
    started = time.perf_counter()
    for _ in itertools.islice(iterator, count):
        pass
    return (time.perf_counter() - started) / count


def measure(session: Session, seed: int) -> dict:
    """All timings in s, and the simulator's speed over real time."""
    simulator = session.simulator()
    targets = random_targets(session, 50, seed)
    next_target = itertools.cycle(targets).__next__
    teacher, appendix_b = session.teacher(), session.teacher("appendix_b")
    policy = TeacherPolicy(teacher)
    policy.reset(simulator)
    metrics = {}
    for inputs in ("paper", "proprioceptive"):
        controller = session.controller(inputs)
        controller.reset(simulator)
        offset = np.array([0.1, 0.0, 0.1])
        step = partial(controller.control, offset, simulator.strain, simulator.strain_rate)
        metrics[f"both_networks_{inputs}_s"] = median_seconds(step, 2000)
    metrics["inverse_kinematics_s"] = median_seconds(lambda: teacher.aim(next_target()), 100)
    label = partial(teacher.voluntary, simulator, policy.drive)
    metrics["teacher_label_s"] = median_seconds(label, 500)
    appendix_b.aim(targets[0])
    metrics["appendix_b_label_s"] = median_seconds(partial(appendix_b.desired_activation, simulator), 500)
    metrics["simulator_step_s"] = median_seconds(partial(simulator.step, np.full(29, 0.1)), 2000)
    metrics["simulator_speed"] = DEFAULT_STEP / metrics["simulator_step_s"]
    return metrics | pair_seconds(session, seed)


def pair_seconds(session: Session, seed: int) -> dict:
    """Time of a training pair in s, rollout and inverse kinematics included."""
    specs = {
        role: read_json(session.run / "specs" / "data" / f"{session.limb}_{role}.json")
        for role in ("voluntary", "reflex")
    }
    body, rng = session.body, stream(seed, "demos.timing")
    students = [session.controller(inputs) for inputs in ("paper", "proprioceptive")]
    followed = labelled_pairs(specs["voluntary"], body, [], rng)
    led = labelled_pairs(specs["voluntary"], body, students, rng)
    gains = Gains(**specs["reflex"]["teacher"])
    reflexes = wander(body, wander_regimen(specs["reflex"]["rollout"]), gains, rng)
    return {
        "voluntary_pair_teacher_s": mean_seconds(followed, specs["voluntary"]["pairs"]),
        "voluntary_pair_students_s": mean_seconds(led, specs["voluntary"]["pairs"]),
        "reflex_pair_s": mean_seconds(reflexes, specs["reflex"]["pairs"]),
    }


def rows_of(m: dict) -> list[dict]:
    """Scorecard rows: ours against the issue's bars and the paper's IK-ID-MO."""
    item = "right arm timing, one core"
    bars = {
        "both_networks_paper_s": 0.3e-3,
        "both_networks_proprioceptive_s": 0.3e-3,
        "voluntary_pair_teacher_s": 3e-3,
        "voluntary_pair_students_s": 3e-3,
        "reflex_pair_s": 0.2e-3,
    }
    rows = [row(item, name, m[name], "s", bar, "max", "Sec. 5.1, 9") for name, bar in bars.items()]
    for name in ("inverse_kinematics_s", "teacher_label_s", "appendix_b_label_s"):
        rows.append(row(item, name, m[name], "s", PAPER_STEP[0], "max", "Sec. 9"))
    return [*rows, row(item, "simulator_speed", m["simulator_speed"], "x real time", 30.0, "min")]


def main(argv=None) -> int:
    args = parser("timing", __doc__).parse_args(argv)
    session = Session.open(args.run, args.limb)
    spec = {"demo": "timing", "limb": args.limb}
    card = RunCard(args.out / "run_card.json", spec, args.seed) if args.out else nullcontext()
    with card:
        metrics = measure(session, args.seed)
        finish(args, "timing", {}, {}, metrics, rows_of(metrics), card)
    return 0


if __name__ == "__main__":
    sys.exit(cli.run(main))
