"""What perception loses without head movement, with one eye, and with receptors as dense everywhere."""

import sys
from collections.abc import Sequence
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.ticker import PercentFormatter

from anthro import cli, figures
from anthro.errors import UserError
from anthro.files import read_json

DEMOS = {
    "perception": "whole",
    "perception_no_head": "head at rest",
    "perception_one_eye": "one eye",
    "perception_uniform": "uniform retina",
}
MEASURES = {"foveated": ("foveated in 0.5 s", "#0072B2"), "reached": ("hand within 6 cm", "#D55E00")}
GROUPS = {"still": "o", "swinging": "D"}  # of targets, and their marks
WIDTH = 0.34  # of a bar


def read(run: Path, demo: str) -> dict[str, float]:
    """Read the success rates of a perception demo, those of all targets and of each group that it has.

    Raises
    ------
    UserError
        Naming the file, when it is missing or lacks a rate of all targets.
    """
    path = Path(run) / "demos" / demo / "metrics.json"
    metrics = read_json(path)
    if missing := [name for name in ("targets", *MEASURES) if name not in metrics]:
        raise UserError(f"{path}: no {', '.join(missing)}")
    names = [*MEASURES, *(f"{group}_{name}" for group in GROUPS for name in MEASURES)]
    return {name: float(metrics[name]) for name in ("targets", *names) if name in metrics}


def standard_error(share: float, count: float) -> float:
    """Of a share of so many trials (Agresti and Coull 1998, Am Stat 52:119-126: two successes and failures added)."""
    centre = (share * count + 2) / (count + 4)
    return float(np.sqrt(centre * (1 - centre) / (count + 4)))


def draw(run: Path) -> plt.Figure:
    """Draw both success rates of each condition with their standard errors, and a mark for each group of targets."""
    figure, axes = plt.subplots(figsize=(5.6, 3.0))
    for place, demo in enumerate(DEMOS):
        rates = read(run, demo)
        for aside, (name, (label, colour)) in zip((-0.5, 0.5), MEASURES.items(), strict=True):
            at, label = place + 1.06 * WIDTH * aside, None if place else label
            axes.bar(at, rates[name], WIDTH, color=colour, alpha=0.75, label=label)
            spread = standard_error(rates[name], rates["targets"])
            axes.errorbar(at, rates[name], spread, color="#404040", elinewidth=0.9)
            for shift, (group, marker) in zip((-0.25, 0.25), GROUPS.items(), strict=True):
                if f"{group}_{name}" in rates:
                    look = {"color": "white", "markeredgecolor": "#202020", "markersize": 4, "linestyle": ""}
                    label = None if place or aside > 0 else f"{group} targets"
                    axes.plot(at + shift * WIDTH, rates[f"{group}_{name}"], marker, **look, label=label, clip_on=False)
    axes.set_xticks(range(len(DEMOS)), DEMOS.values())
    axes.grid(axis="x", visible=False)
    axes.set_ylim(0, 1)
    axes.yaxis.set_major_formatter(PercentFormatter(1.0, symbol=" %"))
    axes.set_ylabel("trials")
    figure.legend(loc="outside lower center", ncols=4)
    return figure


def main(argv: Sequence[str] | None = None) -> None:
    """Run the command line."""
    figures.command(draw, argv, __doc__)


if __name__ == "__main__":
    sys.exit(cli.run(main))
