"""A butterfly drawn by the left hand's finger and writing by the right one's, beside their given trajectories."""

import sys
from collections.abc import Sequence
from pathlib import Path

import matplotlib.pyplot as plt

from anthro import cli, figures
from anthro.figures import drawing


def draw(run: Path) -> plt.Figure:
    """Draw both drawings of a run, trajectory and ink, each to scale."""
    butterfly, writing = drawing.read(run, "draw_butterfly"), drawing.read(run, "write")
    figure = plt.figure(figsize=(7.0, 5.9))
    panels = figure.subplot_mosaic(
        [["given", "ink"], ["text", "text"], ["writing", "writing"]], height_ratios=[3, 1, 1]
    )
    drawing.given(panels["given"], butterfly)
    drawing.inked(panels["ink"], butterfly, "Left finger's ink")
    drawing.given(panels["text"], writing)
    drawing.inked(panels["writing"], writing, "Right finger's ink")
    drawing.colour_bar(figure, list(panels.values()))
    return figure


def main(argv: Sequence[str] | None = None) -> None:
    """Run the command line."""
    figures.command(draw, argv, __doc__)


if __name__ == "__main__":
    sys.exit(cli.run(main))
