"""Fig. 21: the arm's controller is turned off, the arm falls, it is turned on and lifts the arm."""

import sys
from collections.abc import Sequence
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

from anthro import cli, figures
from anthro.errors import UserError
from anthro.render.raytrace import render
from anthro.render.rollout import Rollout, load_body, read_rollout
from anthro.render.scene import GROUP_COLOURS, muscle_colour
from anthro.render.stage import Stage

DEMO = "on_off"
FRAME_PIXELS = (348, 432)
DPI = 300


def moments(rollout: Rollout) -> np.ndarray:
    """Six telling times (6,), s: held, falling, nearly down, at rest, half lifted, held again.

    Raises
    ------
    UserError
        The controller is not turned off and on again.
    """
    switches = rollout.switches()
    if len(switches) < 2 or not rollout.controller_on[0]:
        raise UserError(f"demo {DEMO}: the controller is not turned off and on again")
    off, on = switches[:2]
    end = switches[2] if len(switches) > 2 else rollout.time[-1]
    height, time = rollout.hand[:, 2], rollout.time
    before, after = np.searchsorted(time, [off, on])
    last = np.searchsorted(time, end)
    fall, lift = height[before:after], height[after : last + 1]
    falling = time[before + _reached(fall, fall[0], fall.min(), 0.4)]
    down = time[before + _reached(fall, fall[0], fall.min(), 0.9)]
    lifting = time[after + _reached(lift, lift[0], lift[-1], 0.5)]
    return np.array([time[before - 1], falling, down, time[after - 1], lifting, time[last - 1]])


def _reached(series: np.ndarray, start: float, end: float, share: float) -> int:
    """Index of the first value that has gone `share` of the way from start to end."""
    passed = (series - start) * np.sign(end - start) >= share * abs(end - start)
    return int(np.argmax(passed)) if passed.any() else len(series) // 2


def draw(run: Path) -> plt.Figure:
    """Draw the figure of a run's on_off rollout."""
    rollout = read_rollout(run, DEMO)
    times = moments(rollout)
    body = load_body(run, rollout)
    pictures = _pictures(Stage(body), rollout, times)
    plt.rcParams["savefig.dpi"] = DPI
    figure = plt.figure(figsize=(7.0, 3.35), layout="none")
    _strip(figure, pictures, rollout.at(times))
    _height(figure.add_axes([0.075, 0.125, 0.385, 0.325]), rollout, times)
    _activation(figure.add_axes([0.555, 0.125, 0.425, 0.325]), rollout, body.muscle_groups)
    _legend(figure)
    return figure


def _pictures(stage: Stage, rollout: Rollout, times: np.ndarray) -> list[np.ndarray]:
    camera, studio = stage.shot(rollout, *FRAME_PIXELS, key_rays=9)
    now = rollout.at(times)
    return [
        render(stage.parts(now.qpos[i], now.activation[i], now.target[i]), camera, studio) for i in range(len(times))
    ]


def _strip(figure: plt.Figure, pictures: list[np.ndarray], now: Rollout) -> None:
    across, down = np.array(FRAME_PIXELS) / DPI / figure.get_size_inches()
    gap = (1 - len(pictures) * across) / (len(pictures) + 1)
    for index, picture in enumerate(pictures):
        corner = gap + index * (across + gap)
        axes = figure.add_axes([corner, 0.565, across, down])
        axes.imshow(picture, interpolation="none")
        axes.set_axis_off()
        letter, on = "abcdef"[index], now.controller_on[index]
        label = f"{now.time[index]:.2f} s  {'ON' if on else 'OFF'}"
        axes.text(0.05, 0.965, letter, transform=axes.transAxes, va="top", weight="bold", size=9)
        box = {"boxstyle": "round,pad=0.25", "linewidth": 0.6, "edgecolor": "#202020"}
        axes.text(
            0.95,
            0.955,
            label,
            transform=axes.transAxes,
            ha="right",
            va="top",
            size=7,
            color="white" if on else "#202020",
            bbox={**box, "facecolor": "#202020" if on else "white"},
        )


def _shade_off(axes: plt.Axes, rollout: Rollout) -> None:
    edges = np.diff(np.concatenate([[0], ~rollout.controller_on, [0]]).astype(int))
    time = np.append(rollout.time, rollout.time[-1])
    for start, end in zip(np.flatnonzero(edges == 1), np.flatnonzero(edges == -1), strict=True):
        axes.axvspan(time[start], time[end], color="#E9EBED", linewidth=0)
        axes.text(
            (time[start] + time[end]) / 2,
            0.965,
            "controller off",
            transform=axes.get_xaxis_transform(),
            ha="center",
            va="top",
            size=7,
            color="#505860",
        )
    axes.set_xlim(rollout.time[0], rollout.time[-1])
    axes.set_xlabel("time (s)")


def _height(axes: plt.Axes, rollout: Rollout, times: np.ndarray) -> None:
    _shade_off(axes, rollout)
    axes.plot(rollout.time, rollout.target[:, 2], color="#C79A00", linestyle="--", label="target")
    axes.plot(rollout.time, rollout.hand[:, 2], color="#202020", label="hand")
    heights = np.interp(times, rollout.time, rollout.hand[:, 2])
    axes.plot(times, heights, "o", color="#202020", markersize=3, clip_on=False)
    for letter, time, height in zip("abcdef", times, heights, strict=True):
        at = (-8, 5) if letter in "af" else (4, 3)
        axes.annotate(letter, (time, height), at, textcoords="offset points", size=7, weight="bold")
    low, high = rollout.hand[:, 2].min(), rollout.hand[:, 2].max()
    axes.set_ylim(low - 0.08 * (high - low), high + 0.3 * (high - low))
    axes.set_ylabel("hand height (m)")
    if np.isfinite(rollout.target).any():
        axes.legend(loc="center right", bbox_to_anchor=(1.0, 0.5))


def _activation(axes: plt.Axes, rollout: Rollout, groups: Sequence[str]) -> None:
    _shade_off(axes, rollout)
    names = np.array(groups)
    for group, colour in GROUP_COLOURS.items():
        if (names == group).any():
            mean = rollout.activation[:, names == group].mean(axis=1)
            axes.plot(rollout.time, mean, color=colour, linewidth=1.1)
    axes.set_ylim(0, axes.get_ylim()[1] * 1.15)
    axes.set_ylabel("mean activation")


def _legend(figure: plt.Figure) -> None:
    """Each group's colour from no to full activation, as the muscles show it."""
    levels = np.linspace(0, 1, 64)
    left, width = 0.30, 0.07
    figure.text(left - 0.02, 0.515, "muscles, activation 0 to 1:", ha="right", va="center", size=7.5)
    for group in GROUP_COLOURS:
        shades = [muscle_colour(group, level) for level in levels]
        light = np.array([colour * min(1.0, 0.72 + glow) for colour, glow in shades])
        axes = figure.add_axes([left, 0.504, width, 0.022])
        axes.imshow(np.clip(light, 0, 1)[None] ** (1 / 2.2), aspect="auto")
        axes.set_axis_off()
        figure.text(left + width + 0.01, 0.515, group, va="center", size=7.5)
        left += width + 0.1


def main(argv: Sequence[str] | None = None) -> None:
    """Run the command line."""
    figures.command(draw, argv, __doc__)


if __name__ == "__main__":
    sys.exit(cli.run(main))
