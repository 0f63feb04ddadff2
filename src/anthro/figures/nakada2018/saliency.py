"""What each of the ten vision DNNs sees: how far its answer moves with each photoreceptor."""

import sys
from collections.abc import Sequence
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.colors import LogNorm

from anthro import cli, figures
from anthro.eyes.eye import SIDES
from anthro.eyes.layout import layout
from anthro.eyes.saliency import saliency
from anthro.figures.retina import spots
from anthro.files import read_json, read_shard
from anthro.motor.network import FeedForward

PAIRS = 128  # of the data set, over which is averaged
COLUMNS = {  # a data set, the nets that learn from it but for their side, and how a panel is called
    "eyes_foveation": ("foveation", "foveation"),
    "right_arm_vision": ("right_arm_vision", "right arm"),
    "left_arm_vision": ("left_arm_vision", "left arm"),
    "right_leg_vision": ("right_leg_vision", "right leg"),
    "left_leg_vision": ("left_leg_vision", "left leg"),
}
UNITS = {"foveation": (180 / np.pi, "deg"), "vision": (100.0, "cm")}
SIZE = (7.2, 4.1)
SHOWN = (2, 99.5)  # percentiles of all values of a unit, between which colours differ
FAINTEST = 1e-4  # of the brightest, or by itself where all are dark


def draw(run: Path) -> plt.Figure:
    """Draw the left eye's nets above, the right eye's below.

    Raises
    ------
    UserError
        The run lacks a network or pairs of its data.
    """
    spec = read_json(Path(run) / "specs" / "data" / "eyes_foveation.json")
    receptors = [layout(spec["retina"], side, spec["seed"]) for side in SIDES]
    found = {name: _values(Path(run), name, net, receptors[0].count) for name, (net, _) in COLUMNS.items()}
    figure, axes = plt.subplots(2, len(COLUMNS), figsize=SIZE)
    for kind, (_, unit) in UNITS.items():
        chosen = [name for name in COLUMNS if name.endswith(kind)]
        norm = _norm([found[name] for name in chosen])
        columns = [list(COLUMNS).index(name) for name in chosen]
        for column, name in zip(columns, chosen, strict=True):
            for row, eye in enumerate(receptors):
                title, inches = "" if row else COLUMNS[name][1], SIZE[0] / len(COLUMNS)
                dots = spots(axes[row, column], eye, found[name][row], title, inches, cmap="inferno", norm=norm)
        bar = figure.colorbar(dots, ax=axes[:, columns], location="bottom", shrink=0.9 / len(columns) ** 0.5, aspect=20)
        figures.log_ticks(bar.ax.xaxis)
        bar.set_label(f"{unit} a receptor")
        bar.outline.set_visible(False)
    for row, side in enumerate(SIDES):
        axes[row, 0].set_ylabel(f"{side} eye")
    return figure


def _norm(values: Sequence[np.ndarray]) -> LogNorm:
    """Colours from the lowest to the highest of what is shown; nets that hardly learned may answer to nothing."""
    low, high = np.percentile(values, SHOWN)
    high = max(high, FAINTEST)
    return LogNorm(max(low, FAINTEST * high), high, clip=True)


def _values(run: Path, name: str, net: str, receptors: int) -> np.ndarray:
    """Saliency (2, receptors), deg or cm, of the left and the right eye's net, over pairs spread over a shard."""
    stored, _ = read_shard(run / "data" / name / "shard0000.h5", SIDES)
    scale, _ = UNITS["foveation" if net == "foveation" else "vision"]
    values = []
    for side in SIDES:
        network = FeedForward.load(run / "nets" / f"{net}_{side}" / "weights.h5")
        vectors = stored[side][:: max(1, len(stored[side]) // PAIRS)][:PAIRS]
        values.append(scale * saliency(network, vectors, receptors))
    return np.array(values)


def main(argv: Sequence[str] | None = None) -> None:
    """Run the command line."""
    figures.command(draw, argv, __doc__)


if __name__ == "__main__":
    sys.exit(cli.run(main))
