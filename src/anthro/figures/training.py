"""Panels of training progress: error against epoch over all rounds of aggregation, a line style for each variant."""

from dataclasses import dataclass
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.lines import Line2D
from matplotlib.ticker import MaxNLocator

from anthro.figures import TRAINING, VALIDATION, log_ticks
from anthro.files import read_shard
from anthro.learn.curves import read_rounds

INPUTS = {"paper": "the paper's inputs", "proprioceptive": "strains added"}
STYLES = ("-", (0, (3, 1.2)))
ERROR = "mean squared error (1 = variance of labels)"


@dataclass(frozen=True)
class Curve:
    """A net's losses over all its rounds of aggregation.

    Attributes
    ----------
    label : str
        What sets it apart from the panel's other curves.
    rounds : list of dict
        Columns of ``loss.csv``, oldest round first.
    mirrored_from : str
        The net that was trained in its place; "" if it was trained itself.
    """

    label: str
    rounds: list[dict[str, np.ndarray]]
    mirrored_from: str = ""

    @property
    def epochs(self) -> int:
        """Epochs over all rounds."""
        return sum(len(losses["epoch"]) for losses in self.rounds)

    @property
    def unexplained(self) -> float:
        """Unexplained variance of the epoch whose weights the last round kept."""
        last = self.rounds[-1]
        return float(last["unexplained_variance"][np.argmin(last["validation_mse"])])


def read_curve(run: Path, net: str, label: str) -> Curve:
    """Read a net's losses; those of its twin, if it is mirrored (its ``weights.h5`` says so).

    Raises
    ------
    UserError
        Naming the folder, when the net was neither trained nor mirrored.
    """
    folder = run / "nets" / net
    if (folder / "weights.h5").is_file() and not any(folder.glob("round*/loss.csv")):
        source = read_shard(folder / "weights.h5", ())[1].get("mirrored_from")
        if source:
            return Curve(label, read_rounds(run / "nets" / source), source)
    return Curve(label, read_rounds(folder))


def voluntary_curves(run: Path, limb: str) -> list[Curve]:
    """Read both variants of a limb's voluntary net, the paper's inputs first."""
    return [read_curve(run, f"{limb}_voluntary_{inputs}", label) for inputs, label in INPUTS.items()]


def draw_panel(axes, title: str, curves: list[Curve], pad: float) -> None:
    """Draw training and validation errors of one or two nets, and a line where a round begins.

    The title stands `pad` points above the axes, so that all panels of a figure have it at one height.
    """
    for curve, style in zip(curves, STYLES, strict=False):
        before = 0
        for number, losses in enumerate(curve.rounds):
            epoch = before + losses["epoch"]
            marker = "." if len(epoch) == 1 else None
            for column, colour in (("train_mse", TRAINING), ("validation_mse", VALIDATION)):
                axes.plot(epoch, losses[column], color=colour, linestyle=style, marker=marker)
            if number:
                axes.axvline(before + 0.5, color="0.6", linewidth=0.7, linestyle=(0, (1, 2)), zorder=1)
            before += len(epoch)
    axes.set_xlim(0.5, max(curve.epochs for curve in curves) + 0.5)
    axes.set_yscale("log")
    log_ticks(axes.yaxis)
    axes.xaxis.set_major_locator(MaxNLocator(8, integer=True, steps=(1, 2, 5, 10)))
    axes.set_xlabel("epoch")
    axes.set_title(title, pad=pad)
    axes.annotate(
        "\n".join(told(curves)), (0, 1), (0, 4), xycoords="axes fraction", textcoords="offset points",
        fontsize=7, color="0.3", va="bottom",
    )  # fmt: skip


def told(curves: list[Curve]) -> list[str]:
    """Return what is said above a panel: whose training it is, if a twin's, and what each net came to."""
    lines = [
        (f"{curve.label}: " if curve.label else "")
        + f"{curve.epochs:,} epochs, unexplained variance {curve.unexplained:.2g}"
        for curve in curves
    ]
    if twin := curves[0].mirrored_from:
        limb = twin.partition("_voluntary")[0].removesuffix("_reflex").replace("_", " ")
        lines.insert(0, f"mirrored: the {limb}'s training")
    return lines


def legend(figure, labels: list[str]) -> None:
    """Put one legend below all panels: a colour for each side of the data, a line for each label."""
    handles = [
        Line2D([], [], color=TRAINING, label="training"),
        Line2D([], [], color=VALIDATION, label="validation"),
        *(
            Line2D([], [], color="0.3", linestyle=style, label=label)
            for label, style in zip(labels, STYLES, strict=False)
            if label
        ),
    ]
    figure.legend(handles=handles, loc="outside lower center", ncols=len(handles))


def draw_panels(panels: dict[str, list[Curve]], columns: int = 2):
    """Draw a panel for each title, with one legend.

    Parameters
    ----------
    panels : dict of str to list of Curve
        One or two curves for each title; all panels have the same labels.
    columns : int
        Panels side by side.

    Returns
    -------
    matplotlib.figure.Figure
    """
    rows = -(-len(panels) // columns)
    width = 4.6 if columns == 1 else 7.2
    figure, grid = plt.subplots(rows, columns, figsize=(width, 0.35 + 2.85 * rows), squeeze=False)
    pad = 7 + 9 * max(len(told(curves)) for curves in panels.values())
    for axes, (title, curves) in zip(grid.flat, panels.items(), strict=False):
        draw_panel(axes, title, curves, pad)
    for axes in grid.flat[len(panels) :]:
        axes.remove()
    for row in grid:
        row[0].set_ylabel(ERROR)
    legend(figure, [curve.label for curve in next(iter(panels.values()))])
    return figure
