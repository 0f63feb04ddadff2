"""Copy a run's scorecard, costs, figures, videos, checks, metrics and run cards to ``results/reference/``."""

import argparse
import csv
import shutil
import sys
from collections import defaultdict
from collections.abc import Sequence
from pathlib import Path

from anthro import cli
from anthro.errors import UserError
from anthro.files import atomic
from anthro.runcard import RunCard

SUFFIXES = (".png", ".mp4")


def seconds_by_stage(run: Path) -> dict[str, float]:
    """Seconds of wall time of a run's jobs, from their benchmarks, summed over each stage."""
    total: dict[str, float] = defaultdict(float)
    benchmarks = run / "benchmarks"
    for path in sorted(benchmarks.rglob("*.tsv")):
        with path.open(newline="", encoding="utf-8") as file:
            total[path.relative_to(benchmarks).parts[0]] += sum(
                float(row["s"]) for row in csv.DictReader(file, delimiter="\t")
            )
    return {stage: round(seconds, 1) for stage, seconds in total.items()}


def copy(run: Path, out: Path) -> list[str]:
    """Copy what is worth committing; the names of what was copied.

    Raises
    ------
    UserError
        When the run has no scorecard.
    """
    scorecard = run / "scorecard.csv"
    if not scorecard.is_file():
        raise UserError(f"{scorecard}: no such file; finish the run first")
    figures = sorted(path for path in (run / "figures").rglob("*") if path.suffix in SUFFIXES)
    names = {"scorecard.csv": scorecard} | {f"figures/{path.name}": path for path in figures}
    names |= {f"checks/{path.parts[-3]}.json": path for path in sorted(run.glob("body/*/check/report.json"))}
    names |= {f"demos/{path.parts[-2]}.json": path for path in sorted(run.glob("demos/*/metrics.json"))}
    names |= {f"selections/{path.parts[-2]}.json": path for path in sorted(run.glob("nets/*/selection.json"))}
    cards = {
        path.relative_to(run).parent / path.name.removesuffix("run_card.json").rstrip("."): path
        for path in sorted(run.rglob("*run_card.json"))
    }
    names |= {f"cards/{part}.json": path for part, path in cards.items()}
    names |= {path.name: path for path in [run / "cost.csv"] if path.is_file()}
    for name, source in names.items():
        with atomic(out / name) as partial:
            shutil.copyfile(source, partial)
    return list(names)


def main(argv: Sequence[str] | None = None) -> None:
    """Copy and write the run card."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--run", required=True, type=Path, metavar="DIR", help="the run's folder, results/<run>")
    parser.add_argument("--out", type=Path, default=Path("results/reference"), metavar="DIR", help="where to")
    given = parser.parse_args(argv)
    with RunCard(given.out / "run_card.json", spec={"run": given.run.name}) as card:
        copied = copy(given.run, given.out)
        card.note(files=copied, job_seconds=seconds_by_stage(given.run))
    print(f"{given.out}: {len(copied)} files of {given.run}")


if __name__ == "__main__":
    sys.exit(cli.run(main))
