"""Reading trainings back: loss curves, ablation tables, and what "converged" means."""

import csv
import os
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from anthro.errors import UserError
from anthro.files import read_json

TOLERANCE = 0.05  # converged: within 5 % of the common level
SETTLED = 1.1  # a training that ends within 10 % of its own best has settled


@dataclass(frozen=True)
class Trial:
    """One row of an ablation table.

    Attributes
    ----------
    row : str
        The row's name, that of its folder.
    hidden : tuple of int
        Units of each hidden layer.
    learning_rate : float
        Of the spec.
    losses : dict of str to ndarray, (epochs,)
        Columns of ``loss.csv``.
    weights : int
        Number of weights, biases not counted.
    """

    row: str
    hidden: tuple[int, ...]
    learning_rate: float
    losses: dict[str, np.ndarray]
    weights: int

    @property
    def best(self) -> float:
        """Lowest validation MSE, normalised."""
        return float(self.losses["validation_mse"].min())

    @property
    def epoch_seconds(self) -> float:
        """Median time of an epoch, s."""
        return float(np.median(self.losses["seconds"]))

    @property
    def settled(self) -> bool:
        """Whether the validation MSE fell, and ended within 10 % of its lowest value."""
        curve = self.losses["validation_mse"]
        return bool(np.isfinite(curve).all() and curve[-1] <= SETTLED * curve.min() and curve.min() < curve[0])

    def epochs_to(self, level: float) -> float:
        """Return when the validation MSE first falls to `level`.

        Epochs are counted from 1; between two of them the logarithm of the error is interpolated,
        so that fast nets can be told apart. A net that never gets there counts with its last epoch.
        """
        curve = np.log(self.losses["validation_mse"])
        wanted = np.log(level)
        below = np.flatnonzero(curve <= wanted)
        if not below.size:
            return float(len(curve))
        first = below[0]
        if first == 0:
            return 1.0
        return float(first + (curve[first - 1] - wanted) / (curve[first - 1] - curve[first]))


def common_level(trials: list[Trial]) -> float:
    """Return the validation MSE that counts as converged in a table.

    It is 5 % above the best of the net that came out worst, so that every net of the table reaches it.
    """
    return (1 + TOLERANCE) * max(trial.best for trial in trials)


def read_losses(path: str | os.PathLike) -> dict[str, np.ndarray]:
    """Read a ``loss.csv``: its columns, (epochs,) each.

    Raises
    ------
    UserError
        Naming the file, when it is missing, empty or no table of numbers.
    """
    try:
        with open(path, newline="", encoding="utf-8") as file:
            rows = list(csv.DictReader(file))
        columns = {name: np.array([float(row[name]) for row in rows]) for name in rows[0]}
    except FileNotFoundError:
        raise UserError(f"{path}: no such file") from None
    except (IndexError, TypeError, ValueError):
        raise UserError(f"{path}: not a table of losses") from None
    if missing := {"epoch", "train_mse", "validation_mse", "seconds"} - set(columns):
        raise UserError(f"{path}: no column {', '.join(sorted(missing))}")
    return columns


def read_trial(folder: str | os.PathLike) -> Trial:
    """Read one row of an ablation table from its folder.

    Raises
    ------
    UserError
        Naming the file that is missing or is not what it should be.
    """
    folder = Path(folder)
    card = read_json(folder / "run_card.json")
    try:
        spec = card["spec"]
        return Trial(
            row=folder.name,
            hidden=tuple(spec["hidden"]),
            learning_rate=float(spec["learning_rate"]),
            losses=read_losses(folder / "loss.csv"),
            weights=int(card["weights"]),
        )
    except (KeyError, TypeError, ValueError):
        raise UserError(f"{folder / 'run_card.json'}: not the card of a training") from None


def read_table(run: str | os.PathLike, table: str) -> list[Trial]:
    """Read the rows of ``<run>/ablations/<table>``, in the order of their names.

    Raises
    ------
    UserError
        Naming the folder, when there are none.
    """
    folder = Path(run) / "ablations" / table
    cards = sorted(folder.glob("*/run_card.json"))
    if not cards:
        raise UserError(f"{folder}: no trained rows")
    return [read_trial(card.parent) for card in cards]


def read_rounds(net: str | os.PathLike) -> list[dict[str, np.ndarray]]:
    """Read the loss curves of a net's rounds of aggregation, ``<net>/round*/loss.csv``, oldest first.

    Raises
    ------
    UserError
        Naming the folder, when there are none.
    """
    rounds = sorted(Path(net).glob("round*/loss.csv"), key=lambda path: int(path.parent.name[5:]))
    if not rounds:
        raise UserError(f"{net}: no trained rounds")
    return [read_losses(path) for path in rounds]
