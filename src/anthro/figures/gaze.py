"""What rollouts of the closed loop tell of gaze, balls and limbs, trial by trial."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import mujoco
import numpy as np

from anthro.errors import UserError
from anthro.eyes.eye import SIDES, Eye
from anthro.eyes.layout import Layout, layout
from anthro.render.rollout import Rollout, read_rollout

FOVEA = np.deg2rad(1.0)  # a ball nearer to the gaze is foveated
COLUMNS = {"trial": (), "ball": (None, 3), "eyes": (2, 2), "nerve": (2, None)}  # what one row of each is


def read(run: Path, demo: str) -> Rollout:
    """Read a rollout with its trials, balls, eyes and optic nerve vectors.

    Raises
    ------
    UserError
        The rollout is missing or does not fit, or lacks one of these.
    """
    rollout = read_rollout(run, demo)
    for name, shape in COLUMNS.items():
        found = np.shape(rollout.others.get(name))[1:]
        fits = len(found) == len(shape) and all(a in (None, b) for a, b in zip(shape, found, strict=True))
        if name not in rollout.others or not fits:
            raise UserError(f"demo {demo}: no column {name} of the shape that figures need")
    return rollout


def retinas(rollout: Rollout) -> tuple[Layout, Layout]:
    """Receptors of both eyes; UserError for optic nerve vectors of another width than theirs."""
    name = str(rollout.attrs.get("retina", "log_polar"))
    left, right = (layout(name, side, rollout.seed) for side in SIDES)
    if (width := rollout.others["nerve"].shape[2]) != left.width:
        raise UserError(f"optic nerve vectors of {width} numbers, but retina {name} tells {left.width}")
    return left, right


def trials(rollout: Rollout) -> list[np.ndarray]:
    """Indices (k,) of each trial's instants."""
    number = rollout.others["trial"]
    return [np.flatnonzero(number == one) for one in np.unique(number)]


def gaze_error(rollout: Rollout) -> np.ndarray:
    """Angles (T, 2), rad, between each eye's gaze and the way from its centre to the first ball; NaN without one."""
    body, ball = rollout.body, rollout.others["ball"][:, 0]
    data, site = mujoco.MjData(body.model), body.effector("head")
    error = np.full((len(rollout.time), 2), np.nan)
    for index in np.flatnonzero(np.isfinite(ball).all(axis=1)):
        data.qpos[:] = rollout.qpos[index]
        mujoco.mj_kinematics(body.model, data)
        local = (ball[index] - data.site_xpos[site]) @ data.site_xmat[site].reshape(3, 3)
        for side, angles in enumerate(rollout.others["eyes"][index]):
            eye = Eye(SIDES[side])
            x, y, z = (local - eye.centre) @ eye.rotation(angles)
            error[index, side] = np.arctan2(np.hypot(y, z), x)
    return error


def distances(rollout: Rollout) -> np.ndarray:
    """Distances (T, k), m, of each limb's effector from the nearest ball; NaN without one."""
    apart = np.linalg.norm(rollout.effector[:, :, None] - rollout.others["ball"][:, None], axis=3)
    nearest = np.where(np.isfinite(apart), apart, np.inf).min(axis=2)
    return np.where(np.isfinite(nearest), nearest, np.nan)


def reaching(rollout: Rollout, trial: np.ndarray) -> tuple[int, np.ndarray]:
    """Which limb comes nearest to a ball in a trial (k,), and its distances (k,), m, from it; UserError without one."""
    apart = np.nan_to_num(distances(rollout)[trial], nan=np.inf)
    limb = int(np.argmin(apart.min(axis=0)))
    if not np.isfinite(apart[:, limb]).any():
        raise UserError(f"trial {rollout.others['trial'][trial[0]]}: there is no ball")
    return limb, apart[:, limb]


def farthest(rollout: Rollout) -> tuple[np.ndarray, np.ndarray]:
    """The trial (k,) whose ball is at first farthest from the limb that reaches for it, and their distances (k,), m."""
    found = [(trial, reaching(rollout, trial)[1]) for trial in trials(rollout)]
    return max(found, key=lambda one: one[1][np.isfinite(one[1])][0])


def approach(distance: np.ndarray, shares: Sequence[float]) -> np.ndarray:
    """Instants at which an effector has so much of its way left.

    Parameters
    ----------
    distance : ndarray (k,)
        From the ball, m; infinite without one.
    shares : sequence of float
        Of the way from the first to the least distance: 1 at first, 0 where it is nearest.

    Returns
    -------
    ndarray (n,)
    """
    nearest, start = int(np.argmin(distance)), distance[first(np.isfinite(distance), 0)]
    left = distance[nearest] + np.asarray(shares) * (start - distance[nearest])
    return np.array([first(distance[: nearest + 1] <= least, nearest) for least in left])


def first(condition: np.ndarray, otherwise: int) -> int:
    """Index of the first instant (k,) that meets a condition."""
    return int(np.argmax(condition)) if condition.any() else otherwise


def after(time: np.ndarray, index: int, seconds: float) -> int:
    """Index of the first of times (k,), s, that comes so long after that of an index; the last one if none does."""
    return first(time >= time[index] + seconds, len(time) - 1)
