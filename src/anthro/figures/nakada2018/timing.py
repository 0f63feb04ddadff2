"""Time of what runs online and offline, limb by limb, beside the papers' numbers."""

import sys
from collections.abc import Sequence
from pathlib import Path

import matplotlib.pyplot as plt
from matplotlib.lines import Line2D

from anthro import cli, figures
from anthro.errors import UserError
from anthro.files import read_json

LIMBS = {
    "right_arm": ("arm", "#0072B2"),
    "right_leg": ("leg", "#009E73"),
    "neck_seated": ("neck, 216 muscles", "#E69F00"),
    "neck": ("neck, 244 muscles", "#CC79A7"),
    "core": ("core", "#D55E00"),
}
PARTS = {
    "controller_paper": "both networks, the paper's inputs",
    "controller_proprioceptive": "both networks, proprioceptive",
    "teacher_label": "teacher: label of a state",
    "inverse_kinematics": "teacher: IK, once a target",
    "voluntary_pair_teacher": "voluntary pair, led by the teacher",
    "voluntary_pair_students": "voluntary pair, led by networks",
    "reflex_pair": "reflex pair",
    "simulator_step": "simulator, 5 ms step",
}
SPREAD = 0.7  # of a row's height that its limbs take


def draw(run: Path) -> plt.Figure:
    """Draw a dot for each limb and part, and the paper's number, where there is one, at the end of a line.

    Raises
    ------
    UserError
        The run's metrics lack a limb or a part.
    """
    path = Path(run) / "demos" / "timing" / "metrics.json"
    metrics = read_json(path)
    figure, axes = plt.subplots(figsize=(7.0, 4.2))
    for number, (limb, (_, colour)) in enumerate(LIMBS.items()):
        for row, part in enumerate(PARTS):
            try:
                entry = metrics[limb][part]
                ours = 1e3 * entry["ours"]
            except KeyError as missing:
                raise UserError(f"{path}: {limb}: no {missing}") from None
            place = row + SPREAD * (number / (len(LIMBS) - 1) - 0.5)
            axes.plot(ours, place, "o", color=colour, markersize=4, zorder=3)
            if "theirs" in entry:
                theirs = 1e3 * entry["theirs"]
                axes.plot([ours, theirs], [place, place], color=colour, linewidth=0.7, alpha=0.6)
                axes.plot(theirs, place, "D", color=colour, markerfacecolor="white", markersize=4, zorder=3)
    axes.set_yticks(range(len(PARTS)), PARTS.values())
    axes.set_yticks([row + 0.5 for row in range(len(PARTS) - 1)], minor=True)
    axes.grid(axis="y", visible=False, which="major")
    axes.grid(axis="y", which="minor", color="0.85", linewidth=0.7)
    axes.tick_params(axis="y", which="both", length=0)
    axes.set_ylim(len(PARTS) - 0.5, -0.5)
    axes.set_xscale("log")
    figures.log_ticks(axes.xaxis)
    axes.set_xlabel("time on one core (ms)")
    handles = [Line2D([], [], color=colour, marker="o", linestyle="", label=name) for name, colour in LIMBS.values()]
    handles += [Line2D([], [], color="0.3", marker="D", markerfacecolor="white", linestyle="", label="paper")]
    figure.legend(handles=handles, loc="outside lower center", ncols=len(handles), columnspacing=1.2, handletextpad=0.2)
    return figure


def main(argv: Sequence[str] | None = None) -> None:
    """Run the command line."""
    figures.command(draw, argv, __doc__)


if __name__ == "__main__":
    sys.exit(cli.run(main))
