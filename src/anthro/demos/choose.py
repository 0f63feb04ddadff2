"""Choose the input variant that the other demos use, limb by limb: the one that did better on validation targets."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from anthro import cli, registry
from anthro.errors import UserError
from anthro.files import read_json, write_json


def better(selections: dict[str, dict]) -> dict[str, str]:
    """Each limb's inputs of the highest success rate; the smaller median error decides a tie.

    Parameters
    ----------
    selections : of each trained voluntary net its ``selection.json``; a mirrored limb takes the choice of its twin.
    """
    result = {}
    for limb in registry.LIMBS.values():
        trained = limb if limb.nets[registry.INPUTS[0]] in selections else registry.limb(limb.mirror_of)
        found = {inputs: selections[trained.nets[inputs]] for inputs in registry.INPUTS}
        result[limb.name] = min(found, key=lambda inputs: rank(found[inputs]["rounds"][found[inputs]["kept"]]))
    return result


def rank(metrics: dict) -> tuple[float, float]:
    """What puts better metrics of a limb's task first: a higher success rate, then a smaller median error."""
    error = next(value for name, value in metrics.items() if name.startswith("median_error_"))
    return -metrics["success_rate"], error


def main(argv=None) -> int:
    parser = argparse.ArgumentParser(prog="anthro.demos.choose", description=__doc__)
    parser.add_argument("--selections", type=Path, nargs="+", required=True, help="nets/<net>/selection.json of nets")
    parser.add_argument("--out", type=Path, required=True, help="JSON file to write")
    args = parser.parse_args(argv)
    try:
        choice = better({path.parent.name: read_json(path) for path in args.selections})
    except (KeyError, IndexError, TypeError, StopIteration, UserError) as error:
        raise UserError(f"--selections: not those of the voluntary nets ({error})") from None
    write_json(args.out, choice)
    print(f"{args.out}: the other demos use {', '.join(f'{v} inputs for {k}' for k, v in choice.items())}")
    return 0


if __name__ == "__main__":
    sys.exit(cli.run(main))
