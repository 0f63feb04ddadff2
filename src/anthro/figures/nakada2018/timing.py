"""Time of a control step: networks online beside the teacher and the paper's IK, ID and MO."""

import sys
from collections.abc import Sequence
from pathlib import Path

import matplotlib.pyplot as plt

from anthro import cli, figures
from anthro.files import read_json

BARS = (
    ("both_networks_paper_s", "both networks, the paper's inputs", "#0072B2"),
    ("both_networks_proprioceptive_s", "both networks, proprioceptive", "#0072B2"),
    ("teacher_label_s", "teacher: two poses' ID and MO", "#D55E00"),
    ("appendix_b_label_s", "teacher, App. B: PD, ID, MO", "#D55E00"),
    ("inverse_kinematics_s", "teacher: IK, once a target", "#D55E00"),
    ("simulator_step_s", "simulator, 5 ms step", "#009E73"),
)
PAPER = (
    (1e-3, "paper: networks, under 1 ms", "#0072B2"),
    (0.120, "paper: IK, ID, MO, 120 ms at least", "#D55E00"),
    (0.230, "paper: IK, ID, MO, 230 ms at most", "#D55E00"),
)


def draw(run: Path) -> plt.Figure:
    """Draw horizontal bars on a logarithmic axis, ours full and the paper's hatched."""
    metrics = read_json(Path(run) / "demos" / "timing" / "metrics.json")
    ours = [(metrics[key], label, colour) for key, label, colour in BARS]
    figure, axes = plt.subplots(figsize=(6.0, 3.0))
    entries = [*((*bar, "") for bar in ours), *((*bar, "////") for bar in PAPER)]
    for place, (seconds, _, colour, hatch) in enumerate(entries):
        face = "white" if hatch else colour
        axes.barh(place, 1e3 * seconds, left=0, color=face, edgecolor=colour, hatch=hatch, height=0.7)
        text = f"{1e3 * seconds:.3g} ms"
        axes.text(1.12e3 * seconds, place, text, va="center", fontsize=6.5)
    axes.set_yticks(range(len(entries)), [label for _, label, _, _ in entries])
    axes.invert_yaxis()
    axes.set_xscale("log")
    axes.set_xlim(1e-2, 1e3)
    axes.set_xlabel("time a control step, one core (ms)")
    return figure


def main(argv: Sequence[str] | None = None) -> None:
    """Run the command line."""
    figures.command(draw, argv, __doc__)


if __name__ == "__main__":
    sys.exit(cli.run(main))
