"""Errors of the vision DNNs on held-out pictures: over the visual field, by distance, and how they are spread."""

import sys
from collections.abc import Sequence
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.colors import LogNorm

from anthro import cli, figures
from anthro.files import read_shard

LIMBS = {"right_arm": "#0072B2", "left_arm": "#56B4E9", "right_leg": "#D55E00", "left_leg": "#E69F00"}
EYES = {"left": "#009E73", "right": "#CC79A7"}
FIELD_DEG, CELL_DEG = 40.0, 10.0
LEAST = 3  # pictures, of which a median is drawn
BINS = 9  # of equally many pictures each
SPREAD = (10, 90)  # percentiles
GOALS_DEG = ((0.5, 0.5), (2.0, 0.95))  # of foveation: error, and the share that shall be below it
GOALS_CM = ((3.0, 0.5), (8.0, 0.9))  # of the limbs' mean of both eyes


def read(run: Path) -> dict[str, np.ndarray]:
    """Read the columns of ``nets/vision/errors.h5`` that are drawn, in degrees and cm.

    Raises
    ------
    UserError
        Naming the file, when it is missing or lacks one.
    """
    angles = [f"foveation_{eye}_{what}" for eye in EYES for what in ("error", "direction")]
    angles += [f"{limb}_eccentricity" for limb in LIMBS]
    lengths = [f"{limb}_{what}" for limb in LIMBS for what in ("vision_mean_error", "distance")]
    columns, _ = read_shard(Path(run) / "nets" / "vision" / "errors.h5", [*angles, *lengths])
    return {name: np.rad2deg(columns[name]) for name in angles} | {name: 100 * columns[name] for name in lengths}


def cells(direction: np.ndarray, error: np.ndarray) -> np.ndarray:
    """Median errors over the visual field: rows of phi, columns of theta, each `CELL_DEG` wide.

    Parameters
    ----------
    direction : ndarray (n, 2)
        Theta and phi, degrees.
    error : ndarray (n,)

    Returns
    -------
    ndarray (m, m)
        From -40 to 40 degrees; NaN where there are fewer than `LEAST` pictures.
    """
    count = round(2 * FIELD_DEG / CELL_DEG)
    column, row = np.floor((direction.T + FIELD_DEG) / CELL_DEG).astype(int)
    there = (np.minimum(row, column) >= 0) & (np.maximum(row, column) < count)
    medians = np.full((count, count), np.nan)
    for cell in np.unique(row[there] * count + column[there]):
        inside = error[there & (row * count + column == cell)]
        if len(inside) >= LEAST:
            medians[divmod(cell, count)] = np.median(inside)
    return medians


def draw(run: Path) -> plt.Figure:
    """Draw foveation above, limb vision below."""
    told = read(run)
    figure, axes = plt.subplots(2, 3, figsize=(7.2, 4.7), width_ratios=[1.1, 1, 1])
    field(axes[0, 0], told["foveation_left_direction"], told["foveation_left_error"])
    for eye, colour in EYES.items():
        away = np.linalg.norm(told[f"foveation_{eye}_direction"], axis=1)
        course(axes[0, 1], away, told[f"foveation_{eye}_error"], f"{eye} eye", colour)
    panel(axes[0, 1], "Foveation", "target from gaze (deg)", "error (deg)")
    shares(axes[0, 2], {f"{eye} eye": (told[f"foveation_{eye}_error"], EYES[eye]) for eye in EYES}, GOALS_DEG, "deg")
    for limb, colour in LIMBS.items():
        error, name = told[f"{limb}_vision_mean_error"], limb.replace("_", " ")
        course(axes[1, 0], told[f"{limb}_distance"], error, name, colour, spread=False)
        course(axes[1, 1], told[f"{limb}_eccentricity"], error, name, colour, spread=False)
    panel(axes[1, 0], "Limbs, by distance", "target from eye (cm)", "error, median (cm)")
    panel(axes[1, 1], "Limbs, by place", "hand or foot from gaze (deg)", "")
    for place in (axes[0, 1], *axes[1, :2]):
        place.set_ylim(bottom=0)
    errors = {limb.replace("_", " "): (told[f"{limb}_vision_mean_error"], LIMBS[limb]) for limb in LIMBS}
    shares(axes[1, 2], errors, GOALS_CM, "cm")
    return figure


def field(axes: plt.Axes, direction: np.ndarray, error: np.ndarray) -> None:
    """Draw the map of `cells`: the field as it is seen, so that theta, which counts to the left, falls to the right."""
    medians = cells(direction, error)
    drawn = medians[np.isfinite(medians)] if np.isfinite(medians).any() else error  # of few pictures no cell is drawn
    low, high = drawn.min(), drawn.max()
    norm = LogNorm(low, max(high, 1.01 * low))
    edges = (-FIELD_DEG, FIELD_DEG)
    image = axes.imshow(medians[:, ::-1], origin="lower", extent=(*edges[::-1], *edges), cmap="viridis", norm=norm)
    axes.grid(False)
    bar = axes.figure.colorbar(image, ax=axes, shrink=0.9, aspect=18)
    figures.log_ticks(bar.ax.yaxis)
    bar.outline.set_visible(False)
    bar.set_label("error, median (deg)")
    panel(axes, "Foveation, left eye", "theta, left (deg)", "phi, up (deg)")


def course(axes: plt.Axes, x: np.ndarray, error: np.ndarray, label: str, colour: str, spread: bool = True) -> None:
    """Draw medians of errors (n,) over bins of x (n,) that hold equally many, and the middle 80 %."""
    order = np.argsort(x)
    bins = [chosen for chosen in np.array_split(order, BINS) if len(chosen)]
    middle = [np.median(x[chosen]) for chosen in bins]
    low, median, high = np.array([np.percentile(error[chosen], [SPREAD[0], 50, SPREAD[1]]) for chosen in bins]).T
    if spread:
        axes.fill_between(middle, low, high, color=colour, alpha=0.2, linewidth=0)
    axes.plot(middle, median, color=colour, marker="o", markersize=2.5, label=label)


def shares(axes: plt.Axes, errors: dict[str, tuple[np.ndarray, str]], goals: Sequence, unit: str) -> None:
    """Draw which share of pictures has an error below, and crosses at what it shall be."""
    for label, (error, colour) in errors.items():
        ordered = np.sort(error)
        axes.step(ordered, np.arange(1, len(ordered) + 1) / len(ordered), where="post", color=colour, label=label)
    axes.plot(*zip(*goals, strict=True), "+", color="#202020", markersize=8, markeredgewidth=1.2, label="aim")
    axes.set_xscale("log")
    axes.set_xlim(left=goals[0][0] / 20)
    figures.log_ticks(axes.xaxis)
    axes.set_ylim(0, 1.02)
    axes.legend(loc="upper left", handlelength=1.2)
    panel(axes, "Share below an error", f"error ({unit})", "")


def panel(axes: plt.Axes, title: str, x: str, y: str) -> None:
    """Say what a panel shows."""
    axes.set_title(title)
    axes.set_xlabel(x)
    axes.set_ylabel(y)


def main(argv: Sequence[str] | None = None) -> None:
    """Run the command line."""
    figures.command(draw, argv, __doc__)


if __name__ == "__main__":
    sys.exit(cli.run(main))
