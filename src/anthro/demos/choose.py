"""Choose the input variant that the other demos use: the one that reached better."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from anthro import cli
from anthro.files import read_json, write_json


def better(metrics: list[dict]) -> str:
    """The inputs with the highest success rate; the smaller median error decides a tie."""
    return min(metrics, key=lambda m: (-m["success_rate"], m["median_error_m"]))["inputs"]


def main(argv=None) -> int:
    parser = argparse.ArgumentParser(prog="anthro.demos.choose", description=__doc__)
    parser.add_argument("--metrics", type=Path, nargs="+", required=True, help="of the reach demos")
    parser.add_argument("--out", type=Path, required=True, help="JSON file to write")
    args = parser.parse_args(argv)
    inputs = better([read_json(path) for path in args.metrics])
    write_json(args.out, {"inputs": inputs})
    print(f"{args.out}: the other demos use {inputs} inputs")
    return 0


if __name__ == "__main__":
    sys.exit(cli.run(main))
