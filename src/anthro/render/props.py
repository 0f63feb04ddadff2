"""What a body sits on: a stool, or an office chair that reclines with it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum

import numpy as np

from anthro.render.mesh import Mesh, join
from anthro.render.parts import Part
from anthro.render.solids import box, turned

CUSHION, METAL, FRAME = "#55626F", "#B4BBC1", "#3A4149"
FLESH = 0.015  # m, between the pelvis and what it sits on
BACK_BONES = ("rib", "scapula", "T", "L")


class Follows(Enum):
    """How a piece moves: with the root bone, with its place alone, or not at all."""

    BONE = "bone"
    PLACE = "place"
    NOTHING = "nothing"


@dataclass
class Piece:
    """A rigid piece of a prop, built in the frame of the root bone when the body is upright."""

    part: Part
    follows: Follows

    def place(self, rotation: np.ndarray, position: np.ndarray, home: np.ndarray) -> None:
        """Put it where the root bone is: rotation (3, 3), position (3,) and at first `home` (3,), m."""
        where = home if self.follows is Follows.NOTHING else position
        self.part.place(rotation if self.follows is Follows.BONE else None, where)


def pieces(prop: str, bones: Mapping[str, np.ndarray], floor: float) -> list[Piece]:
    """Pieces of a prop that fits a body.

    Parameters
    ----------
    prop : str
        ``stool`` or ``chair``; the studio itself draws ``floor``.
    bones : mapping of str to ndarray (k, 3)
        Outermost points of the upright body's bones, m, from its root bone.
    floor : float
        Height, m, from the root bone.

    Returns
    -------
    list of Piece
    """
    if prop == "floor":
        return []
    pelvis = [points for name, points in bones.items() if name.startswith("hip_bone")] or list(bones.values())
    pelvis = np.concatenate(pelvis)
    lowest = pelvis[np.argmin(pelvis[:, 2])]
    seat = np.array([lowest[0], 0.0, lowest[2] - FLESH])
    if prop == "stool":
        return _stool(seat + [0.035, 0, 0], floor)
    back = [points for name, points in bones.items() if name.startswith(BACK_BONES)]
    back = np.concatenate(back) if back else pelvis
    return _chair(seat, floor, float(back[:, 0].min()), float(back[:, 2].max()))


def _stool(seat: np.ndarray, floor: float) -> list[Piece]:
    top, span = seat[2], seat[2] - floor
    cushion = [
        (0.0, -0.055),
        (0.165, -0.055),
        (0.178, -0.045),
        (0.18, -0.018),
        (0.172, -0.004),
        (0.15, 0.0),
        (0.0, 0.0),
    ]
    disc = turned([(r, top + z) for r, z in cushion], CUSHION, seat[:2])
    # Two tubes, one in the other, so that the seat may move up and down.
    stem = turned([(0.019, top - 0.75 * span), (0.019, top - 0.05)], METAL, seat[:2])
    foot = [
        (0.20, 0.0),
        (0.20, 0.010),
        (0.18, 0.018),
        (0.045, 0.034),
        (0.027, 0.05),
        (0.027, 0.5 * span),
        (0.0, 0.5 * span),
    ]
    stand = turned([(r, floor + z) for r, z in foot], METAL, seat[:2])
    return [_piece([disc, stem], Follows.PLACE), _piece([stand], Follows.NOTHING)]


def _chair(seat: np.ndarray, floor: float, rear: float, shoulder: float) -> list[Piece]:
    x, top = seat[0], seat[2]
    depth, rise = 0.43, max(shoulder - top, 0.3)
    middle = rear + depth / 2 + 0.01
    panel = 0.5 * rise
    shell = [
        box((middle, 0, top - 0.035), (depth, 0.42, 0.07), 0.03, CUSHION),
        box((rear - 0.03, 0, shoulder - panel / 2 - 0.09), (0.045, 0.34, panel), 0.024, CUSHION),
        box((rear - 0.065, 0, top + 0.33 * rise - 0.04), (0.022, 0.06, 0.75 * rise), 0.01, FRAME),
        box((rear + 0.06, 0, top - 0.082), (0.27, 0.07, 0.022), 0.01, FRAME),
        box((x + 0.03, 0, top - 0.095), (0.24, 0.17, 0.05), 0.02, FRAME),
    ]
    centre = (x + 0.03, 0.0)
    stem = [(0.05, -0.14), (0.05, -0.09), (0.0, -0.09)]
    column = [
        turned([(0.022, floor + 0.3 * (top - floor)), (0.022, top - 0.12)], METAL, centre),
        turned([(r, top + z) for r, z in stem], FRAME, centre),
        turned([(0.0, floor + 0.05), (0.045, floor + 0.05), (0.036, floor + 0.3), (0.0, floor + 0.3)], FRAME, centre),
    ]
    for turn in 2 * np.pi * (np.arange(5) + 0.5) / 5:
        along = np.array([np.cos(turn), np.sin(turn)])
        column.append(box((*(centre + 0.15 * along), floor + 0.075), (0.30, 0.045, 0.03), 0.012, FRAME, turn))
        column.append(box((*(centre + 0.275 * along), floor + 0.03), (0.06, 0.04, 0.06), 0.0195, FRAME, turn))
    return [_piece(shell, Follows.BONE), _piece(column, Follows.NOTHING)]


def _piece(meshes: list[Mesh], follows: Follows) -> Piece:
    return Piece(Part(join(meshes)).bake(), follows)
