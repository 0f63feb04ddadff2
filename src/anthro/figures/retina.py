"""A retina: each photoreceptor where it lies, in the colour that it receives or by what it counts for."""

from __future__ import annotations

import matplotlib.pyplot as plt
import numpy as np

from anthro.eyes.layout import FIELD_DEG, Layout

BETWEEN = "#26292D"  # colour between receptors, on which white ones show
GAMMA = 2.2  # of the display
HALF_PAGE = 3.3  # inches


def percept(axes: plt.Axes, receptors: Layout, vector: np.ndarray, title: str, inches: float = HALF_PAGE) -> None:
    """Draw receptors in the colours that they receive.

    Parameters
    ----------
    axes : matplotlib.axes.Axes
    receptors : Layout
    vector : ndarray (3 n,)
        Optic nerve vector, linear RGB from 0 to 1.
    title : str
    inches : float
        Width of the panel.
    """
    spots(axes, receptors, np.clip(vector.reshape(-1, 3), 0, 1) ** (1 / GAMMA), title, inches)


def spots(
    axes: plt.Axes, receptors: Layout, colours: np.ndarray, title: str, inches: float = HALF_PAGE, **mapped
) -> plt.Artist:
    """Draw n receptors as dots, each as large as its share of the field; the retina is seen from behind.

    Parameters
    ----------
    axes : matplotlib.axes.Axes
    receptors : Layout
    colours : ndarray (n, 3) or (n,)
        sRGB from 0 to 1, or values.
    title : str
    inches : float
        Width of the panel.
    **mapped
        How values become colours: ``cmap`` and ``norm``.

    Returns
    -------
    matplotlib.artist.Artist
        The dots, for a colour bar.
    """
    place = receptors.retina_deg
    away = np.hypot(*place.T)
    order = np.argsort(-away)
    axes.add_patch(plt.Circle((0, 0), 1.03 * FIELD_DEG / 2, color=BETWEEN, linewidth=0))
    sizes = (0.3 + (0.062 * away[order]) ** 2) * (inches / HALF_PAGE) ** 2
    dots = axes.scatter(*place[order].T, s=sizes, c=colours[order], linewidths=0, **mapped)
    edge = 1.04 * FIELD_DEG / 2
    axes.set(xlim=(-edge, edge), ylim=(-edge, edge), aspect="equal", xticks=[], yticks=[])
    axes.spines[:].set_visible(False)
    axes.set_title(title)
    return dots
