"""Solvers of the minimal-effort problem (Nakada 2018, Appendix B): time against accuracy.

Marker: median over the problems of a panel. Whiskers: up to the 95th percentile of time and the
largest error. Open markers: warm start. Torques out of the muscles' reach have no residual to tell
solvers apart; there the error is the distance from the best known activations.
"""

import csv
import sys
from pathlib import Path

import matplotlib.pyplot as plt
from matplotlib.ticker import LogLocator, NullFormatter, NullLocator

from anthro import cli
from anthro.errors import UserError
from anthro.figures import command

LOOKS = {
    "semismooth Newton": ("#D55E00", "o"),
    "proxsuite": ("#0072B2", "s"),
    "DAQP": ("#009E73", "D"),
    "PIQP": ("#CC79A7", "^"),
    "OSQP": ("#404040", "v"),
}
FLOOR = 1e-16  # rounding: errors below it are drawn on it
RESIDUAL, DISTANCE = "torque residual (N m)", "distance from best activations"
PANELS = {
    "arm, in reach": ("(a) arm, 7 × 29", "residual", RESIDUAL),
    "neck size, in reach": ("(b) neck's size, 21 × 216", "residual", RESIDUAL),
    "arm, out of reach": ("(c) arm, torque out of reach", "distance", DISTANCE),
}


def read_comparison(run: Path) -> dict[str, list[dict]]:
    """Read the rows of solver_comparison.csv by group.

    Raises
    ------
    UserError
        Naming the file, when it is missing or lacks a group.
    """
    path = run / "demos" / "solvers" / "solver_comparison.csv"
    if not path.is_file():
        raise UserError(f"{path}: no such file")
    with path.open(newline="") as file:
        rows = list(csv.DictReader(file))
    groups = {name: [row for row in rows if row["group"] == name] for name in PANELS}
    for name, found in groups.items():
        if not found:
            raise UserError(f"{path}: no rows of group {name}")
    return groups


def draw_panel(axes, rows: list[dict], error: str) -> None:
    """Draw one group's solvers."""
    for row in rows:
        name, _, warm = row["solver"].partition(", ")
        colour, marker = LOOKS[name]
        x, right = float(row["median_us"]), float(row["p95_us"])
        low, high = (max(float(row[f"{kind}_{error}"]), FLOOR) for kind in ("median", "max"))
        axes.errorbar(
            x, low, xerr=[[0.0], [right - x]], yerr=[[0.0], [high - low]],
            fmt=marker, color=colour, markersize=5.5, elinewidth=0.9, markeredgewidth=1.1,
            markerfacecolor="white" if warm else colour, label=row["solver"], zorder=3,
        )  # fmt: skip
        if failed := int(row["failed"]):
            axes.annotate(
                f"fails on {failed} of {row['problems']}", (x, low), xytext=(4, -6),
                textcoords="offset points", ha="right", va="top", fontsize=6.5, color=colour,
            )  # fmt: skip
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.set_xlabel("time a problem (µs)")
    axes.yaxis.set_major_locator(LogLocator(numticks=9))
    axes.yaxis.set_minor_locator(NullLocator())
    axes.xaxis.set_minor_formatter(NullFormatter())


def draw(run: Path):
    """Draw the three groups side by side with one legend below."""
    groups = read_comparison(run)
    figure, grid = plt.subplots(1, 3, figsize=(8.0, 3.3))
    for axes, (group, (title, error, label)) in zip(grid, PANELS.items(), strict=True):
        draw_panel(axes, groups[group], error)
        axes.set_title(title, fontsize=8.5)
        axes.set_ylabel(label)
        axes.margins(0.12)
    handles, labels = grid[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=4, columnspacing=1.6)
    return figure


if __name__ == "__main__":
    sys.exit(cli.run(lambda argv: command(draw, argv, __doc__)))
