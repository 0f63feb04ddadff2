"""Fig. 14: the objective against the iteration of control learning, with momentum and by plain gradient descent."""

import sys
from pathlib import Path

import matplotlib.pyplot as plt

from anthro import cli
from anthro.figures import command
from anthro.files import read_json
from anthro.neuroanimator.tasks import TASKS, task_of


def draw(run: Path) -> plt.Figure:
    """Draw a panel for each task; a dot where the goal is reached."""
    figure, table = plt.subplots(1, 4, figsize=(7.0, 2.2))
    for axes, name in zip(table, TASKS, strict=True):
        told, task = read_json(Path(run) / "neuroanimator" / "control" / name / "metrics.json"), task_of(name)
        for label, rate, key, reached in (
            ("momentum", task.rate, "costs_momentum", told["reached"]),
            ("plain", task.plain_rate, "costs_plain", told["reached_plain"]),
        ):
            line = axes.plot(told[key], label=f"{label}, rate {rate:g}")[0]
            if reached is not None:
                axes.plot(reached, told[key][reached], "o", color=line.get_color(), markersize=5, clip_on=False)
        axes.set_title(name)
        axes.set_xlabel("iteration")
        axes.set_xlim(0, task.iterations)
        low, high = axes.get_ylim()
        axes.set_ylim(low, high + 0.3 * (high - low))  # room for the legend
        axes.legend(fontsize=6, loc="upper right")
    table[0].set_ylabel("objective (less is better)")
    return figure


if __name__ == "__main__":
    sys.exit(cli.run(lambda argv: command(draw, argv, __doc__)))
