"""Fig. 17: the left retina while the eye turns towards a ball and follows it."""

import sys
from collections.abc import Sequence
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

from anthro import cli, figures
from anthro.errors import UserError
from anthro.eyes.sight import as_floats
from anthro.figures.gaze import FOVEA, after, first, gaze_error, read, retinas, trials
from anthro.figures.retina import percept
from anthro.figures.strip import LETTERS

DEMO = "perception"
LEFT = 0
UNDER_WAY = 0.7  # of the first angle: from here on the ball comes nearer
LATER = 0.4  # s, from the foveation to the last picture
SIZE = (7.0, 3.7)


def instants(error: np.ndarray, time: np.ndarray) -> np.ndarray:
    """Four telling instants of a trial: the ball appears, comes nearer to the fovea, is foveated, is followed.

    Parameters
    ----------
    error, time : ndarray (k,)
        Angle between ball and gaze, rad, NaN without a ball, and time, s.

    Returns
    -------
    ndarray (4,)
        Indices, none before the one ahead of it; a ball that is never foveated is shown where it is nearest.

    Raises
    ------
    UserError
        There is no ball.
    """
    if not np.isfinite(error).any():
        raise UserError(f"demo {DEMO}: no ball in the trial")
    appears = first(np.isfinite(error), 0)
    there = first(error < FOVEA, int(np.nanargmin(error)))
    coming = appears + first(error[appears:there] < UNDER_WAY * error[appears], there - appears)
    return np.array([appears, coming, there, after(time, there, LATER)])


def draw(run: Path) -> plt.Figure:
    """Draw the trial of a run's perception demo whose ball appears farthest from the gaze."""
    rollout = read(run, DEMO)
    error = gaze_error(rollout)[:, LEFT]
    trial = max(trials(rollout), key=lambda chosen: _at_first(error[chosen]))
    time = rollout.time[trial] - rollout.time[trial[0]]
    shown = instants(error[trial], time)
    figure = plt.figure(figsize=SIZE)
    grid = figure.add_gridspec(2, len(shown), height_ratios=[1.55, 1])
    vectors, receptors = as_floats(rollout.others["nerve"][trial[shown], LEFT]), retinas(rollout)[LEFT]
    for column, (letter, vector, at) in enumerate(zip(LETTERS, vectors, time[shown], strict=False)):
        axes = figure.add_subplot(grid[0, column])
        percept(axes, receptors, vector, f"({letter}) {at:.2f} s", SIZE[0] / len(shown))
    course(figure.add_subplot(grid[1, :]), time, np.rad2deg(error[trial]), shown)
    return figure


def course(axes: plt.Axes, time: np.ndarray, degrees: np.ndarray, shown: np.ndarray) -> None:
    """Draw how far (k,), degrees, the ball is from the gaze over times (k,), s, and which instants are shown."""
    axes.plot(time, degrees, color="#0072B2")
    axes.axhline(np.rad2deg(FOVEA), color="#808080", linewidth=0.8, linestyle="--")
    axes.plot(time[shown], degrees[shown], "o", color="#202020", markersize=3, clip_on=False)
    for letter, index in zip(LETTERS, shown, strict=False):
        at = (time[index], degrees[index])
        axes.annotate(letter, at, (4, 4), textcoords="offset points", size=8, weight="bold")
    axes.set_xlim(0, min(time[-1], time[shown[-1]] + 0.1))
    axes.set_ylim(0, 1.15 * np.nanmax(degrees))
    axes.set_xlabel("time within the trial (s)")
    axes.set_ylabel("ball from gaze (deg)")


def _at_first(error: np.ndarray) -> float:
    """The first angle that is known; -1 if none is."""
    known = error[np.isfinite(error)]
    return float(known[0]) if len(known) else -1.0


def main(argv: Sequence[str] | None = None) -> None:
    """Run the command line."""
    figures.command(draw, argv, __doc__)


if __name__ == "__main__":
    sys.exit(cli.run(main))
