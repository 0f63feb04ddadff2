"""Shapes to draw, as strokes of a pen in a plane: a butterfly, and writing."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicSpline

from anthro.errors import UserError
from anthro.world.glyphs import GLYPHS

ARC_STEP = 3.0  # degrees between the points of an arc
LETTER_GAP = 0.26  # of the letters' height
SPACE = 0.38

# The right half of a butterfly two wide, its mirror plane x = 0: one closed line round the four wings, from the notch
# of the head to that of the tail; one feeler; the body's half-width and ends.
WINGS = np.array(
    [
        *[(0.0, 0.18), (0.12, 0.28), (0.27, 0.56), (0.50, 0.82), (0.80, 0.92), (0.98, 0.80)],
        *[(0.99, 0.54), (0.86, 0.24), (0.66, 0.06), (0.60, -0.04), (0.70, -0.18), (0.76, -0.42)],
        *[(0.64, -0.66), (0.42, -0.76), (0.22, -0.64), (0.10, -0.44), (0.0, -0.36)],
    ]
)
FEELER = np.array([(0.04, 0.34), (0.07, 0.56), (0.15, 0.76), (0.27, 0.92), (0.37, 0.96), (0.40, 0.89), (0.345, 0.86)])
BODY_WIDTH, BODY_LOW, BODY_HIGH = 0.07, -0.62, 0.36
FINE = 4000


@dataclass(frozen=True)
class Stroke:
    """A line drawn with the pen down.

    Parameters
    ----------
    points : ndarray (k, 2)
        Corners of the line in the plane, m: x to the right, y up; k >= 2.

    Raises
    ------
    UserError
        Fewer than two points, not finite, or of no length.
    """

    points: np.ndarray

    def __post_init__(self):
        points = np.array(self.points, float)
        if points.ndim != 2 or points.shape[1] != 2 or len(points) < 2 or not np.isfinite(points).all():
            raise UserError(f"a stroke needs at least two finite points of two numbers, got shape {points.shape}")
        object.__setattr__(self, "points", points)
        if self.length <= 0:
            raise UserError("a stroke of no length cannot be drawn")

    @property
    def length(self) -> float:
        """Length along the line, m."""
        return float(np.linalg.norm(np.diff(self.points, axis=0), axis=1).sum())

    @property
    def closed(self) -> bool:
        """Whether it ends where it began."""
        return bool(np.allclose(self.points[0], self.points[-1], rtol=0, atol=1e-9 * self.length))


def butterfly(width: float, points: int = 400) -> list[Stroke]:
    """A butterfly: the outline of its wings, its body, its feelers.

    The wings' outline is our own, a periodic cubic spline (curvature continuous) through points authored on one
    side and mirrored. (Fay's polar butterfly, American Mathematical Monthly 96, 1989, winds through itself, which
    reads less well as a finger's drawing.)

    Parameters
    ----------
    width : float
        From wing tip to wing tip, m.
    points : int
        Points on each half of the wings' outline, at equal distances along it.

    Returns
    -------
    list of Stroke
        Wings (closed), body (closed), left feeler, right feeler: mirror images about x = 0, the bounding box
        centred on the origin.

    Raises
    ------
    UserError
        The width is not positive.
    """
    _positive(width, "width", "m")
    mirror = np.array([-1.0, 1.0])
    loop = np.vstack([WINGS, (WINGS * mirror)[-2::-1]])
    half = _evenly(_spline(loop, "periodic", len(WINGS) - 1), points)
    half[[0, -1], 0] = 0.0
    wings = np.vstack([half, (half * mirror)[-2::-1]])
    angle = np.linspace(np.pi / 2, np.pi / 2 + 2 * np.pi, 121)
    middle, tall = (BODY_HIGH + BODY_LOW) / 2, (BODY_HIGH - BODY_LOW) / 2
    body = np.stack([BODY_WIDTH * np.cos(angle), middle + tall * np.sin(angle)], axis=1)
    feeler = _evenly(_spline(FEELER, "natural", len(FEELER) - 1), 100)
    return _placed([wings, body, feeler * mirror, feeler], width, axis=0)


def writing(text: str, height: float) -> list[Stroke]:
    """Write capitals and figures in single strokes, one line.

    Parameters
    ----------
    text : str
        Of A to Z, 0 to 9 and spaces.
    height : float
        Of a capital, m.

    Returns
    -------
    list of Stroke
        In the order of writing; the bounding box is centred on the origin.

    Raises
    ------
    UserError
        Nothing to write, a character that has no glyph, or a height that is not positive.
    """
    _positive(height, "height", "m")
    if not text.strip(" "):
        raise UserError("text: nothing to write")
    unknown = sorted(set(text) - set(GLYPHS))
    if unknown:
        raise UserError(f"text: no glyph for {', '.join(map(repr, unknown))}; known: A to Z, 0 to 9 and space")
    lines, pen = [], 0.0
    for character in text:
        strokes = [_line(parts) for parts in GLYPHS[character]]
        lines += [line + (pen, 0.0) for line in strokes]
        pen += max((line[:, 0].max() for line in strokes), default=SPACE - LETTER_GAP) + LETTER_GAP
    return _placed(lines, height)


def _line(parts: Sequence[tuple]) -> np.ndarray:
    """Points (k, 2) of a glyph's stroke, in heights of a capital."""
    pieces = []
    for part in parts:
        if len(part) == 2:
            pieces.append(np.array([part], float))
            continue
        x, y, rx, ry, start, end = part
        angle = np.radians(np.linspace(start, end, 1 + round(abs(end - start) / ARC_STEP)))
        pieces.append(np.stack([x + rx * np.cos(angle), y + ry * np.sin(angle)], axis=1))
    return np.vstack(pieces)


def _placed(lines: Sequence[np.ndarray], size: float, axis: int | None = None) -> list[Stroke]:
    """Strokes of lines about the centre of their bounding box: ``size`` long along an axis, or ``size`` times."""
    everything = np.vstack(lines)
    low, high = everything.min(axis=0), everything.max(axis=0)
    scale = size if axis is None else size / (high - low)[axis]
    return [Stroke(scale * (line - (low + high) / 2)) for line in lines]


def _spline(points: np.ndarray, ends: str, intervals: int) -> np.ndarray:
    """Fine points over the first ``intervals`` of a cubic spline, its parameter the root of the chords' lengths."""
    chords = np.sqrt(np.linalg.norm(np.diff(points, axis=0), axis=1))
    knots = np.concatenate([[0.0], np.cumsum(chords)])
    return CubicSpline(knots, points, bc_type=ends)(np.linspace(0.0, knots[intervals], FINE))


def _evenly(fine: np.ndarray, points: int) -> np.ndarray:
    """Points at equal distances along a fine line, its ends among them."""
    along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(fine, axis=0), axis=1))])
    wanted = np.linspace(0.0, along[-1], points)
    return np.stack([np.interp(wanted, along, values) for values in fine.T], axis=1)


def _positive(value: float, name: str, unit: str) -> None:
    if not (np.isfinite(value) and value > 0):
        raise UserError(f"{name}: {value} {unit} is not a positive number")
