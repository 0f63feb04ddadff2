"""The dolphin with and without regularisation (Sec. 5.3): how far its springs' strains and its masses stray."""

import sys
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

from anthro import cli
from anthro.figures import command, log_ticks
from anthro.figures.grzeszczuk1998.errors import read_errors

NAMES = {"n50": "without", "n50_regularised": "five steps after each super-step"}


def draw(run: Path) -> plt.Figure:
    """Draw both against the super-step; a trial counts until its emulator diverges."""
    columns, metrics = read_errors(run, "dolphin")
    figure, (strain, place) = plt.subplots(1, 2, figsize=(7.0, 3.0))
    for variant, label in NAMES.items():
        strains, error = columns[f"{variant}_strain"], columns[f"{variant}_error"]
        lost = int(max(value for key, value in metrics[variant].items() if key.startswith("diverged")))
        strain.plot(np.arange(1, len(strains)), 100 * strains[1:], label=f"{label}; trials that diverge: {lost}")
        place.plot(np.arange(len(error)), error, label=label)
    strain.set_ylabel("RMS error of spring strains (%)")
    strain.set_yscale("log")
    log_ticks(strain.yaxis)
    place.set_ylabel("mean absolute error (m, m/s)")
    place.set_ylim(0, None)
    for axes in (strain, place):
        axes.set_xlabel("super-step (0.5 s)")
        axes.set_xlim(0, None)
    figure.legend(*strain.get_legend_handles_labels(), loc="outside lower center", ncols=2)
    return figure


if __name__ == "__main__":
    sys.exit(cli.run(lambda argv: command(draw, argv, __doc__)))
