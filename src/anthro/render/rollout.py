"""A recorded rollout, read for drawing."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from anthro.body import Body
from anthro.errors import UserError
from anthro.files import read_shard

COLUMNS = ("time", "qpos", "activation", "hand", "target", "controller_on")


@dataclass(frozen=True)
class Rollout:
    """What a demo recorded at T instants.

    Parameters
    ----------
    time : ndarray (T,)
        s, increasing.
    qpos : ndarray (T, m)
        rad.
    activation : ndarray (T, n)
        0 to 1.
    hand, target : ndarray (T, 3)
        m; the target is NaN where there is none.
    controller_on : ndarray (T,) bool
    limb : str
    seed : int
    """

    time: np.ndarray
    qpos: np.ndarray
    activation: np.ndarray
    hand: np.ndarray
    target: np.ndarray
    controller_on: np.ndarray
    limb: str
    seed: int

    def at(self, time: np.ndarray) -> Rollout:
        """The rollout at other times (k,), s: states interpolated, targets and switch held."""
        time = np.asarray(time, float)
        last = np.clip(np.searchsorted(self.time, time, side="right") - 1, 0, len(self.time) - 1)

        def between(column: np.ndarray) -> np.ndarray:
            series = [np.interp(time, self.time, values) for values in column.T]
            return np.stack(series, axis=1)

        return Rollout(
            time,
            between(self.qpos),
            between(self.activation),
            between(self.hand),
            self.target[last],
            self.controller_on[last],
            self.limb,
            self.seed,
        )

    def switches(self) -> np.ndarray:
        """Times (k,), s, at which the controller was turned on or off."""
        return self.time[1:][np.diff(self.controller_on.astype(int)) != 0]


def read_rollout(run: Path, demo: str) -> Rollout:
    """Read ``<run>/demos/<demo>/rollout.h5``.

    Raises
    ------
    UserError
        Naming the file: missing, incomplete, of inconsistent lengths, or not finite.
    """
    path = Path(run) / "demos" / demo / "rollout.h5"
    columns, attrs = read_shard(path, COLUMNS)
    lengths = {len(values) for values in columns.values()}
    if len(lengths) != 1 or lengths.pop() < 2:
        raise UserError(f"{path}: columns differ in length, or hold fewer than two instants")
    values = {name: np.asarray(column, float) for name, column in columns.items()}
    for name in ("time", "qpos", "activation", "hand"):
        if not np.isfinite(values[name]).all():
            raise UserError(f"{path}: column {name} is not finite")
    on = values.pop("controller_on") > 0.5
    limb, seed = str(attrs.get("limb", "right_arm")), int(attrs.get("seed", 0))
    return Rollout(**values, controller_on=on, limb=limb, seed=seed)


def load_body(run: Path, rollout: Rollout) -> Body:
    """The body of a run that a rollout moved.

    Raises
    ------
    UserError
        The body is missing, or has other degrees of freedom or muscles than the rollout.
    """
    folder = Path(run) / "body" / rollout.limb
    body = Body.load(folder)
    recorded = (rollout.qpos.shape[1], rollout.activation.shape[1])
    expected = (len(body.dof_names), len(body.muscle_names))
    if recorded != expected:
        raise UserError(
            f"{folder}: has {expected[0]} degrees of freedom and {expected[1]} muscles, "
            f"the rollout {recorded[0]} and {recorded[1]}"
        )
    return body
