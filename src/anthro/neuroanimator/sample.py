"""Sample state transitions of a plant: ``python -m anthro.neuroanimator.sample --spec FILE --out FILE.h5``.

Grzeszczuk 1998, Sec. 3.4 and Fig. 8: the plant is simulated under typical controls; at times that lie between one and
five super-steps apart, drawn uniformly, its state and inputs and its state a super-step later are recorded. The order
of the examples is then drawn at random.
"""

from __future__ import annotations

import argparse
import itertools
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from anthro import cli
from anthro.errors import UserError
from anthro.files import read_json, write_shard
from anthro.neuroanimator.plants import plant_of
from anthro.neuroanimator.plants.plant import STEP, Plant
from anthro.progress import progress
from anthro.streams import stream

COLUMNS = ("state", "control", "force", "next_state")
LONGEST_LAG = 5  # super-steps


def checked(plant: Plant, state: np.ndarray, time: float) -> np.ndarray:
    """Return a state (n_state,) that is finite.

    Raises
    ------
    UserError
        Naming the plant, the physical step and the variable.
    """
    if not np.isfinite(state).all():
        odd = plant.variables[int(np.flatnonzero(~np.isfinite(state))[0])]
        raise UserError(f"{plant.name}: the simulation diverges at step {round(time / STEP)}: {odd}")
    return state


def transitions(plant: Plant, steps: int, seconds: float, generator: np.random.Generator) -> Iterator[tuple]:
    """Draw examples without end, animation after animation.

    Parameters
    ----------
    plant : Plant
    steps : int
        Physical steps of a super-step.
    seconds : float
        Length of an animation.
    generator : numpy.random.Generator

    Yields
    ------
    state, control, force, next_state : ndarray
        The inputs held over the super-step.
    """
    while True:
        state, pilot, time = plant.start(generator), plant.typical(generator), 0.0
        while time < seconds:
            left = int(generator.integers(steps, LONGEST_LAG * steps + 1))
            recorded = True
            while left:
                now = min(left, steps)
                control, force = pilot.at(time, state), plant.push(generator)
                after = checked(plant, plant.step(state, control, force, now), time)
                if recorded:
                    yield state, control, force, after
                state, time, left, recorded = after, time + now * STEP, left - now, False


def sample(spec: dict) -> dict[str, np.ndarray]:
    """Sample what a spec asks for: ``plant``, ``super_step``, ``seconds`` of an animation, ``examples``, ``seed``.

    Returns
    -------
    dict of str to ndarray
        `COLUMNS`, (examples, width) each.

    Raises
    ------
    UserError
        Naming the key that is missing, the plant that is unknown, or where a simulation diverges.
    """
    try:
        plant, steps, count = plant_of(spec["plant"]), spec["super_step"], spec["examples"]
        name = f"{spec['plant']}_n{steps}"
        drawn = transitions(plant, steps, spec["seconds"], stream(spec["seed"], f"neuroanimator/{name}"))
    except KeyError as missing:
        raise UserError(f"the spec has no {missing}") from None
    rows = list(itertools.islice(progress(drawn, count, f"{name} examples"), count))
    order = stream(spec["seed"], f"neuroanimator/{name}/order").permutation(count)
    return {column: np.array(values)[order] for column, values in zip(COLUMNS, zip(*rows, strict=True), strict=True)}


def main(argv: Sequence[str] | None = None) -> None:
    """Sample one plant at one super-step."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--spec", required=True, type=Path, metavar="FILE", help="what to sample (JSON)")
    parser.add_argument("--out", required=True, type=Path, metavar="FILE", help="examples, .h5")
    given = parser.parse_args(argv)
    spec = read_json(given.spec)
    write_shard(given.out, sample(spec), {"plant": spec["plant"], "super_step": spec["super_step"]})


if __name__ == "__main__":
    sys.exit(cli.run(main))
