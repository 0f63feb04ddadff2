"""Turn a plant's examples into pairs for one network, through its operators (Grzeszczuk 1998, Fig. 9).

``python -m anthro.neuroanimator.present --spec FILE --examples FILE.h5 --out DIR`` writes ``pairs.h5``, groups of
variables with zero mean and unit variance, and ``operators.h5``, the means and scales.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from anthro import cli
from anthro.errors import UserError
from anthro.files import read_json, read_shard, write_shard
from anthro.neuroanimator.operators import FACTORS, Chain, Frame, Normalise, StateChange, ToLocal, ToWorld
from anthro.neuroanimator.plants import plant_of
from anthro.neuroanimator.plants.plant import Group, Plant
from anthro.neuroanimator.sample import COLUMNS
from anthro.neuroanimator.segments import CENTRES, COUNT, Segments

PARTS = ("whole", "global", *(f"local{j}" for j in range(1, COUNT + 1)))


def groups_of(plant: Plant, part: str) -> tuple[tuple[Group, ...], tuple[Group, ...]]:
    """Groups of a network's inputs and outputs; outputs are changes of what is named.

    Raises
    ------
    UserError
        When the part is not one of `PARTS`.
    """
    if part not in PARTS:
        raise UserError(f"part {part!r} is not one of {', '.join(PARTS)}")
    driven = plant.force + plant.control
    if part == "whole":
        return plant.state + driven, plant.state
    segments = Segments(plant)
    if part == "global":
        return segments.groups + driven, segments.groups
    width = 3 * int(segments.counts[int(part[5:]) - 1])
    own = tuple(Group(name, ("",) * width, unit) for name, unit in (("mass_place", "m"), ("mass_velocity", "m/s")))
    centres = (("centre_place", "m"), ("centre_velocity", "m/s"))
    return (*own, *(Group(name, ("",) * (CENTRES // 2), unit) for name, unit in centres), *driven), own


def raw_pairs(plant: Plant, part: str, examples: dict[str, np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
    """Return inputs and outputs of a network in local coordinates and physical units, (n, n_in) and (n, n_out)."""
    state, after = examples["state"], examples["next_state"]
    driven = np.concatenate([examples["force"], examples["control"]], axis=1)
    if part.startswith("local"):
        segments, j = Segments(plant), int(part[5:]) - 1
        frames, local = segments.split(state)
        _, later = segments.split(after, frames)
        place = segments.places[j]
        told = np.concatenate([segments.local_inputs(frames, local, j), driven], axis=1)
        return told, later[:, place] - local[:, place]
    rest = plant.rest
    if part == "global":
        segments = Segments(plant)
        state, _ = segments.split(state)
        after, rest = segments.split(after, state)[0], segments.rest
    frame = Frame(plant.frame, rest)
    changes = Chain(ToWorld(frame), StateChange(frame)).invert(after, state)
    return ToLocal(frame).apply(np.concatenate([state, driven], axis=1), state), changes


def present(spec: dict, examples: dict[str, np.ndarray]) -> tuple[dict[str, np.ndarray], dict[str, np.ndarray]]:
    """Return a network's pairs, a column for each group, and its operators' factors.

    Raises
    ------
    UserError
        When the spec's columns are not the plant's groups, or there are too few examples.
    """
    plant = plant_of(spec["plant"])
    told, answered = groups_of(plant, spec["part"])
    names = [group.name for group in told], [f"{group.name}_change" for group in answered]
    if names != (spec["inputs"], spec["outputs"]):
        raise UserError(f"{spec['name']}: inputs and outputs are {', '.join(names[0])} and {', '.join(names[1])}")
    if len(examples["state"]) < spec["rows"]:
        raise UserError(f"{spec['name']}: {spec['rows']} examples wanted, there are {len(examples['state'])}")
    examples = {name: values[: spec["rows"]] for name, values in examples.items()}
    pairs, factors = {}, {}
    both = zip(("input", "output"), raw_pairs(plant, spec["part"], examples), (told, answered), names, strict=True)
    for side, values, groups, columns in both:
        sizes = [group.size for group in groups]
        operator = Normalise.fit(values, sizes)
        parts = np.split(operator.apply(values), np.cumsum(sizes)[:-1], axis=1)
        pairs |= dict(zip(columns, parts, strict=True))
        factors |= {f"{side}_mean": operator.mean, f"{side}_scale": operator.scale}
    return pairs, {name: factors[name] for name in FACTORS}


def main(argv: Sequence[str] | None = None) -> None:
    """Make one network's pairs."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--spec", required=True, type=Path, metavar="FILE", help="the network (JSON)")
    parser.add_argument("--examples", required=True, type=Path, metavar="FILE", help="of its plant, .h5")
    parser.add_argument("--out", required=True, type=Path, metavar="DIR", help="for pairs.h5 and operators.h5")
    given = parser.parse_args(argv)
    spec = read_json(given.spec)
    examples, attrs = read_shard(given.examples, COLUMNS)
    if (attrs["plant"], attrs["super_step"]) != (spec["plant"], spec["super_step"]):
        raise UserError(f"{given.examples}: of {attrs['plant']} at {attrs['super_step']} steps, not of {spec['name']}")
    pairs, factors = present(spec, examples)
    write_shard(given.out / "operators.h5", factors)
    write_shard(given.out / "pairs.h5", pairs)


if __name__ == "__main__":
    sys.exit(cli.run(main))
