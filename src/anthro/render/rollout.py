"""A recorded rollout and the body that it moved, read for drawing."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from anthro.body import Body
from anthro.errors import UserError
from anthro.files import read_shard

COLUMNS = ("time", "qpos", "activation", "controller_on", "effector", "target")
PROPS = ("stool", "chair", "floor")
QUATERNION = slice(3, 7)  # of a free root's coordinates, and of a fixed root's place


@dataclass(frozen=True)
class Rollout:
    """What a demo recorded at T instants.

    Parameters
    ----------
    body : Body
        That moved.
    limbs : tuple of str
        Whose controllers moved it, k of them.
    time : ndarray (T,)
        s, increasing.
    qpos : ndarray (T, nq)
        rad; a free root's place comes first, m and a unit quaternion.
    activation : ndarray (T, n)
        0 to 1, of all muscles of the body.
    controller_on : ndarray (T,) bool
    effector, target : ndarray (T, k, 3)
        m, in the world; a target is NaN where there is none.
    base : ndarray (T, 7) or None
        Where a demo put the fixed root bone: m and a unit quaternion.
    others : dict of str to ndarray (T, ...)
        Whatever else the demo recorded at each instant.
    props : tuple of str
        Of `PROPS`: what the body sits or lies on.
    seed : int
    attrs : dict
        All that the file says of the rollout.
    """

    body: Body
    limbs: tuple[str, ...]
    time: np.ndarray
    qpos: np.ndarray
    activation: np.ndarray
    controller_on: np.ndarray
    effector: np.ndarray
    target: np.ndarray
    base: np.ndarray | None = None
    others: dict[str, np.ndarray] = field(default_factory=dict)
    props: tuple[str, ...] = ()
    seed: int = 0
    attrs: dict = field(default_factory=dict)

    def at(self, time: np.ndarray) -> Rollout:
        """The rollout at other times (m,), s: states interpolated, targets, switch and others held."""
        time = np.asarray(time, float)
        last = np.clip(np.searchsorted(self.time, time, side="right") - 1, 0, len(self.time) - 1)
        after = np.minimum(last + 1, len(self.time) - 1)
        gap = np.maximum(self.time[after] - self.time[last], 1e-12)
        share = np.clip((time - self.time[last]) / gap, 0, 1)

        def between(column: np.ndarray) -> np.ndarray:
            weight = share.reshape(-1, *[1] * (column.ndim - 1))
            return (1 - weight) * column[last] + weight * column[after]

        def placed(column: np.ndarray) -> np.ndarray:
            values = between(column)
            values[:, QUATERNION] = slerp(column[last, QUATERNION], column[after, QUATERNION], share)
            return values

        return Rollout(
            self.body,
            self.limbs,
            time,
            placed(self.qpos) if self.body.root_free else between(self.qpos),
            between(self.activation),
            self.controller_on[last],
            between(self.effector),
            self.target[last],
            None if self.base is None else placed(self.base),
            {name: column[last] for name, column in self.others.items()},
            self.props,
            self.seed,
            self.attrs,
        )

    def switches(self) -> np.ndarray:
        """Times (m,), s, at which the controller was turned on or off."""
        return self.time[1:][np.diff(self.controller_on.astype(int)) != 0]


def slerp(start: np.ndarray, end: np.ndarray, share: np.ndarray) -> np.ndarray:
    """Unit quaternions (m, 4) at shares (m,) of the shorter turns from `start` to `end` (m, 4)."""
    first, last = (Rotation.from_quat(quaternions, scalar_first=True) for quaternions in (start, end))
    way = (first.inv() * last).as_rotvec()
    return (first * Rotation.from_rotvec(share[:, None] * way)).as_quat(scalar_first=True)


def read_rollout(run: Path, demo: str) -> Rollout:
    """Read ``<run>/demos/<demo>/rollout.h5`` and the body that it names.

    Raises
    ------
    UserError
        Naming the file: missing, incomplete, of inconsistent shapes, not finite, or not of its body.
    """
    path = Path(run) / "demos" / demo / "rollout.h5"
    columns, attrs = read_shard(path)
    if missing := [name for name in COLUMNS if name not in columns]:
        raise UserError(f"{path}: no column {', '.join(missing)} (it has {', '.join(columns)})")
    if missing := [name for name in ("body", "limbs") if name not in attrs]:
        raise UserError(f"{path}: no attribute {missing[0]}")
    limbs, props = (tuple(str(attrs.get(name, "")).split()) for name in ("limbs", "props"))
    if unknown := [prop for prop in props if prop not in PROPS]:
        raise UserError(f"{path}: unknown prop {unknown[0]!r}; known: {', '.join(PROPS)}")
    values = {name: np.asarray(columns.pop(name), float) for name in COLUMNS}
    base = columns.pop("base", None)
    if base is not None:
        values["base"] = np.asarray(base, float)
    body = load_body(run, str(attrs["body"]))
    _check(path, values, body, len(limbs))
    values["controller_on"] = values["controller_on"] > 0.5
    count = len(values["time"])
    others = {name: column for name, column in columns.items() if np.shape(column)[:1] == (count,)}
    seed = int(attrs.get("seed", 0))
    return Rollout(body=body, limbs=limbs, **values, others=others, props=props, seed=seed, attrs=attrs)


def load_body(run: Path, name: str) -> Body:
    """The body ``<run>/body/<name>``; UserError if it is missing."""
    return Body.load(Path(run) / "body" / name)


def _check(path: Path, values: dict[str, np.ndarray], body: Body, limbs: int) -> None:
    """Refuse columns that do not fit each other or the body."""
    count = len(values["time"])
    if count < 2 or not (np.diff(values["time"]) > 0).all():
        raise UserError(f"{path}: column time does not increase over at least two instants")
    shapes = {
        "qpos": (count, body.model.nq),
        "activation": (count, body.muscle_count),
        "controller_on": (count,),
        "effector": (count, limbs, 3),
        "target": (count, limbs, 3),
        "base": (count, 7),
    }
    for name, column in values.items():
        shape = shapes.get(name, column.shape)
        if column.shape != shape:
            raise UserError(f"{path}: column {name} has shape {column.shape}, body {body.name} asks for {shape}")
        if name != "target" and not np.isfinite(column).all():
            raise UserError(f"{path}: column {name} is not finite")
    if "base" in values and body.root_free:
        raise UserError(f"{path}: column base moves a fixed root, that of body {body.name} is free")
    turned = [values["base"]] if "base" in values else [values["qpos"]] if body.root_free else []
    for column in turned:
        if not np.allclose(np.linalg.norm(column[:, QUATERNION], axis=1), 1, atol=1e-3):
            raise UserError(f"{path}: a quaternion of its root is not of unit length")
