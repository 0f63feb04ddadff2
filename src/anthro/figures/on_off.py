"""A controller is turned off and on again: frames, and below them what falls and how the muscles act."""

from __future__ import annotations

import matplotlib.pyplot as plt
import numpy as np

from anthro.errors import UserError
from anthro.figures.strip import GAP, LETTERS, frames
from anthro.render.palette import colours_of, drawn_group, limb_muscles, shades
from anthro.render.rollout import Rollout

DPI, FRAMES = 300, 6
FRAME_WIDTH, FRAME_HEIGHT = 345, 452  # pixels: six fill the page's width
HEIGHT = 3.5  # inches


def moments(rollout: Rollout, series: np.ndarray) -> np.ndarray:
    """Six telling times (6,), s: held, falling, nearly down, at rest, half lifted, at the end.

    Parameters
    ----------
    rollout : Rollout
        Of T instants; the controller is on, off and on again.
    series : ndarray (T,)
        What falls.

    Raises
    ------
    UserError
        The controller is not turned off and on again.
    """
    switches = rollout.switches()
    if len(switches) < 2 or not rollout.controller_on[0]:
        raise UserError("the rollout's controller is not turned off and on again")
    time, (off, on) = rollout.time, switches[:2]
    end = switches[2] if len(switches) > 2 else time[-1]
    before, after, last = np.searchsorted(time, [off, on, end])
    fall, lift = series[before:after], series[after : last + 1]
    lowest = fall[np.argmax(np.abs(fall - fall[0]))]
    falling, down = (before + _reached(fall, fall[0], lowest, share) for share in (0.4, 0.9))
    lifting = after + _reached(lift, lift[0], series[before - 1], 0.5)
    return time[[before - 1, falling, down, after - 1, lifting, last - 1]]


def _reached(series: np.ndarray, start: float, end: float, share: float) -> int:
    """Index of the first value that has gone `share` of the way from start to end."""
    passed = (series - start) * np.sign(end - start) >= share * abs(end - start)
    return int(np.argmax(passed)) if passed.any() else len(series) // 2


def draw(rollout: Rollout, series: np.ndarray, label: str, aim: np.ndarray | None = None) -> plt.Figure:
    """Six frames, the course of what falls, and the mean activation of the muscles' groups.

    Parameters
    ----------
    rollout : Rollout
        Of T instants, of one limb.
    series : ndarray (T,)
        What falls.
    label : str
        Its name and unit.
    aim : ndarray (T,), optional
        Where it should be; NaN where nobody says so.

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    UserError
        The controller is not turned off and on again.
    """
    times = moments(rollout, series)
    image = frames(rollout, times, FRAME_WIDTH, FRAME_HEIGHT)
    plt.rcParams["savefig.dpi"] = DPI
    wide = FRAMES * (FRAME_WIDTH + GAP) - GAP
    figure = plt.figure(figsize=(wide / DPI, HEIGHT), layout="none")
    share = FRAME_HEIGHT / DPI / HEIGHT
    axes = figure.add_axes([0, 1 - share, 1, share])
    axes.imshow(image, interpolation="none", aspect="auto")
    axes.set_axis_off()
    _course(figure.add_axes([0.075, 0.12, 0.385, 0.315]), rollout, times, series, label, aim)
    _activation(figure.add_axes([0.555, 0.12, 0.425, 0.315]), rollout)
    _legend(figure, rollout.limbs[0])
    return figure


def shade_off(axes: plt.Axes, rollout: Rollout) -> None:
    """Shade the time in which the controller is off."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], ~rollout.controller_on, [0]]).astype(int)))
    time = np.append(rollout.time, rollout.time[-1])
    for start, end in time[edges].reshape(-1, 2):
        axes.axvspan(start, end, color="#E9EBED", linewidth=0)
        words = {"ha": "center", "va": "top", "size": 7, "color": "#505860"}
        axes.text((start + end) / 2, 0.965, "controller off", transform=axes.get_xaxis_transform(), **words)
    axes.set_xlim(rollout.time[0], rollout.time[-1])
    axes.set_xlabel("time (s)")


def _course(
    axes: plt.Axes, rollout: Rollout, times: np.ndarray, series: np.ndarray, label: str, aim: np.ndarray | None
) -> None:
    shade_off(axes, rollout)
    known = aim is not None and np.isfinite(aim).any()
    if known:
        axes.plot(rollout.time, aim, color="#C79A00", linestyle="--", label="target")
    axes.plot(rollout.time, series, color="#202020", label=label.split()[0])
    values = np.interp(times, rollout.time, series)
    rising = values[2] > values[0]
    axes.plot(times, values, "o", color="#202020", markersize=3, clip_on=False)
    for index, (time, value) in enumerate(zip(times, values, strict=True)):
        # Beside the curve, on its outer side: a head droops upwards on the page.
        at = (-9, 4) if index in (0, len(times) - 1) or (rising and index < 3) else (4, 3)
        axes.annotate(LETTERS[index], (time, value), at, textcoords="offset points", size=7, weight="bold")
    low, high = series.min(), series.max()
    axes.set_ylim(low - 0.1 * (high - low), high + 0.3 * (high - low))
    axes.set_ylabel(label)
    if known:
        axes.legend(loc="center right", bbox_to_anchor=(1.0, 0.5))


def _activation(axes: plt.Axes, rollout: Rollout) -> None:
    shade_off(axes, rollout)
    limb = rollout.limbs[0]
    led = np.flatnonzero(limb_muscles(rollout.body, limb))
    groups = np.array([drawn_group(rollout.body.muscle_groups[i]) for i in led])
    for group, colour in colours_of(limb).items():
        if (groups == group).any():
            mean = rollout.activation[:, led[groups == group]].mean(axis=1)
            axes.plot(rollout.time, mean, color=colour, linewidth=1.1)
    axes.set_ylim(0, max(axes.get_ylim()[1], 1e-3) * 1.15)
    axes.set_ylabel("mean activation")


def _legend(figure: plt.Figure, limb: str) -> None:
    """Each group's colour from no to full activation, as the muscles show it."""
    groups, width, step = colours_of(limb), 0.07, 0.17
    left = 0.645 - step * len(groups) / 2
    figure.text(left - 0.015, 0.5, "muscles, activation 0 to 1:", ha="right", va="center", size=7.5)
    for group in groups:
        colours, glow = shades([group] * 64, np.linspace(0, 1, 64))
        light = colours * np.minimum(1.0, 0.72 + glow)[:, None]
        axes = figure.add_axes([left, 0.489, width, 0.022])
        axes.imshow(np.clip(light, 0, 1)[None] ** (1 / 2.2), aspect="auto")
        axes.set_axis_off()
        figure.text(left + width + 0.01, 0.5, group, va="center", size=7.5)
        left += step
