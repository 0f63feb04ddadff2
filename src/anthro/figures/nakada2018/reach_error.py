"""How near the right hand comes to its targets: teacher and networks, over time and over the reach."""

import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

from anthro import cli, figures
from anthro.errors import UserError
from anthro.files import read_shard

DEMOS = ("reach_right_arm_proprioceptive", "reach_right_arm_paper")
TOLERANCE = 0.03
WINDOW = 0.25
LABELS = {
    "teacher": "teacher (IK, ID, MO)",
    "proprioceptive": "networks, proprioceptive inputs",
    "paper": "networks, the paper's inputs",
}
COLOURS = {"teacher": "#404040", "proprioceptive": "#0072B2", "paper": "#D55E00"}


@dataclass(frozen=True)
class Reach:
    """One controller's errors.

    Parameters
    ----------
    errors : ndarray (tried, steps)
        Distance of hand and target, m.
    success : ndarray (tried,) bool
    errors_no_reflex : ndarray (tried, steps) or None
        Of the first of the targets.
    """

    errors: np.ndarray
    success: np.ndarray
    errors_no_reflex: np.ndarray | None


def read(run: Path) -> tuple[np.ndarray, np.ndarray, dict[str, Reach]]:
    """Times (steps,) s, targets (n, 3) m and errors by controller of a run's reach demos.

    Raises
    ------
    UserError
        Naming the file: none there, incomplete, of other targets than the first one's, or without
        any controller's errors.
    """
    paths = [Path(run) / "demos" / demo / "rollout.h5" for demo in DEMOS]
    paths = [path for path in paths if path.is_file()] or paths[:1]
    first, reaches = {}, {}
    for path in paths:
        found, _ = read_shard(path)
        missing = [name for name in ("target_time", "targets") if name not in found]
        if missing:
            raise UserError(f"{path}: no column {', '.join(missing)}")
        if first and not _same(first, found):
            raise UserError(f"{path}: not of the same targets as {paths[0]}")
        first = first or found
        for who in LABELS:
            if f"errors_{who}" in found and f"success_{who}" in found:
                without = None if who == "teacher" else found.get("errors_no_reflex")
                reaches[who] = Reach(found[f"errors_{who}"], found[f"success_{who}"] > 0.5, without)
    if not reaches:
        raise UserError(f"{paths[0]}: no column errors_<controller> with its success_<controller>")
    return first["target_time"], first["targets"], {who: reaches[who] for who in LABELS if who in reaches}


def _same(one: dict[str, np.ndarray], other: dict[str, np.ndarray]) -> bool:
    return all(
        one[name].shape == other[name].shape and np.allclose(one[name], other[name])
        for name in ("target_time", "targets")
    )


def draw(run: Path) -> plt.Figure:
    """Draw the figure of a run's reach demo."""
    time, targets, reaches = read(run)
    figure = plt.figure(figsize=(7.0, 4.6))
    rows = figure.subfigures(2, 1, height_ratios=[1, 1.12])
    _over_time(rows[0], time, reaches)
    networks = [who for who in reaches if who != "teacher"] or list(reaches)
    better = max(networks, key=lambda who: reaches[who].success.mean())
    side, top, last = rows[1].subplots(1, 3, width_ratios=[1, 1, 1.1])
    _targets(side, targets, reaches[better].success, (0, 2), "Targets from the right")
    _targets(top, targets, reaches[better].success, (0, 1), "Targets from above")
    handles, labels = side.get_legend_handles_labels()
    side.legend(handles, labels, loc="best", handletextpad=0.2, borderpad=0.2, frameon=True)
    top.text(0.98, 0.02, LABELS[better], transform=top.transAxes, ha="right", size=6.5, color="#606060")
    _final(last, time, reaches)
    return figure


def _over_time(figure: plt.Figure, time: np.ndarray, reaches: dict[str, Reach]) -> None:
    axes = figure.subplots(1, len(reaches), sharey=True, squeeze=False)[0]
    for panel, (who, reach) in zip(axes, reaches.items(), strict=True):
        low, middle, high = np.nanpercentile(100 * reach.errors, [10, 50, 90], axis=0)
        colour = COLOURS[who]
        panel.fill_between(time, low, high, color=colour, alpha=0.2, linewidth=0, label="10-90 %")
        panel.plot(time, middle, color=colour, label="median")
        if reach.errors_no_reflex is not None:
            without = np.nanmedian(100 * reach.errors_no_reflex, axis=0)
            panel.plot(time, without, color=colour, linestyle=":", label="median, reflex off")
        panel.axhline(100 * TOLERANCE, color="#808080", linewidth=0.8, linestyle="--")
        panel.set_yscale("log")
        figures.log_ticks(panel.yaxis)
        panel.set_xlim(time[0], time[-1])
        panel.set_title(f"{LABELS[who]}\n", size=8)
        hits = f"{reach.success.sum()} of {len(reach.success)} targets reached"
        panel.text(0, 1.03, hits, transform=panel.transAxes, size=7.5, color="#505050")
        panel.set_xlabel("time within a target (s)")
        panel.legend(loc="upper right", borderaxespad=0.1)
    axes[0].set_ylabel("distance to target (cm)")
    axes[0].text(time[0] + 0.02, 100 * TOLERANCE * 1.06, "3 cm", size=7, color="#606060")


def _targets(axes: plt.Axes, targets: np.ndarray, success: np.ndarray, view: tuple[int, int], title: str) -> None:
    x, y = targets[:, view[0]], targets[:, view[1]]
    axes.scatter(x[success], y[success], s=11, color="#0072B2", alpha=0.75, linewidth=0, label="reached")
    axes.scatter(x[~success], y[~success], s=18, color="#D55E00", marker="x", linewidth=1, label="missed")
    names = ("x, forward (m)", "y, left (m)", "z, up (m)")
    axes.set_xlabel(names[view[0]])
    axes.set_ylabel(names[view[1]])
    axes.set_title(title, size=8)
    axes.set_aspect("equal", adjustable="datalim")


def _final(axes: plt.Axes, time: np.ndarray, reaches: dict[str, Reach]) -> None:
    """Share of targets whose mean error of the last quarter second is below a distance."""
    for who, reach in reaches.items():
        settled = 100 * np.nanmean(reach.errors[:, time > time[-1] - WINDOW], axis=1)
        settled = np.sort(settled[np.isfinite(settled)])
        share = np.arange(1, len(settled) + 1) / len(reach.success)
        axes.step(settled, share, where="post", color=COLOURS[who], label=who)
    axes.axvline(100 * TOLERANCE, color="#808080", linewidth=0.8, linestyle="--")
    axes.set_xscale("log")
    figures.log_ticks(axes.xaxis)
    axes.set_ylim(0, 1.02)
    axes.set_xlabel("error of the last 0.25 s (cm)")
    axes.set_ylabel("share of targets below it")
    axes.set_title("Settled error", size=8)
    axes.legend(loc="best", frameon=True, framealpha=0.85, edgecolor="none")


def main(argv: Sequence[str] | None = None) -> None:
    """Run the command line."""
    figures.command(draw, argv, __doc__)


if __name__ == "__main__":
    sys.exit(cli.run(main))
