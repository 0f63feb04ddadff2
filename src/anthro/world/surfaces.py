"""Flat surfaces that balls bounce on."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from anthro.errors import UserError

UP = (0.0, 0.0, 1.0)


@dataclass(frozen=True)
class Slope:
    """A rectangle that balls bounce off on both sides.

    Attributes
    ----------
    name : what a record of bounces calls it.
    centre : (3,) m.
    normal, along : (3,) directions, made of length one: of the surface, and of one pair of its edges.
    half_size : (2,) m, half the sides along ``along`` and across it.
    restitution : share of the speed towards it that a ball leaves with.
    friction : Coulomb's coefficient; slipping ends within the bounce where it suffices.

    Raises
    ------
    UserError
        A vector that is not finite, directions that are no two, a size that is not positive, a restitution that is
        not of [0, 1] or a negative friction.
    """

    name: str
    centre: tuple[float, float, float]
    normal: tuple[float, float, float] = UP
    along: tuple[float, float, float] = (1.0, 0.0, 0.0)
    half_size: tuple[float, float] = (0.3, 0.3)
    restitution: float = 0.7
    friction: float = 0.2

    def __post_init__(self):
        numbers = np.concatenate([self.centre, self.normal, self.along, self.half_size])
        if numbers.shape != (11,) or not np.isfinite(numbers).all():
            raise UserError(f"slope {self.name}: place and size must be finite numbers")
        if np.linalg.norm(np.cross(self.normal, self.along)) <= 1e-9:
            raise UserError(f"slope {self.name}: normal and along must be two directions that are not parallel")
        if not min(self.half_size) > 0.0:
            raise UserError(f"slope {self.name}: its size must be positive, got {self.half_size}")
        if not (0.0 <= self.restitution <= 1.0 and self.friction >= 0.0):
            raise UserError(f"slope {self.name}: restitution must be of [0, 1] and friction not negative")

    @property
    def axes(self) -> np.ndarray:
        """Directions (3, 3) of the edges and of the normal, as rows."""
        normal = np.array(self.normal) / np.linalg.norm(self.normal)
        along = np.array(self.along) - (self.along @ normal) * normal
        along /= np.linalg.norm(along)
        return np.stack([along, np.cross(normal, along), normal])


def tilted(name: str, centre, towards, angle: float, **details) -> Slope:
    """A slope that falls by ``angle`` rad in the horizontal direction ``towards`` (2,)."""
    x, y = np.asarray(towards, float) / np.linalg.norm(towards)
    sine, cosine = np.sin(angle), np.cos(angle)
    down = (float(x * cosine), float(y * cosine), float(-sine))
    return Slope(name, tuple(centre), (float(x * sine), float(y * sine), float(cosine)), down, **details)


FLOOR = Slope("floor", (0.0, 0.0, 0.0), half_size=(50.0, 50.0))
