"""Learning through the emulator beside undirected searches on the plant: evaluations, and seconds, to the same goal."""

import sys
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

from anthro import cli
from anthro.figures import command, log_ticks
from anthro.files import read_json
from anthro.neuroanimator.search import DIRECTED, METHODS
from anthro.neuroanimator.tasks import TASKS


def draw(run: Path) -> plt.Figure:
    """Draw a dot for each seed, hollow where the goal was not reached."""
    figure, table = plt.subplots(1, 2, figsize=(7.0, 2.8))
    methods = [DIRECTED, *METHODS]
    for place, name in enumerate(TASKS):
        found = read_json(Path(run) / "neuroanimator" / "search" / name / "metrics.json")
        for number, method in enumerate(methods):
            for seed, told in enumerate(found[method]):
                where = place + 0.2 * (number - 1.5) + 0.05 * (seed - (len(found[method]) - 1) / 2)
                fill = f"C{number}" if told["reached"] else "white"
                for axes, key in zip(table, ("evaluations", "seconds"), strict=True):
                    axes.plot(where, told[key], "o", color=f"C{number}", markerfacecolor=fill, markersize=4)
    for axes, label in zip(table, ("evaluations of the dynamics", "time (s)"), strict=True):
        axes.set_yscale("log")
        log_ticks(axes.yaxis)
        axes.set_ylabel(label)
        axes.set_xticks(np.arange(len(TASKS)), TASKS)
    handles = [plt.Line2D([], [], color=f"C{n}", marker="o", linestyle="") for n in range(len(methods))]
    handles.append(plt.Line2D([], [], color="0.4", marker="o", markerfacecolor="white", linestyle=""))
    names = [method.replace("_", "-").replace("cma-es", "CMA-ES") for method in methods]
    figure.legend(handles, [*names, "goal not reached"], loc="outside lower center", ncols=len(handles))
    return figure


if __name__ == "__main__":
    sys.exit(cli.run(lambda argv: command(draw, argv, __doc__)))
