"""A built body on disk and in memory."""

from __future__ import annotations

import csv
from dataclasses import dataclass
from pathlib import Path

import mujoco
import numpy as np

from anthro.errors import UserError


@dataclass(frozen=True)
class Body:
    """A compiled body of m degrees of freedom and n muscles.

    Attributes
    ----------
    model : MuJoCo model; tendon i is the path of muscle i, site ``hand`` the end effector.
    q_rest : (m,) rad.  q_range : (m, 2) rad.  joint_damping : (m,) N m s/rad.
    max_force : (n,) N.  slack_length, tendon_length : (n,) m.
    """

    name: str
    model: mujoco.MjModel
    dof_names: tuple[str, ...]
    q_rest: np.ndarray
    q_range: np.ndarray
    joint_damping: np.ndarray
    muscle_names: tuple[str, ...]
    muscle_groups: tuple[str, ...]
    max_force: np.ndarray
    slack_length: np.ndarray
    tendon_length: np.ndarray
    hand_site: int

    dof_count = property(lambda self: len(self.dof_names))
    muscle_count = property(lambda self: len(self.muscle_names))

    @classmethod
    def load(cls, folder: Path) -> Body:
        """Load what ``anthro.body.build`` wrote.

        Raises
        ------
        UserError
            A file is missing, unreadable, or does not fit the others.
        """
        folder = Path(folder)
        try:
            model = mujoco.MjModel.from_binary_path(str(folder / "model.mjb"))
        except ValueError as error:
            line = str(error).strip().splitlines()[0]
            raise UserError(f"{folder / 'model.mjb'}: cannot be loaded ({line})") from None
        joints = _columns(
            folder / "joints.csv", names=("joint",), numbers=("min", "max", "rest", "damping")
        )
        muscles = _columns(
            folder / "muscles.csv",
            names=("muscle", "group"),
            numbers=("max_force", "slack_length", "tendon_length"),
        )
        if len(joints["joint"]) != model.nv or len(muscles["muscle"]) != model.ntendon:
            raise UserError(f"{folder}: tables and model.mjb disagree; build the body again")
        return cls(
            name=folder.name,
            model=model,
            dof_names=tuple(joints["joint"]),
            q_rest=joints["rest"],
            q_range=np.stack([joints["min"], joints["max"]], axis=1),
            joint_damping=joints["damping"],
            muscle_names=tuple(muscles["muscle"]),
            muscle_groups=tuple(muscles["group"]),
            max_force=muscles["max_force"],
            slack_length=muscles["slack_length"],
            tendon_length=muscles["tendon_length"],
            hand_site=mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_SITE, "hand"),
        )

    def simulator(self, step: float | None = None):
        """A fresh :class:`~anthro.body.simulator.Simulator` at rest."""
        from anthro.body.simulator import DEFAULT_STEP, Simulator

        return Simulator(self, DEFAULT_STEP if step is None else step)


def _columns(path: Path, names: tuple[str, ...], numbers: tuple[str, ...]) -> dict:
    if not path.is_file():
        raise UserError(f"{path}: missing; build the body first")
    with path.open(newline="") as stream:
        rows = list(csv.DictReader(stream))
    missing = [name for name in names + numbers if not rows or name not in rows[0]]
    if missing:
        raise UserError(f"{path}: column {missing[0]} is missing")
    columns = {name: [row[name] for row in rows] for name in names}
    try:
        return columns | {name: np.array([float(row[name]) for row in rows]) for name in numbers}
    except (TypeError, ValueError) as error:
        raise UserError(f"{path}: {error}") from None
