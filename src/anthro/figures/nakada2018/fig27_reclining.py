"""Writing while the chair reclines and rises: the ink, and its error beside the chair's angle over time."""

import sys
from collections.abc import Sequence
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from scipy.spatial.transform import Rotation

from anthro import cli, figures
from anthro.figures import drawing


def reclined(base: np.ndarray) -> np.ndarray:
    """Angle (T,) rad by which a root bone leans back from how it began.

    Parameters
    ----------
    base : ndarray (T, 7)
        Position and quaternion (w first); the body faces +x, z is up.
    """
    turned = Rotation.from_quat(base[:, 3:], scalar_first=True)
    up = (turned * turned[0].inv()).apply([0.0, 0.0, 1.0])
    return np.arctan2(-up[:, 0], up[:, 2])


def draw(run: Path) -> plt.Figure:
    """Draw a run's writing on the reclining chair."""
    writing = drawing.read(run, "write_reclining", with_base=True)
    figure = plt.figure(figsize=(7.0, 5.6))
    panels = figure.subplot_mosaic([["text"], ["ink"], ["error"], ["angle"]], height_ratios=[1, 1, 1, 1])
    drawing.given(panels["text"], writing)
    drawing.inked(panels["ink"], writing, "Right finger's ink")
    error, angle = panels["error"], panels["angle"]
    error.set_title("Ink's distance from the path")
    error.plot(writing.time, writing.distance, color="#0072B2")
    error.axhline(writing.rms, color="#808080", linewidth=0.8, linestyle="--")
    error.annotate("RMS", (1.0, writing.rms), (2, 0), ("axes fraction", "data"), "offset points", va="center", size=7)
    error.set_ylim(bottom=0)
    error.set_ylabel("error (cm)")
    error.tick_params(labelbottom=False)
    angle.plot(writing.time, np.degrees(reclined(writing.base)), color="#D55E00")
    angle.set_title("Chair's angle")
    angle.set_ylabel("reclined (deg)")
    angle.set_xlabel("time (s)")
    for axes in (error, angle):
        axes.set_xlim(writing.time[0], writing.time[-1])
    figure.align_ylabels([error, angle])
    drawing.colour_bar(figure, [panels["text"], panels["ink"]])
    return figure


def main(argv: Sequence[str] | None = None) -> None:
    """Run the command line."""
    figures.command(draw, argv, __doc__)


if __name__ == "__main__":
    sys.exit(cli.run(main))
