"""How far a plant's emulators stray from it: ``python -m anthro.neuroanimator.accuracy --run DIR --plant NAME``.

After Fig. 12 (Grzeszczuk 1998, Sec. 5.2): the absolute difference between emulated and simulated state, averaged over
trials and over all state variables, against the physical step. The same of the local state: what the dynamics depend
on, without places and headings, which an emulator only adds up. What a plant never forgets, such as where a truck
stands or how fast a lander drifts, adds up whatever error: so that growth is told, too, of the plant itself when the
emulator's errors of single super-steps are put into it. Then, as is usual today, the root mean square error after 100,
500 and 1,000 super-steps over the standard deviation of each variable of the plant's own motion. Trials start at random
and are controlled as is typical; those whose emulator diverges count until they do, and how many do is told twice: over
the steps of Fig. 12, and over 1,000 super-steps.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

from anthro import cli
from anthro.errors import UserError
from anthro.neuroanimator.emulator import Diverged, load_emulator
from anthro.neuroanimator.hierarchy import REGULARISATIONS, load_dolphin
from anthro.neuroanimator.operators import Frame
from anthro.neuroanimator.plants import plant_of
from anthro.neuroanimator.plants.plant import STEP, Plant
from anthro.neuroanimator.rows import row, write
from anthro.neuroanimator.sample import checked
from anthro.neuroanimator.segments import Segments
from anthro.progress import progress
from anthro.runcard import RunCard
from anthro.streams import stream

HORIZONS = (100, 500, 1000)  # super-steps
BOUNDED = 2.0  # the last third's error over the first's that still counts as bounded
LEAST = 1e-9  # spread under which a variable of the local state does not vary
STEADY = 2.0  # the error of N100 over that of N25 that still counts as nearly the same


def motions(plant: Plant, steps: int, count: int, trials: int, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Simulate a plant under typical controls.

    Parameters
    ----------
    plant : Plant
    steps : int
        Physical steps of a super-step, over which inputs are held.
    count : int
        Super-steps.
    trials, seed : int

    Returns
    -------
    states : ndarray, (trials, count + 1, n_state)
    inputs : ndarray, (trials, count, n_force + n_control)

    Raises
    ------
    UserError
        Naming step and variable, when the simulation diverges.
    """
    states = np.empty((trials, count + 1, plant.n_state))
    inputs = np.empty((trials, count, plant.n_force + plant.n_control))
    for trial in progress(range(trials), trials, f"{plant.name} trials"):
        generator = stream(seed, f"neuroanimator/accuracy/{plant.name}/n{steps}", trial)
        state, pilot = plant.start(generator), plant.typical(generator)
        states[trial, 0] = state
        for t in range(count):
            control, force = pilot.at(t * steps * STEP, state), plant.push(generator)
            state = checked(plant, plant.step(state, control, force, steps), t * steps * STEP)
            inputs[trial, t], states[trial, t + 1] = np.concatenate([force, control]), state
    return states, inputs


def emulated(rollout: Callable, states: np.ndarray, inputs: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Emulate all trials, (trials, count + 1, n_state), NaN from where one diverges; and the super-step at which.

    A trial that does not diverge has one past the last.
    """
    found, ends = np.full_like(states, np.nan), np.full(len(states), states.shape[1])
    for trial in range(len(states)):
        try:
            found[trial] = rollout(states[trial, 0], inputs[trial])
        except Diverged as error:
            ends[trial] = len(error.states) - 1
            found[trial, : len(error.states)] = error.states
    return found, ends


def strayed(plant: Plant, rollout: Callable, states: np.ndarray, inputs: np.ndarray, steps: int) -> np.ndarray:
    """Simulate with the emulator's own errors of single super-steps put in, as `states` (trials, count + 1, n_state).

    Those errors are the emulator's along the true motion. A trial is NaN from where one cannot be told.
    """
    width, (trials, count) = plant.n_state, inputs.shape[:2]
    pairs = np.stack([states[:, :-1], states[:, 1:]], axis=2).reshape(-1, 2, width)
    singles, _ = emulated(rollout, pairs, inputs.reshape(trials * count, 1, -1))
    errors = (singles - pairs)[:, 1].reshape(trials, count, width)
    frame, found = None if plant.frame == "body" else Frame(plant.frame, plant.rest), np.full_like(states, np.nan)
    force, control = np.split(inputs, [plant.n_force], axis=2)
    for trial in progress(range(trials), trials, f"{plant.name} strayed"):
        state = found[trial, 0] = states[trial, 0]
        for t in range(count):
            if not np.isfinite(errors[trial, t]).all():
                break
            state = plant.step(state, control[trial, t], force[trial, t], steps) + errors[trial, t]
            state = state if frame is None else frame.settle(state[None])[0]
            found[trial, t + 1] = state
    return found


def local_error(plant: Plant, found: np.ndarray, states: np.ndarray) -> np.ndarray:
    """Error (trials, count + 1, n) of the local state, of its variables that vary; NaN where `found` is."""
    shape, kept = found.shape[:2], np.isfinite(found).all(axis=2).ravel()
    pair, rest = [values.reshape(-1, plant.n_state) for values in (found, states)], plant.rest
    if plant.frame == "body":
        segments = Segments(plant)
        pair, rest = [segments.split(values)[0] for values in pair], segments.rest
    frame = Frame(plant.frame, rest)
    emulation, motion = (frame.local(values) for values in pair)
    varies = np.ptp(motion, axis=0) > LEAST
    error = np.where(kept[:, None], emulation - motion, np.nan)[:, varies]
    return error.reshape(*shape, -1)


def growth(errors: np.ndarray) -> float:
    """Mean of the last third of an error curve (count + 1,) over that of the first, without the start."""
    third = max(1, (len(errors) - 1) // 3)
    return errors[-third:].mean() / errors[1 : third + 1].mean()


def curve(error: np.ndarray) -> np.ndarray:
    """Mean absolute error (count + 1,) over trials, not NaN, and variables of errors (trials, count + 1, n)."""
    kept = np.isfinite(error).all(axis=2)
    summed = np.where(kept[:, :, None], np.abs(error), 0.0).mean(axis=2).sum(axis=0)
    return summed / np.maximum(kept.sum(axis=0), 1)


def relative(error: np.ndarray, states: np.ndarray, at: int) -> float:
    """Root mean square error at a super-step over each variable's deviation, the root of the mean over variables.

    Variables that do not vary are left out; trials that diverged before, too.
    """
    deviation = states.std(axis=(0, 1))
    moving = deviation > 1e-6 * np.abs(states).max()
    squares = np.square(error[:, at, moving] / deviation[moving])
    squares = squares[np.isfinite(squares).all(axis=1)]
    return float(np.sqrt(squares.mean())) if len(squares) else np.nan


def strain_error(plant, found: np.ndarray, states: np.ndarray) -> np.ndarray:
    """Root mean square difference of the dolphin's spring strains from the plant's, (count + 1,)."""

    def strain(values):
        points = values[..., :69].reshape(*values.shape[:-1], 23, 3)
        return np.linalg.norm(points[..., plant.pairs[:, 1], :] - points[..., plant.pairs[:, 0], :], axis=-1)

    gap = (strain(found) - strain(states)) / plant.lengths
    return np.sqrt(np.nanmean(np.square(gap), axis=(0, 2)))


def variants(run: Path, name: str, steps: int) -> dict[str, Callable]:
    """Function of state and inputs that emulates, by the variant's name."""
    if name == "dolphin":
        dolphin = load_dolphin(run, steps)
        return {
            f"n{steps}": dolphin.rollout,
            f"n{steps}_regularised": lambda state, inputs: dolphin.rollout(state, inputs, REGULARISATIONS),
        }
    return {f"n{steps}": load_emulator(run, f"{name}_n{steps}", plant_of(name)).rollout}


def measure(run: Path, name: str, super_steps: Sequence[int], trials: int, length: int, horizon: int, seed: int):
    """Metrics by variant and error curves; `length` in physical steps, `horizon` in super-steps."""
    plant, metrics, columns = plant_of(name), {}, {}
    for steps in super_steps:
        count = max(length // steps, horizon)
        states, inputs = motions(plant, steps, count, trials, seed)
        for variant, rollout in variants(run, name, steps).items():
            found, ends = emulated(rollout, states, inputs)
            shown = length // steps
            errors = curve((found - states)[:, : shown + 1])
            told = {
                "diverged_end": np.sum(ends <= shown),
                f"diverged_{horizon}": np.sum(ends <= horizon),
                "mean_error": errors[1:].mean(),
                "end_error": errors[-1],
                "growth": growth(errors),
                "motion": np.abs(states[:, : shown + 1] - states[:, : shown + 1].mean(axis=(0, 1))).mean(),
            }
            if plant.frame != "fixed":
                true = states[:, : shown + 1]
                inner = curve(local_error(plant, found[:, : shown + 1], true))
                told |= {"local_mean_error": inner[1:].mean(), "local_growth": growth(inner)}
                astray = strayed(plant, rollout, true, inputs[:, :shown], steps)
                columns[f"{variant}_plant_error"] = curve(astray - true)
                told |= {"plant_growth": growth(columns[f"{variant}_plant_error"])}
                told |= {"plant_local_growth": growth(curve(local_error(plant, astray, true)))}
            for at in HORIZONS:
                if at <= count:
                    told[f"relative_{at}"] = relative(found - states, states, at)
            columns[f"{variant}_step"] = steps * np.arange(shown + 1)
            columns[f"{variant}_error"] = errors
            if name == "dolphin":
                strains = strain_error(plant, found, states)
                told |= {"strain_error_end": strains[shown], f"strain_error_{horizon}": strains[horizon]}
                columns[f"{variant}_strain"] = strains
            metrics[variant] = {key: float(value) for key, value in told.items()}
    return metrics, columns


def rows_of(name: str, metrics: dict, trials: int, length: int, horizon: int) -> list[dict]:
    """Scorecard rows of one plant."""
    rows, named = [], name.replace("_", " ")
    lengths = {"end": f"{length} steps", f"{horizon}": f"{horizon} super-steps"}
    for variant, told in metrics.items():
        item, place = f"{named} {variant.replace('_', ' ')}", "Fig. 12, Sec. 5.2"
        metric = f"mean absolute error over {length} steps, {trials} trials"
        rows.append(row(item, metric, told["mean_error"], "SI", source="Fig. 12"))
        rows.append(row(item, "the same over the mean absolute motion", told["mean_error"] / told["motion"], "ratio"))
        metric = "error of the last third over the first"
        rows.append(row(item, metric, told["growth"], "ratio", BOUNDED, "max", place))
        if "local_growth" in told:
            rows.append(row(item, "mean absolute error of the local state", told["local_mean_error"], "SI"))
            metric = "error of the local state, last third over the first"
            rows.append(row(item, metric, told["local_growth"], "ratio", BOUNDED, "max", place))
            metric = "the plant's own growth of the emulator's errors of single super-steps"
            rows.append(row(item, metric, told["plant_growth"], "ratio"))
            rows.append(row(item, f"{metric}, local state", told["plant_local_growth"], "ratio"))
        for key, when in lengths.items():
            metric = f"trials of {trials} that diverged in {when}"
            rows.append(row(item, metric, told[f"diverged_{key}"], "1", 0, "max", place if key == "end" else "project"))
        for at in HORIZONS:
            if f"relative_{at}" in told:
                rows.append(row(item, f"relative RMSE after {at} super-steps", told[f"relative_{at}"], "ratio"))
        for key, when in lengths.items():
            if f"strain_error_{key}" in told:
                metric = f"RMS error of spring strains after {when}"
                rows.append(row(item, metric, told[f"strain_error_{key}"], "1", source="Sec. 5.3"))
    if {"n25", "n100"} <= metrics.keys():
        ratio = metrics["n100"]["mean_error"] / metrics["n25"]["mean_error"]
        rows.append(row(named, "error of N100 over that of N25", ratio, "ratio", STEADY, "max", "Sec. 5.2"))
    if {"n50", "n50_regularised"} <= metrics.keys():
        for key, when in lengths.items():
            free, held = (metrics[variant][f"strain_error_{key}"] for variant in ("n50", "n50_regularised"))
            metric = f"strain error with over without regularisation after {when}"
            rows.append(row(named, metric, held / free, "ratio", 1.0, "max", "Sec. 5.3"))
    return rows


def main(argv: Sequence[str] | None = None) -> None:
    """Measure one plant's emulators."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--run", required=True, type=Path, metavar="DIR", help="the run's folder, results/<run>")
    parser.add_argument("--plant", required=True, help="whose emulators")
    parser.add_argument(
        "--super-steps", required=True, type=int, nargs="+", help="physical steps of each emulator's step"
    )
    parser.add_argument("--trials", type=int, default=30, help="(default 30)")
    parser.add_argument("--length", type=int, default=6000, help="physical steps of a trial (default 6000)")
    parser.add_argument("--horizon", type=int, default=1000, help="super-steps of a trial at least (default 1000)")
    parser.add_argument("--seed", type=int, default=7, help="(default 7)")
    parser.add_argument(
        "--out", required=True, type=Path, metavar="DIR", help="for rollout.h5, metrics, rows, run card"
    )
    given = parser.parse_args(argv)
    if min(given.trials, given.length // max(given.super_steps)) < 1:
        raise UserError("at least one trial of one super-step is wanted")
    spec = {"plant": given.plant, "trials": given.trials, "length": given.length, "horizon": given.horizon}
    with RunCard(given.out / "run_card.json", spec, given.seed):
        found = measure(
            given.run, given.plant, given.super_steps, given.trials, given.length, given.horizon, given.seed
        )
        write(given.out, found[0], rows_of(given.plant, found[0], given.trials, given.length, given.horizon), found[1])


if __name__ == "__main__":
    sys.exit(cli.run(main))
