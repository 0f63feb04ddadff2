"""Check a built body: ``python -m anthro.body.check --variant zhou2021 --body DIR --out DIR``.

Writes rows.json (rows for the scorecard), report.json (all details) and run_card.json, and prints the rows.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from pathlib import Path

from anthro import cli
from anthro.body.checks import CHECKS
from anthro.body.checks.outcome import Outcome
from anthro.body.checks.subject import Options, Subject
from anthro.errors import UserError
from anthro.files import write_json
from anthro.runcard import RunCard
from anthro.scorecard import judge


def select(names: list[str] | None) -> list[str]:
    """The checks asked for, all when None; UserError lists the known ones."""
    if unknown := [name for name in names or () if name not in CHECKS]:
        raise UserError(f"unknown check {unknown[0]!r}: known are {', '.join(CHECKS)}")
    return [name for name in CHECKS if names is None or name in names]


def run(subject: Subject, names: list[str]) -> dict[str, Outcome]:
    """Run checks by name, telling on stderr which one and for how long."""
    found = {}
    for name in names:
        print(f"{name} ...", file=sys.stderr, flush=True)
        started = time.perf_counter()
        found[name] = CHECKS[name](subject)
        print(f"{name}: {time.perf_counter() - started:.1f} s", file=sys.stderr, flush=True)
    return found


def table(rows: list[dict]) -> str:
    """Rows as aligned text: verdict, item, metric, value, target."""
    lines = []
    signs = {"max": "<=", "min": ">=", "equal": "=", "info": ""}
    for row in rows:
        target = "" if row["target"] is None else f"{signs[row['sense']]} {row['target']:g}"
        value = f"{row['value']:.4g} {row['unit'] if row['unit'] != '1' else ''}".strip()
        verdict = judge(row)["status"] or "info"
        lines.append((verdict, row["item"].partition(": ")[2], row["metric"], value, target))
    widths = [max(len(line[k]) for line in lines) for k in range(5)] if lines else []
    return "\n".join("  ".join(cell.ljust(w) for cell, w in zip(line, widths, strict=True)).rstrip() for line in lines)


def _arguments() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="anthro.body.check", description=__doc__.partition("\n")[0])
    parser.add_argument("--variant", required=True, help="zhou2021, nakada2018 or right_arm")
    parser.add_argument("--body", type=Path, required=True, help="folder that anthro.body.build wrote")
    parser.add_argument("--tables", type=Path, default=Path("config/body"), help="anatomy tables")
    parser.add_argument("--out", type=Path, required=True, help="folder to write")
    parser.add_argument("--json", action="store_true", help="print the judged rows as JSON")
    parser.add_argument("--poses", type=int, default=20000, help="random postures of the path check")
    parser.add_argument("--seconds", type=float, default=60.0, help="length of a start of the stability check")
    parser.add_argument("--starts", type=int, default=20, help="starts of the stability check in each mode")
    parser.add_argument("--jobs", type=int, default=1, help="processes")
    parser.add_argument("--seed", type=int, default=1, help="seed of all random draws")
    parser.add_argument("--only", nargs="+", metavar="NAME", help=f"some of {', '.join(CHECKS)}")
    return parser


def main(argv=None) -> int:
    args = _arguments().parse_args(argv)
    names = select(args.only)
    for name in ("poses", "seconds", "starts", "jobs"):
        if not getattr(args, name) > 0:
            raise UserError(f"--{name}: {getattr(args, name)} is not a positive number")
    if not args.tables.is_dir():
        raise UserError(f"{args.tables}: no such folder of anatomy tables")
    options = Options(args.seed, args.poses, args.seconds, args.starts, args.jobs, args.out)
    spec = {"variant": args.variant, "checks": names, "poses": args.poses, "seconds": args.seconds}
    with RunCard(args.out / "run_card.json", spec | {"starts": args.starts}, args.seed) as card:
        found = run(Subject.load(args.variant, args.body, args.tables, options), names)
        rows = [row for outcome in found.values() for row in outcome.rows]
        judged = [judge(row) for row in rows]
        write_json(args.out / "rows.json", rows)
        write_json(args.out / "report.json", {name: outcome.details for name, outcome in found.items()})
        counts = {verdict: sum(row["status"] == verdict for row in judged) for verdict in ("pass", "near", "miss")}
        card.note(**counts)
    print(json.dumps(judged, indent=1) if args.json else table(rows))
    print(f"{args.variant}: " + ", ".join(f"{n} {verdict}" for verdict, n in counts.items()), file=sys.stderr)
    return 0


if __name__ == "__main__":
    sys.exit(cli.run(main))
