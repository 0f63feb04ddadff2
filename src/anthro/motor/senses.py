"""Discrepancies between what a limb does and its target, as its controller is told them.

* ``position``: of hand or foot, three components in m (Nakada et al. 2018, Sec. 5.1.2).
* ``gaze``: azimuth and elevation in rad of where the head points (Sec. 5.1.1).
* ``orientation``: rotation vector in rad of T1 (Zhou et al. 2021, Sec. 4.1: three angular components).

Targets are in the world; discrepancies are in the frame of the limb's base bone, so that a limb does not notice where
the body that carries it stands.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation


@dataclass(frozen=True)
class Sense:
    """One kind of discrepancy.

    Attributes
    ----------
    width : number of components.
    mirror : (width,) signs under reflection left to right.
    feature : function of position (3,) and rotation (3, 3) of the effector: what is compared with a target.
    offset : function of target, position, rotation and the base's rotation: components (width,).
    jacobian : function of rotation and base's rotation and of the effector's Jacobians (3, d) of position and
        rotation, in the world: slopes (width, d) of what the offset is taken from.
    """

    width: int
    mirror: tuple[float, ...]
    feature: Callable
    offset: Callable
    jacobian: Callable


def angles(direction) -> np.ndarray:
    """Azimuth (to the left) and elevation in rad of a direction (3,)."""
    x, y, z = direction
    return np.array([np.arctan2(y, x), np.arctan2(z, np.hypot(x, y))])


def direction(azimuth: float, elevation: float) -> np.ndarray:
    """Unit vector (3,), or (3, n), of an azimuth (to the left) and an elevation in rad, or of n."""
    return np.array([np.cos(elevation) * np.cos(azimuth), np.cos(elevation) * np.sin(azimuth), np.sin(elevation)])


def _gaze_offset(target, position, rotation, base) -> np.ndarray:
    gap = angles(base.T @ target) - angles(base.T @ rotation[:, 0])
    gap[0] = (gap[0] + np.pi) % (2.0 * np.pi) - np.pi
    return gap


def _gaze_jacobian(rotation, base, linear, angular) -> np.ndarray:
    x, y, z = base.T @ rotation[:, 0]
    across = max(x * x + y * y, 1e-9)
    # the direction f turns by w x f
    turning = -base.T @ _cross_matrix(rotation[:, 0]) @ angular
    azimuth = (x * turning[1] - y * turning[0]) / across
    elevation = (turning[2] * across - z * (x * turning[0] + y * turning[1])) / np.sqrt(across)
    return np.stack([azimuth, elevation])


def _cross_matrix(v) -> np.ndarray:
    return np.array([[0.0, -v[2], v[1]], [v[2], 0.0, -v[0]], [-v[1], v[0], 0.0]])


SENSES = {
    "position": Sense(
        3,
        (1.0, -1.0, 1.0),
        lambda position, rotation: position.copy(),
        lambda target, position, rotation, base: base.T @ (target - position),
        lambda rotation, base, linear, angular: base.T @ linear,
    ),
    "gaze": Sense(2, (-1.0, 1.0), lambda position, rotation: rotation[:, 0].copy(), _gaze_offset, _gaze_jacobian),
    "orientation": Sense(
        3,
        (-1.0, 1.0, -1.0),
        lambda position, rotation: rotation.copy(),
        lambda target, position, rotation, base: Rotation.from_matrix(base.T @ target @ rotation.T @ base).as_rotvec(),
        lambda rotation, base, linear, angular: base.T @ angular,
    ),
}
