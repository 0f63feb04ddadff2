"""Ink of a drawing finger beside the trajectory that it was given, to scale."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.cm import ScalarMappable
from matplotlib.collections import LineCollection
from matplotlib.colors import LinearSegmentedColormap, Normalize

from anthro.errors import UserError
from anthro.files import read_json, read_shard
from anthro.world.path_error import distance_to_path

COLUMNS = ("time", "ink", "reference", "pen_down")
MEASURES = ("rms_error_m", "coverage_rms_m")
GIVEN, MOVES, PATH = "#404040", "#B0B0B0", "#D8D8D8"
FAR = 2.0  # cm, where the ink's colour ends
NEARNESS = LinearSegmentedColormap.from_list("nearness", ["#0072B2", "#56B4E9", "#E69F00", "#D55E00"])
BAR = 5.0  # cm


@dataclass(frozen=True)
class Drawing:
    """A demo's ink and trajectory at T instants.

    Parameters
    ----------
    time : ndarray (T,)
        s.
    ink, reference : ndarray (T, 3)
        Finger tip and given trajectory in the drawing plane (x right, y up, z off the plane), cm.
    pen_down : ndarray (T,) bool
    distance : ndarray (T,)
        Of the finger tip from the nearest point of the path, cm; NaN where the pen is up.
    rms, coverage_rms : float
        The demo's measures, cm.
    base : ndarray (T, 7) or None
        Position in m and quaternion (w first) of the root bone.
    """

    time: np.ndarray
    ink: np.ndarray
    reference: np.ndarray
    pen_down: np.ndarray
    distance: np.ndarray
    rms: float
    coverage_rms: float
    base: np.ndarray | None = None

    @property
    def label(self) -> str:
        """How near the ink is to the path, for a person."""
        return f"RMS: ink from path {self.rms:.2f} cm, path from ink {self.coverage_rms:.2f} cm"


def read(run: Path, demo: str, with_base: bool = False) -> Drawing:
    """Read the drawing of a run's demo.

    Raises
    ------
    UserError
        Naming the file: missing, incomplete, of columns that do not match, or without its measures.
    """
    folder = Path(run) / "demos" / demo
    path = folder / "rollout.h5"
    columns, _ = read_shard(path, (*COLUMNS, "base") if with_base else COLUMNS)
    count = len(columns["time"])
    expected = {"time": (count,), "ink": (count, 3), "reference": (count, 3), "pen_down": (count,), "base": (count, 7)}
    for name, values in columns.items():
        if values.shape != expected[name]:
            raise UserError(f"{path}: column {name} has shape {values.shape}, expected {expected[name]}")
    metrics = read_json(folder / "metrics.json")
    if missing := [name for name in MEASURES if metrics.get(name) is None]:
        raise UserError(f"{folder / 'metrics.json'}: no {', '.join(missing)}")
    down = columns["pen_down"] > 0
    ink, reference = columns["ink"], columns["reference"]
    distance = np.full(count, np.nan)
    try:
        distance[down] = distance_to_path(ink[down], reference, down)
    except UserError as error:
        raise UserError(f"{path}: {error}") from None
    rms, coverage = (100 * float(metrics[name]) for name in MEASURES)
    return Drawing(
        columns["time"], 100 * ink, 100 * reference, down, 100 * distance, rms, coverage, columns.get("base")
    )


def given(axes: plt.Axes, drawing: Drawing) -> None:
    """Draw the given trajectory, moves with the pen up dotted, and a bar of some centimetres."""
    down = drawing.pen_down
    inner = down & np.append(True, down[:-1]) & np.append(down[1:], True)
    axes.plot(*_where(drawing.reference, ~inner), color=MOVES, linewidth=0.8, linestyle=":")
    axes.plot(*_where(drawing.reference, down), color=GIVEN, linewidth=1.4)
    _titled(axes, "Given trajectory", "dotted: pen up")
    _to_scale(axes, drawing)
    (left, _), low = axes.get_xlim(), axes.get_ylim()[0]
    axes.plot([left, left + BAR], [low, low], color=GIVEN, linewidth=1.5, solid_capstyle="butt", clip_on=False)
    axes.annotate(f"{BAR:g} cm", (left + BAR, low), (3, 0), textcoords="offset points", va="center", size=7)


def inked(axes: plt.Axes, drawing: Drawing, title: str) -> None:
    """Draw the ink, coloured by its distance from the path, over the path; its errors are below the title."""
    down = drawing.pen_down
    axes.plot(*_where(drawing.reference, down), color=PATH, linewidth=3.2, solid_capstyle="round")
    linked = down[:-1] & down[1:]
    lines = np.stack([drawing.ink[:-1, :2], drawing.ink[1:, :2]], axis=1)[linked]
    ink = LineCollection(lines, cmap=NEARNESS, norm=Normalize(0, FAR), linewidth=1.3, capstyle="round")
    ink.set_array(drawing.distance[1:][linked])
    axes.add_collection(ink)
    _titled(axes, title, drawing.label)
    _to_scale(axes, drawing)


def colour_bar(figure: plt.Figure, axes) -> None:
    """Say what the ink's colours mean, beside some axes."""
    bar = figure.colorbar(ScalarMappable(Normalize(0, FAR), NEARNESS), ax=axes, extend="max", shrink=0.75, aspect=25)
    bar.set_ticks([0, FAR / 4, FAR / 2, 3 * FAR / 4, FAR])
    bar.set_label("distance from the path (cm)")
    bar.outline.set_visible(False)


def _where(points: np.ndarray, shown: np.ndarray) -> np.ndarray:
    """Positions (2, T) in the plane, NaN where they are not to be shown."""
    return np.where(shown, points[:, :2].T, np.nan)


def _titled(axes: plt.Axes, title: str, told: str) -> None:
    axes.set_title(f"{title}\n")
    below = axes.text(0, 1.03, told, transform=axes.transAxes, va="bottom", size=7.5, color="#505050")
    below.set_in_layout(False)


def _to_scale(axes: plt.Axes, drawing: Drawing) -> None:
    """Frame both ink and path, so that panels of a drawing are of one scale."""
    shown = np.vstack([drawing.reference[drawing.pen_down], drawing.ink[drawing.pen_down]])[:, :2]
    low, high = shown.min(axis=0) - 0.8, shown.max(axis=0) + 0.8
    axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), aspect="equal")
    axes.set_axis_off()
