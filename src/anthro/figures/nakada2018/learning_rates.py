"""The two readings of "learning rate 1e-6, step size 1e-3" (Nakada 2018, footnote 1): one net, both rates."""

import sys
from pathlib import Path

import matplotlib.pyplot as plt

from anthro import cli
from anthro.figures import command, log_ticks
from anthro.learn.curves import read_table

COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7")


def draw(run: Path):
    """Draw training and validation error at each rate."""
    trials = sorted(read_table(run, "learning_rates"), key=lambda trial: trial.learning_rate)
    figure, axes = plt.subplots(figsize=(5.0, 3.2))
    for trial, colour in zip(trials, COLOURS, strict=False):
        losses, name = trial.losses, f"{trial.learning_rate:g}"
        axes.plot(losses["epoch"], losses["train_mse"], color=colour, linestyle="--", linewidth=1.0)
        axes.plot(losses["epoch"], losses["validation_mse"], color=colour, label=f"Adam's step size {name}")
        best = losses["unexplained_variance"].min()
        axes.annotate(
            f"unexplained variance {best:.2g}",
            (losses["epoch"][-1], losses["validation_mse"][-1]),
            xytext=(-2, 9),
            textcoords="offset points",
            ha="right",
            fontsize=7,
            color=colour,
        )
    axes.plot([], [], color="0.3", linestyle="--", linewidth=1.0, label="training")
    axes.plot([], [], color="0.3", label="validation")
    axes.set_yscale("log")
    axes.set_xlabel("epoch")
    axes.set_ylabel("mean squared error (1 = variance of labels)")
    axes.set_xlim(1, max(2, *(trial.losses["epoch"][-1] for trial in trials)))
    log_ticks(axes.yaxis)
    axes.legend(loc="lower left")
    return figure


if __name__ == "__main__":
    sys.exit(cli.run(lambda argv: command(draw, argv, __doc__)))
