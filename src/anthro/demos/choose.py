"""Choose the input variant that the other demos use, limb by limb: the one that did its task better."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from anthro import cli
from anthro.errors import UserError
from anthro.files import read_json, write_json


def better(metrics: list[dict]) -> dict[str, str]:
    """Each limb's inputs of the highest success rate; the smaller median error decides a tie."""
    limbs: dict[str, list[dict]] = {}
    for one in metrics:
        limbs.setdefault(one["limb"], []).append(one)
    return {name: min(tried, key=rank)["inputs"] for name, tried in limbs.items()}


def rank(metrics: dict) -> tuple[float, float]:
    """What puts better metrics of a limb's task first: a higher success rate, then a smaller median error."""
    error = next(value for name, value in metrics.items() if name.startswith("median_error_"))
    return -metrics["success_rate"], error


def main(argv=None) -> int:
    parser = argparse.ArgumentParser(prog="anthro.demos.choose", description=__doc__)
    parser.add_argument("--metrics", type=Path, nargs="+", required=True, help="of the limbs' tasks")
    parser.add_argument("--out", type=Path, required=True, help="JSON file to write")
    args = parser.parse_args(argv)
    try:
        choice = better([read_json(path) for path in args.metrics])
    except (KeyError, StopIteration) as error:
        raise UserError(f"--metrics: not those of a limb's task ({error})") from None
    write_json(args.out, choice)
    print(f"{args.out}: the other demos use {', '.join(f'{v} inputs for {k}' for k, v in choice.items())}")
    return 0


if __name__ == "__main__":
    sys.exit(cli.run(main))
