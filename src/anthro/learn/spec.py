"""What a training is asked for: the net's YAML merged with the scale's sizes."""

import math
import os
from dataclasses import dataclass, field, fields

from anthro.errors import UserError
from anthro.files import digest, read_json

SCHEDULES = ("constant", "cosine")
STARTS = ("he", "linear", "retinotopic")
FIELDS = ("retina", "side", "cones", "neighbours")  # of a retinotopic start
COSINE_FLOOR = 0.01


@dataclass(frozen=True)
class TrainingSpec:
    """One training.

    Attributes
    ----------
    name : str
        The net.
    inputs, outputs : tuple of str
        Columns of the shards, in the order in which they are joined.
    hidden : tuple of int
        Units of each hidden layer.
    learning_rate : float
        Adam's step size (Nakada 2018 prints 1e-3 under that name, and a "learning rate" of 1e-6).
    batch_size : int
        Pairs a step.
    epochs : int
        At most so many.
    seed : int
        The run's seed.
    patience : int
        Training stops after so many successive epochs without gain.
    schedule : {"constant", "cosine"}
        Constant as in the paper, or falling to 1 % over `epochs` along half a cosine.
    start : {"he", "linear", "retinotopic"}
        Initial weights: He's as in the papers, or those of :mod:`anthro.learn.linear` or
        :mod:`anthro.learn.retinotopic`.
    receptive_fields : dict
        Of a retinotopic start: ``retina`` and ``side`` of the eye whose optic nerve vectors are the inputs, ``cones``
        that units listen to, and ``neighbours``, how many receptors lie within a field's width.
    fixed_epochs : int
        First epochs in which the first layer stays as it starts.
    softening : dict of str to float
        Scale s of ``asinh(x / s)`` for input and output columns, in the column's unit. Softened
        labels make the loss relative: small adjustments near the target count as much as large ones.
    samples : int or None
        Use only so many pairs.
    validation_block : int
        Successive pairs of a shard that go to the same side of the split; 1 splits single pairs.
    digest : str
        SHA-256 of the whole spec file, keys unknown here included.
    """

    name: str
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    hidden: tuple[int, ...]
    learning_rate: float
    batch_size: int
    epochs: int
    seed: int
    patience: int = 10
    schedule: str = "constant"
    start: str = "he"
    receptive_fields: dict = field(default_factory=dict)
    fixed_epochs: int = 0
    softening: dict[str, float] = field(default_factory=dict)
    samples: int | None = None
    validation_block: int = 1
    digest: str = ""

    def rate(self, epoch: int) -> float:
        """Return the learning rate of an epoch, 1 to `epochs`."""
        if self.schedule == "constant":
            return self.learning_rate
        done = (epoch - 1) / max(1, self.epochs - 1)
        return self.learning_rate * (COSINE_FLOOR + (1 - COSINE_FLOOR) * (1 + math.cos(math.pi * done)) / 2)


def _positive_int(value) -> bool:
    return type(value) is int and value > 0


def _names(value) -> bool:
    return isinstance(value, list) and bool(value) and all(isinstance(name, str) for name in value)


CHECKS = {
    "name": (lambda v: isinstance(v, str), "a string"),
    "inputs": (_names, "a list of columns"),
    "outputs": (_names, "a list of columns"),
    "hidden": (lambda v: isinstance(v, list) and v and all(map(_positive_int, v)), "a list of units"),
    "learning_rate": (lambda v: type(v) in (int, float) and 0 < v < math.inf, "a positive number"),
    "batch_size": (_positive_int, "a positive integer"),
    "epochs": (_positive_int, "a positive integer"),
    "seed": (lambda v: type(v) is int and v >= 0, "an integer, at least 0"),
    "patience": (_positive_int, "a positive integer"),
    "schedule": (lambda v: v in SCHEDULES, f"one of {', '.join(SCHEDULES)}"),
    "start": (lambda v: v in STARTS, f"one of {', '.join(STARTS)}"),
    "receptive_fields": (lambda v: isinstance(v, dict) and set(v) == set(FIELDS), f"an object of {', '.join(FIELDS)}"),
    "fixed_epochs": (lambda v: type(v) is int and v >= 0, "an integer, at least 0"),
    "softening": (
        lambda v: isinstance(v, dict) and all(type(s) in (int, float) and s >= 0 for s in v.values()),
        "a scale, at least 0, for each column named",
    ),
    "samples": (lambda v: v is None or _positive_int(v), "a positive integer"),
    "validation_block": (_positive_int, "a positive integer"),
}


def read_spec(path: str | os.PathLike) -> tuple[TrainingSpec, dict]:
    """Read and check a training's spec.

    Parameters
    ----------
    path : path-like
        JSON with the keys of `TrainingSpec`; others are carried in the run card and its digest.

    Returns
    -------
    spec : TrainingSpec
        The checked spec.
    content : dict
        All that the file holds.

    Raises
    ------
    UserError
        Naming the file, the key and the value, when one is missing or of the wrong kind.
    """
    content = read_json(path)
    if not isinstance(content, dict):
        raise UserError(f"{path}: a spec is an object of keys and values")
    required = [f.name for f in fields(TrainingSpec) if f.name in CHECKS and f.name not in OPTIONAL]
    if missing := [name for name in required if name not in content]:
        raise UserError(f"{path}: key {', '.join(missing)} is missing")
    given = {name: content[name] for name in CHECKS if name in content}
    for name, value in given.items():
        fits, wanted = CHECKS[name]
        if not fits(value):
            raise UserError(f"{path}: {name}: {value!r} is not {wanted}")
    if odd := sorted(set(given.get("softening", {})) - set(given["inputs"]) - set(given["outputs"])):
        raise UserError(f"{path}: softening: {', '.join(odd)} is not among the inputs and outputs")
    if given.get("start") == "retinotopic" and "receptive_fields" not in given:
        raise UserError(f"{path}: receptive_fields: a retinotopic start needs to know whose retina it is")
    plain = {name: tuple(value) if isinstance(value, list) else value for name, value in given.items()}
    return TrainingSpec(**plain, digest=digest(content)), content


OPTIONAL = (
    *("patience", "schedule", "start", "receptive_fields", "fixed_epochs"),
    *("softening", "samples", "validation_block"),
)
