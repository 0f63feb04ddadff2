"""Fig. 11: training progress of the limbs' voluntary networks.

Green training, red validation. A vertical line marks each round of data aggregation: its shards
add states that the network of the round before ran into, so the error starts higher.
"""

import sys
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

from anthro import cli
from anthro.errors import UserError
from anthro.figures import TRAINING, VALIDATION, command, log_ticks
from anthro.learn.curves import read_rounds

PAPER_EPOCHS = {"left_arm": 1865, "right_arm": 1777, "left_leg": 2000, "right_leg": 1850}
PAPER_PANEL = {"left_arm": "a", "right_arm": "b", "left_leg": "c", "right_leg": "d"}
INPUTS = {"paper": "offset, drive", "proprioceptive": "offset, drive, strain"}


def draw_rounds(axes, rounds: list[dict]) -> None:
    """Draw the rounds' loss curves one after another, a line and a number where each begins."""
    before = 0
    for number, losses in enumerate(rounds):
        epoch = before + losses["epoch"]
        first = number == 0
        axes.plot(epoch, losses["train_mse"], color=TRAINING, label="training" if first else None)
        axes.plot(epoch, losses["validation_mse"], color=VALIDATION, label="validation" if first else None)
        if len(rounds) > 1:
            if number:
                axes.axvline(before + 0.5, color="0.55", linewidth=0.8, linestyle=(0, (4, 2)))
            middle = before + 0.5 + len(epoch) / 2
            axes.text(
                middle,
                0.985,
                f"round {number}",
                transform=axes.get_xaxis_transform(),
                ha="center",
                va="top",
                fontsize=6.5,
                color="0.35",
            )
        before += len(epoch)
    axes.set_xlim(0.5, before + 0.5)


def finish(axes, title: str, rounds: list[dict], paper: str) -> None:
    """Add the title, the axes, and the number of epochs beside the paper's."""
    axes.set_yscale("log")
    axes.set_title(title, pad=15)
    axes.set_xlabel("epoch")
    log_ticks(axes.yaxis)
    best = np.argmin(rounds[-1]["validation_mse"])
    epochs = sum(len(losses["epoch"]) for losses in rounds)
    unexplained = rounds[-1]["unexplained_variance"][best]
    axes.annotate(
        f"{epochs:,} epochs, unexplained variance {unexplained:.3f}{paper}",
        (0, 1), (0, 4), xycoords="axes fraction", textcoords="offset points", fontsize=7, color="0.3",
    )  # fmt: skip
    axes.legend(loc="lower left")


def draw(run: Path):
    """Draw one panel for each voluntary network of the run."""
    nets = [path for path in sorted((run / "nets").glob("*_voluntary_*")) if any(path.glob("round*/loss.csv"))]
    if not nets:
        raise UserError(f"{run / 'nets'}: no voluntary network was trained")
    figure, grid = plt.subplots(
        -(-len(nets) // 2), min(2, len(nets)), figsize=(7.0, 3.1 * -(-len(nets) // 2)), squeeze=False, sharey=True
    )
    for axes, net in zip(grid.flat, nets, strict=False):
        limb, _, inputs = net.name.partition("_voluntary_")
        rounds = read_rounds(net)
        draw_rounds(axes, rounds)
        known = inputs == "paper" and limb in PAPER_EPOCHS
        panel = f"({PAPER_PANEL[limb]}) " if known else ""
        paper = f" (paper: {PAPER_EPOCHS[limb]:,} epochs)" if known else ""
        finish(axes, f"{panel}{limb.replace('_', ' ')}: {INPUTS.get(inputs, inputs)}", rounds, paper)
    for axes in grid[:, 0]:
        axes.set_ylabel("mean squared error (1 = variance of labels)")
    for axes in grid.flat[len(nets) :]:
        axes.set_axis_off()
    return figure


if __name__ == "__main__":
    sys.exit(cli.run(lambda argv: command(draw, argv, __doc__)))
