"""Fig. 29: time an epoch of networks of various shapes (a) and depths (b): median and quartiles."""

import sys
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

from anthro import cli
from anthro.figures import command
from anthro.learn.curves import Trial, read_table
from anthro.learn.findings import DEPTHS, SHAPES, by_number


def shape_label(hidden: tuple[int, ...]) -> str:
    """Return the widths of the hidden layers, shortened where all are equal."""
    return f"{len(hidden)} × {hidden[0]}" if len(set(hidden)) == 1 else "-".join(map(str, hidden))


def draw_panel(axes, nets: dict[int, Trial], highlight: int, tilted: bool) -> None:
    """Draw one bar for each net, its weights above it."""
    seconds = [np.percentile(net.losses["seconds"], (25, 50, 75)) for net in nets.values()]
    low, middle, high = np.array(seconds).T
    colours = ["#c51b8a" if number == highlight else "#3182bd" for number in nets]
    axes.bar(list(nets), middle, 0.7, color=colours)
    axes.errorbar(
        list(nets), middle, (middle - low, high - middle), fmt="none", ecolor="0.25", elinewidth=0.8, capsize=2
    )
    for (number, net), top in zip(nets.items(), high, strict=True):
        count = f"{net.weights / 1e6:.1f}M" if net.weights >= 1e6 else f"{net.weights / 1e3:.0f}k"
        axes.annotate(
            count,
            (number, top),
            ha="center",
            va="bottom",
            fontsize=6.5,
            color="0.3",
            xytext=(0, 2),
            textcoords="offset points",
        )
    labels = [f"({number}) {shape_label(net.hidden)}" for number, net in nets.items()]
    axes.set_xticks(list(nets), labels, rotation=40 if tilted else 0, ha="right", rotation_mode="anchor", fontsize=6.5)
    axes.grid(axis="x", visible=False)
    axes.set_ylim(0, 1.12 * max(high))


def draw(run: Path):
    """Draw the shapes at the left, the depths at the right."""
    shapes = by_number(read_table(run, "shapes"), SHAPES)
    depths = by_number(read_table(run, "depths"), DEPTHS)
    figure, (left, right) = plt.subplots(1, 2, figsize=(8.0, 3.4))
    draw_panel(left, shapes, 9, tilted=True)
    draw_panel(right, depths, 0, tilted=True)
    others = np.mean([net.epoch_seconds for number, net in shapes.items() if number < 9])
    left.set_title("(a) shapes")
    left.text(
        0.02, 0.97,
        f"(9) over the mean of (1) to (8): {shapes[9].epoch_seconds / others:.1f} times\npaper (GPU): 6 to 8 times",
        transform=left.transAxes, va="top", fontsize=7, color="0.25",
    )  # fmt: skip
    right.set_title("(b) depths, about 1,800 hidden units")
    left.set_ylabel("time an epoch (s); weights on top")
    right.set_ylabel("time an epoch (s)")
    return figure


if __name__ == "__main__":
    sys.exit(cli.run(lambda argv: command(draw, argv, __doc__)))
