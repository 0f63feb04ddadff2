"""Table 2 measured anew: ``python -m anthro.neuroanimator.timing --run DIR --out DIR``, on one core, in one run.

Each model is simulated for 20,000 physical steps and emulated for as long, in turns, several rounds; medians count.
These are animations of 20 s, one after the other: longer ones with inputs held would leave what emulators know.
Simulators are those of the plants: MuJoCo as it is today, and for the dolphin the semi-implicit integrator of 1998
(banded Cholesky, compiled). Both sides run compiled, with inputs held: nothing of Python is in a step. Emulators run
one trajectory at a time (Grzeszczuk 1998, App. C), and 1,024 at once, whose time is told for each of them.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

from anthro import cli
from anthro.errors import UserError
from anthro.neuroanimator.accuracy import variants
from anthro.neuroanimator.emulator import load_emulator
from anthro.neuroanimator.hierarchy import load_dolphin
from anthro.neuroanimator.plants import plant_of
from anthro.neuroanimator.rows import row, write
from anthro.progress import progress
from anthro.runcard import RunCard
from anthro.streams import stream

BATCH = 1024
ANIMATION = 2000  # physical steps
PAPER = {  # s for 20,000 physical steps (Grzeszczuk 1998, Table 2)
    "passive_pendulum": {"simulation": 4.70, "n25": 0.10, "n50": 0.05, "n100": 0.02},
    "active_pendulum": {"simulation": 4.52, "n25": 0.12, "n50": 0.06, "n100": 0.03},
    "truck": {"simulation": 4.88, "n50": 0.07},
    "lander": {"simulation": 6.44, "n50": 0.12},
    "dolphin": {"simulation": 63.00, "n50": 0.95, "n50_regularised": 2.48},
}


def seconds(call: Callable, animations: int) -> float:
    """Wall time of a call made again for each animation, s."""
    started = time.perf_counter()
    for _ in range(animations):
        call()
    return time.perf_counter() - started


def batches(run: Path, name: str, steps: int) -> Callable:
    """Function of state, inputs (count, width) and size that emulates many trajectories at once."""
    if name == "dolphin":
        dolphin = load_dolphin(run, steps)

        def emulate(state, inputs, size):
            frames, local = (np.repeat(part, size, axis=0) for part in dolphin.segments.split(state[None]))
            for given in inputs:
                frames, local = dolphin.step(frames, local, np.broadcast_to(given, (size, len(given))))

    else:
        emulator = load_emulator(run, f"{name}_n{steps}", plant_of(name))

        def emulate(state, inputs, size):
            states = np.repeat(state[None], size, axis=0)
            for given in inputs:
                states = emulator.step(states, np.broadcast_to(given, (size, len(given))))

    return emulate


def calls_of(run: Path, name: str, steps: int, seed: int) -> dict[str, Callable]:
    """What is timed of one model for one animation, by its name."""
    plant, generator = plant_of(name), stream(seed, f"neuroanimator/timing/{name}")
    state = plant.start(generator)
    control = plant.typical(generator).at(0.0, state)
    calls = {"simulation": lambda: plant.step(state, control, steps=steps)}
    for told in PAPER[name]:
        if told == "simulation" or told.endswith("regularised"):
            continue
        each = int(told[1:])
        inputs = np.tile(control, (steps // each, 1))
        for variant, rollout in variants(run, name, each).items():
            calls[variant] = lambda rollout=rollout, inputs=inputs: rollout(state, inputs)
        many = batches(run, name, each)
        calls[f"{told}_batch"] = lambda many=many, inputs=inputs: many(state, inputs, BATCH)
    return calls


def measure(run: Path, steps: int, rounds: int, seed: int) -> dict[str, dict[str, float]]:
    """Median seconds of each model's simulation and emulations; a batch's by trajectory."""
    found, length = {}, min(steps, ANIMATION)
    for name in progress(PAPER, len(PAPER), "models"):
        calls, times = calls_of(run, name, length, seed), {}
        for call in calls.values():
            call()  # compiles, and fills the caches
        for _ in range(rounds):
            for key, call in calls.items():
                times.setdefault(key, []).append(seconds(call, steps // length))
        found[name] = {key: float(np.median(taken)) for key, taken in times.items()}
        for key in found[name]:
            if key.endswith("_batch"):
                found[name][key] /= BATCH
    return found


def rows_of(metrics: dict, steps: int) -> list[dict]:
    """Scorecard rows: seconds, and how many times faster than the simulation, beside the paper's ratio."""
    rows = []
    for name, times in metrics.items():
        item, theirs = f"{name.replace('_', ' ')}, {steps} steps on one core", PAPER[name]
        for key, taken in times.items():
            shown = key.replace("_", " ")
            rows.append(row(item, f"{shown}: time", taken, "s", theirs.get(key), "info", "Table 2"))
            if key != "simulation":
                base = theirs.get(key.removesuffix("_batch"))
                target = theirs["simulation"] / base
                ratio = times["simulation"] / taken
                rows.append(row(item, f"{shown}: simulation over emulation", ratio, "ratio", target, "min", "Table 2"))
    return rows


def main(argv: Sequence[str] | None = None) -> None:
    """Measure all models of Table 2."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--run", required=True, type=Path, metavar="DIR", help="the run's folder, results/<run>")
    parser.add_argument("--steps", type=int, default=20000, help="physical steps, a multiple of 100 (default 20000)")
    parser.add_argument("--rounds", type=int, default=5, help="of taking turns (default 5)")
    parser.add_argument("--seed", type=int, default=7, help="(default 7)")
    parser.add_argument("--out", required=True, type=Path, metavar="DIR", help="for metrics, rows and run card")
    given = parser.parse_args(argv)
    if given.steps < 100 or given.steps % min(given.steps, ANIMATION) or given.steps % 100 or given.rounds < 1:
        raise UserError(
            f"--steps {given.steps} --rounds {given.rounds}: a multiple of 100, and of {ANIMATION} beyond it, and at"
            " least 1 are wanted"
        )
    with RunCard(given.out / "run_card.json", {"steps": given.steps, "rounds": given.rounds}, given.seed):
        metrics = measure(given.run, given.steps, given.rounds, given.seed)
        write(given.out, metrics, rows_of(metrics, given.steps))


if __name__ == "__main__":
    sys.exit(cli.run(main))
