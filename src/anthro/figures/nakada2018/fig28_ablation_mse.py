"""Fig. 28: validation error of networks of various shapes (a, b) and depths (c, d).

Left all epochs; right a close-up of the lower errors, with the level that counts as converged
(5 % above the best of the table's worst net) and a dot where each net reaches it.
"""

import sys
from pathlib import Path

import matplotlib.pyplot as plt

from anthro import cli
from anthro.figures import command, log_ticks
from anthro.learn.curves import Trial, common_level, read_table
from anthro.learn.findings import DEPTHS, SHAPES, by_number

SHAPE_LOOKS = {
    1: ("#9ecae1", "-"),
    2: ("#3182bd", "-"),
    3: ("#08306b", "-"),
    4: ("#fdae6b", "--"),
    5: ("#d94801", "--"),
    6: ("#7f2704", "--"),
    7: ("#74c476", ":"),
    8: ("#006d2c", ":"),
    9: ("#c51b8a", "-."),
}


def name_of(number: int, hidden: tuple[int, ...]) -> str:
    """Return a net's number and shape, such as ``(2) 5 x 300``."""
    same = len(set(hidden)) == 1
    return f"({number}) {len(hidden)} × {hidden[0]}" if same else f"({number}) {'-'.join(map(str, hidden))}"


def draw_table(whole, detail, nets: dict[int, Trial], looks: dict[int, tuple]) -> None:
    """Draw a table's validation curves: all of them, and the lower errors."""
    level = common_level(list(nets.values()))
    for number, net in nets.items():
        colour, line = looks[number]
        for axes in (whole, detail):
            axes.plot(
                net.losses["epoch"],
                net.losses["validation_mse"],
                color=colour,
                linestyle=line,
                label=name_of(number, net.hidden),
            )
        reached = min(net.epochs_to(level), len(net.losses["epoch"]))
        detail.plot(
            reached,
            level if reached > 1 else net.losses["validation_mse"][0],
            "o",
            color=colour,
            markeredgecolor="white",
            markeredgewidth=0.6,
            markersize=5,
            zorder=4,
            clip_on=False,
        )
    detail.axhline(level, color="0.4", linewidth=0.8, linestyle=(0, (4, 2)), zorder=1)
    detail.annotate(
        "converged",
        (0.995, level),
        xycoords=detail.get_yaxis_transform(),
        ha="right",
        va="bottom",
        fontsize=6.5,
        color="0.3",
        xytext=(0, 1),
        textcoords="offset points",
    )
    detail.set_ylim(0.96 * min(net.best for net in nets.values()), 1.5 * level)
    for axes in (whole, detail):
        axes.set_yscale("log")
        axes.set_xlabel("epoch")
        axes.set_xlim(1, max(2, *(net.losses["epoch"][-1] for net in nets.values())))
        log_ticks(axes.yaxis)
    whole.set_ylabel("validation MSE (1 = variance of labels)")


def draw(run: Path):
    """Draw the shapes above, the depths below."""
    shapes = by_number(read_table(run, "shapes"), SHAPES)
    depths = by_number(read_table(run, "depths"), DEPTHS)
    tones = plt.get_cmap("viridis")
    depth_looks = {number: (tones(0.95 * (number - 1) / (len(DEPTHS) - 1)), "-") for number in depths}
    figure, grid = plt.subplots(2, 2, figsize=(9.0, 6.0))
    titles = ("(a) shapes", "(b) shapes, lower errors"), ("(c) depths", "(d) depths, lower errors")
    for row, nets, looks, names in zip(grid, (shapes, depths), (SHAPE_LOOKS, depth_looks), titles, strict=True):
        draw_table(*row, nets, looks)
        for axes, name in zip(row, names, strict=True):
            axes.set_title(name)
        row[1].legend(loc="center left", bbox_to_anchor=(1.01, 0.5), title="hidden layers", alignment="left")
    return figure


if __name__ == "__main__":
    sys.exit(cli.run(lambda argv: command(draw, argv, __doc__)))
