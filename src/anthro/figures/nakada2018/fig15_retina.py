"""Fig. 15: where the photoreceptors of both eyes lie."""

import sys
from collections.abc import Sequence
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

from anthro import cli, figures
from anthro.eyes.layout import FIELD_DEG, LAYOUTS, Layout, layout

SEED = 7  # the usual one of a run
FOVEA_DEG = 3.0
OTHERS = {"uniform": "Uniform", "cone_density": "Human cones", "sketching": "Sketching"}
WORDS = {"log_polar": "log-polar", "uniform": "uniform", "cone_density": "cones", "sketching": "sketching"}


def draw(run: Path) -> plt.Figure:
    """Draw the retinas of both eyes; all runs have the same patterns."""
    figure, axes = plt.subplots(2, 4, figsize=(7.0, 4.0))
    left, right = (layout("log_polar", side, SEED) for side in ("left", "right"))
    for place, retina, title in ((axes[0, 0], left, "Left eye"), (axes[0, 1], right, "Right eye")):
        dots(place, retina, FIELD_DEG / 2, f"{title}: {retina.count:,}")
    dots(axes[0, 2], left, FOVEA_DEG, "Left fovea", 3.0)
    dots(axes[0, 3], right, FOVEA_DEG, "Right fovea", 3.0)
    for place, (name, title) in zip(axes[1], OTHERS.items(), strict=False):
        retina = layout(name, "left", SEED)
        dots(place, retina, FIELD_DEG / 2, f"{title}: {retina.count:,}")
    densities(axes[1, 3])
    return figure


def dots(axes: plt.Axes, retina: Layout, reach: float, title: str, size: float = 0.8) -> None:
    """Draw receptors within a reach of the fovea, degrees."""
    place = retina.retina_deg[np.rad2deg(retina.eccentricity) <= 1.5 * reach]
    axes.scatter(*place.T, s=size, c="black", linewidths=0)
    edge = 1.06 * reach
    axes.set(xlim=(-edge, edge), ylim=(-edge, edge), aspect="equal", xticks=[], yticks=[])
    axes.spines[:].set_visible(False)
    axes.set_title(title, fontsize=7.5)
    bar = 30 if reach > 30 else 1
    axes.plot([edge - bar, edge], [-edge, -edge], color="#404040", linewidth=1.5, clip_on=False)
    axes.text(edge - bar / 2, -1.02 * edge, f"{bar}°", ha="center", va="top", fontsize=6.5)


def densities(axes: plt.Axes) -> None:
    """Draw receptors a square degree over the angle from the gaze."""
    edges = np.concatenate([[0.0], np.geomspace(0.5, FIELD_DEG / 2, 16)])
    area = 2 * np.pi * np.rad2deg(np.rad2deg(-np.diff(np.cos(np.deg2rad(edges)))))
    middle = np.concatenate([[0.25], np.sqrt(edges[1:-1] * edges[2:])])
    for name in LAYOUTS:
        count, _ = np.histogram(np.rad2deg(layout(name, "left", SEED).eccentricity), edges)
        density = np.where(count > 0, count, np.nan) / area
        axes.loglog(middle, density, label=WORDS[name])
    axes.set_title("Per square degree", fontsize=7.5)
    axes.set_xlabel("degrees from the gaze")
    axes.legend(fontsize=6, handlelength=1.0, loc="upper right", borderpad=0.0)
    figures.log_ticks(axes.xaxis)
    figures.log_ticks(axes.yaxis)


def main(argv: Sequence[str] | None = None) -> None:
    """Run the command line."""
    figures.command(draw, argv, __doc__)


if __name__ == "__main__":
    sys.exit(cli.run(main))
