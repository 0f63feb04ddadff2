"""The scorecard: every measured number beside the paper's, each pass, near or miss."""

import argparse
import csv
import math
import sys
from collections.abc import Iterable, Sequence

from anthro import cli
from anthro.errors import UserError
from anthro.files import atomic, read_json

COLUMNS = ("paper", "item", "metric", "value", "unit", "target", "source", "status")
SENSES = ("max", "min", "equal", "info")
NEAR = 0.2  # a miss by at most this share of the target is "near"


def status(value: float | bool, target: float | bool | None, sense: str) -> str:
    """Judge a value against its target.

    Parameters
    ----------
    value, target : float or bool
        The measured and the wanted number.
    sense : {"max", "min", "equal", "info"}
        Whether the value may be at most, at least or exactly the target, or has none.

    Returns
    -------
    str
        "pass"; "near" when within 20 % of the target; "miss" (a NaN too); "" for "info".
    """
    if sense == "info":
        return ""
    value, target = float(value), float(target)
    if math.isnan(value):
        return "miss"
    gap = {"max": value - target, "min": target - value, "equal": abs(value - target)}[sense]
    if gap <= 0:
        return "pass"
    return "near" if gap <= NEAR * abs(target) else "miss"


def judge(row: dict, source: str = "row") -> dict:
    """Return a row of the scorecard (`COLUMNS`) from a producer's row.

    Raises
    ------
    UserError
        Naming `source`, when a key is missing or unknown, or `sense` is not one of `SENSES`.
    """
    wanted = set(COLUMNS) - {"status"} | {"sense"}
    if row.keys() != wanted:
        odd = ", ".join(sorted(row.keys() ^ wanted))
        raise UserError(f"{source}: a row's keys are {', '.join(sorted(wanted))}; missing or unknown: {odd}")
    if row["sense"] not in SENSES:
        raise UserError(f"{source}: sense {row['sense']!r} is not one of {', '.join(SENSES)}")
    if row["sense"] != "info" and row["target"] is None:
        raise UserError(f"{source}: {row['item']}/{row['metric']} has no target")
    verdict = status(row["value"], row["target"], row["sense"])
    return {name: row[name] for name in COLUMNS[:-1]} | {"status": verdict}


def collect(paths: Iterable[str]) -> list[dict]:
    """Judge all rows of the producers' files, in the order given.

    Raises
    ------
    UserError
        Naming the file, when one is missing, is no list of rows, or repeats an item's metric.
    """
    rows: dict[tuple, dict] = {}
    for path in paths:
        content = read_json(path)
        if not isinstance(content, list):
            raise UserError(f"{path}: a list of rows is wanted")
        for row in content:
            judged = judge(row, path)
            key = (judged["paper"], judged["item"], judged["metric"])
            if key in rows:
                raise UserError(f"{path}: {' / '.join(key)} is in the scorecard already")
            rows[key] = judged
    return list(rows.values())


def _text(value) -> str:
    if isinstance(value, float):
        return f"{value:.4g}"
    return "" if value is None else str(value)


def write(rows: Iterable[dict], path: str) -> None:
    """Write judged rows as CSV, floats with four significant digits."""
    with atomic(path) as partial, open(partial, "w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, COLUMNS, lineterminator="\n")
        writer.writeheader()
        writer.writerows({name: _text(row[name]) for name in COLUMNS} for row in rows)


def main(argv: Sequence[str] | None = None) -> None:
    """Collect the rows and say how many passed."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--run", required=True, help="the run's folder, results/<run>")
    parser.add_argument("--rows", nargs="+", required=True, metavar="FILE", help="rows.json of the producers")
    parser.add_argument("--out", required=True, metavar="FILE", help="scorecard.csv")
    given = parser.parse_args(argv)
    rows = collect(given.rows)
    write(rows, given.out)
    counts = [sum(row["status"] == name for row in rows) for name in ("pass", "near", "miss")]
    print(f"{given.run}: {len(rows)} rows, {counts[0]} pass, {counts[1]} near, {counts[2]} miss")


if __name__ == "__main__":
    sys.exit(cli.run(main))
