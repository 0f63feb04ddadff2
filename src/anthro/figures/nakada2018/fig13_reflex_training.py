"""Fig. 13: training progress of a limb's reflex network. Green training, red validation."""

import sys
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

from anthro import cli
from anthro.errors import UserError
from anthro.figures import TRAINING, VALIDATION, command, log_ticks
from anthro.learn.curves import read_rounds


def draw_panel(axes, net: Path) -> None:
    """Draw the loss curves of one reflex network."""
    losses = read_rounds(net)[-1]
    axes.plot(losses["epoch"], losses["train_mse"], color=TRAINING, label="training")
    axes.plot(losses["epoch"], losses["validation_mse"], color=VALIDATION, label="validation")
    best = np.argmin(losses["validation_mse"])
    axes.plot(losses["epoch"][best], losses["validation_mse"][best], "o", color=VALIDATION, label="weights kept")
    axes.set_yscale("log")
    log_ticks(axes.yaxis)
    axes.set_title(net.name.removesuffix("_reflex").replace("_", " ") + " reflex")
    axes.set_xlabel("epoch")
    axes.set_ylabel("mean squared error (1 = variance of labels)")
    axes.text(
        0.98, 0.97,
        f"ours: {len(losses['epoch']):,} epochs, unexplained\nvariance {losses['unexplained_variance'][best]:.2g}\n"
        "paper: 1,200 to 1,600 epochs",
        transform=axes.transAxes, ha="right", va="top", fontsize=7, color="0.25",
    )  # fmt: skip
    axes.legend(loc="lower left")


def draw(run: Path):
    """Draw one panel for each reflex network of the run."""
    nets = [path for path in sorted((run / "nets").glob("*_reflex")) if any(path.glob("round*/loss.csv"))]
    if not nets:
        raise UserError(f"{run / 'nets'}: no reflex network was trained")
    rows = -(-len(nets) // 2)
    width = 4.2 if len(nets) == 1 else 7.0
    figure, grid = plt.subplots(rows, min(2, len(nets)), figsize=(width, 3.0 * rows), squeeze=False)
    for axes, net in zip(grid.flat, nets, strict=False):
        draw_panel(axes, net)
    for axes in grid.flat[len(nets) :]:
        axes.set_axis_off()
    return figure


if __name__ == "__main__":
    sys.exit(cli.run(lambda argv: command(draw, argv, __doc__)))
