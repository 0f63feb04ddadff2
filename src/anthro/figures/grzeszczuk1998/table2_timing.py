"""Table 2: how many times faster emulation is than simulation, on one core in one run, beside the paper's ratios."""

import sys
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.lines import Line2D

from anthro import cli
from anthro.figures import command, log_ticks
from anthro.files import read_json
from anthro.neuroanimator.timing import PAPER


def draw(run: Path) -> plt.Figure:
    """Draw a row for each emulator: one trajectory, a batch's trajectory, the paper."""
    metrics = read_json(Path(run) / "neuroanimator" / "timing" / "table2" / "metrics.json")
    lines = [(name, variant) for name, told in PAPER.items() for variant in told if variant != "simulation"]
    figure, axes = plt.subplots(figsize=(7.0, 3.0))
    for place, (name, variant) in enumerate(lines):
        times, theirs = metrics[name], PAPER[name]
        ratios = {"o": times["simulation"] / times[variant], "D": theirs["simulation"] / theirs[variant]}
        if f"{variant}_batch" in times:
            ratios["s"] = times["simulation"] / times[f"{variant}_batch"]
        axes.plot([min(ratios.values()), max(ratios.values())], [place, place], color="0.8", linewidth=1, zorder=1)
        for marker, ratio in ratios.items():
            axes.plot(ratio, place, marker, color={"o": "C0", "s": "C2", "D": "C1"}[marker], markersize=5)
    names = [f"{name.replace('_', ' ')}, N{variant[1:].replace('_', ', ')}" for name, variant in lines]
    axes.set_yticks(np.arange(len(lines)), names)
    axes.set_ylim(len(lines) - 0.5, -0.5)
    axes.set_xscale("log")
    log_ticks(axes.xaxis)
    axes.set_xlabel("time of simulation over time of emulation")
    labels = (("o", "C0", "one trajectory"), ("s", "C2", "each of 1,024"), ("D", "C1", "paper"))
    handles = [Line2D([], [], color=c, marker=m, linestyle="", label=label) for m, c, label in labels]
    figure.legend(handles=handles, loc="outside lower center", ncols=3)
    return figure


if __name__ == "__main__":
    sys.exit(cli.run(lambda argv: command(draw, argv, __doc__)))
