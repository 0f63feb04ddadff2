"""How well ink lies on a given path, and how much of the path it covers."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.spatial import cKDTree

from anthro.errors import UserError

SPACING = 1e-4  # m, between the points that stand for a line; distances are true to half of it


class PathError(NamedTuple):
    """Root mean squares of distance, m.

    Parameters
    ----------
    rms : float
        Of the ink's samples from the nearest point of the path.
    coverage_rms : float
        Of the path, evenly along it, from the nearest point of the ink; a part left out makes it large.
    """

    rms: float
    coverage_rms: float


def path_error(ink, reference, pen_down) -> PathError:
    """Compare ink with the path that it was to follow, whenever it did so.

    Parameters
    ----------
    ink, reference : array (n, d)
        Positions of the finger and of the trajectory at the same instants, m.
    pen_down : array (n,)
        Whether there is ink.

    Returns
    -------
    PathError

    Raises
    ------
    UserError
        Shapes that do not match, positions that are not finite, or no two instants in turn with the pen down.
    """
    path, inked = _dense(reference, pen_down), cKDTree(_dense(ink, pen_down))
    samples = np.asarray(ink, float)[np.asarray(pen_down, bool)]
    return PathError(_rms(cKDTree(path).query(samples)[0]), _rms(inked.query(path)[0]))


def distance_to_path(points, reference, pen_down) -> np.ndarray:
    """Distances (n,) m of points (n, d) from the nearest point of a path drawn as in `path_error`; it raises alike."""
    points = np.asarray(points, float)
    if not np.isfinite(points).all():
        raise UserError("path: positions are not finite")
    return cKDTree(_dense(reference, pen_down)).query(points)[0]


def _rms(distances: np.ndarray) -> float:
    return float(np.sqrt(np.mean(np.square(distances))))


def _dense(points, pen_down) -> np.ndarray:
    """Points (k, d) at equal distances along the lines between successive instants with the pen down."""
    points, down = np.asarray(points, float), np.asarray(pen_down, bool)
    if points.ndim != 2 or down.shape != points.shape[:1]:
        raise UserError(f"path: positions of shape {points.shape} do not go with a pen of shape {down.shape}")
    if not np.isfinite(points[down]).all():
        raise UserError("path: positions are not finite")
    linked = down[:-1] & down[1:]
    if not linked.any():
        raise UserError("path: nothing is drawn with the pen down")
    starts, steps = points[:-1][linked], np.diff(points, axis=0)[linked]
    along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(steps, axis=1))])
    wanted = np.linspace(0.0, along[-1], 2 + int(along[-1] / SPACING))
    step = np.clip(np.searchsorted(along, wanted, side="right") - 1, 0, len(steps) - 1)
    length = np.maximum(np.diff(along)[step], 1e-15)
    return starts[step] + ((wanted - along[step]) / length)[:, None] * steps[step]
