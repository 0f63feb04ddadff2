"""From shards to a data set: joined columns, the 90/10 split, normalisation from the training side."""

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from anthro.errors import UserError
from anthro.files import read_shard
from anthro.learn.spec import TrainingSpec
from anthro.motor.network import soften
from anthro.streams import stream

FOLDS = 10  # one block in ten validates (Nakada 2018, footnote 5: 90 % train, 10 % are reserved)


@dataclass(frozen=True)
class Pairs:
    """Pairs of a data set in physical units.

    Attributes
    ----------
    inputs : ndarray of float32, (n, n_in)
        The input columns, joined.
    outputs : ndarray of float32, (n, n_out)
        The labels, joined.
    validation : ndarray of bool, (n,)
        True for the pairs that only validate.
    softening : ndarray of float32, (n_in,)
        The spec's softening of each input.
    output_softening : ndarray of float32, (n_out,)
        The spec's softening of each label.
    """

    inputs: np.ndarray
    outputs: np.ndarray
    validation: np.ndarray
    softening: np.ndarray
    output_softening: np.ndarray

    def digest(self) -> str:
        """Return the SHA-256 (hex) of everything that training sees."""
        total = hashlib.sha256()
        for values in (self.inputs, self.outputs, self.validation, self.softening, self.output_softening):
            total.update(str(values.shape).encode())
            total.update(np.ascontiguousarray(values))
        return total.hexdigest()


def _matrix(path: str, columns: dict[str, np.ndarray], names: Sequence[str]) -> np.ndarray:
    """Join columns of one shard, (n, width), after checking them."""
    parts = []
    for name in names:
        values = columns[name]
        if values.ndim not in (1, 2) or len(values) != len(columns[names[0]]):
            raise UserError(f"{path}: column {name} has shape {values.shape}, the rows do not match")
        if not np.isfinite(values).all():
            row = int(np.argwhere(~np.isfinite(values))[0, 0])
            raise UserError(f"{path}: column {name} is not finite (row {row})")
        parts.append(values.reshape(len(values), -1))
    return np.concatenate(parts, axis=1, dtype=np.float32)


def validation_side(n: int, generator: np.random.Generator, block: int = 1) -> np.ndarray:
    """Choose the pairs of a shard that validate: one block of every ten.

    Parameters
    ----------
    n : int
        Pairs in the shard.
    generator : numpy.random.Generator
        Draws which block of each ten.
    block : int
        Successive pairs in a block.

    Returns
    -------
    ndarray of bool, (n,)
        True for a tenth of the pairs, exactly so when n is a multiple of ten blocks.
    """
    blocks = -(-n // block)
    chosen = generator.integers(FOLDS, size=-(-blocks // FOLDS))
    index = np.arange(n) // block
    return index % FOLDS == chosen[index // FOLDS]


def _widths(path: str, columns: dict[str, np.ndarray], names: Sequence[str]) -> list[int]:
    return [columns[name].shape[1] if columns[name].ndim == 2 else 1 for name in names]


def _subset(validation: np.ndarray, samples: int, generator: np.random.Generator) -> np.ndarray:
    """Choose `samples` pairs, a tenth of them from the validation side; sorted indices."""
    reserved = min(max(1, round(samples / FOLDS)), int(validation.sum()))
    sides = (np.flatnonzero(validation), reserved), (np.flatnonzero(~validation), samples - reserved)
    return np.sort(np.concatenate([generator.permutation(side)[:count] for side, count in sides]))


def load_pairs(spec: TrainingSpec, shards: Sequence[str]) -> Pairs:
    """Read the pairs of a training.

    A shard's split depends on the run's seed and on the shard's place in the list alone. With the
    shards of a new round of aggregation at the end, a pair that validates does so in all rounds.

    Parameters
    ----------
    spec : TrainingSpec
        Columns, seed, `samples`, `validation_block`.
    shards : sequence of path-like
        Files of `anthro.files.write_shard`, oldest round first.

    Returns
    -------
    Pairs
        All pairs, or `spec.samples` of them.

    Raises
    ------
    UserError
        Naming the shard (and column), when one is truncated, not finite or of another width, or
        when there are fewer pairs than wanted.
    """
    inputs, outputs, validation, widths = [], [], [], None
    for index, path in enumerate(shards):
        columns, _ = read_shard(path, dict.fromkeys(spec.inputs + spec.outputs))
        inputs.append(_matrix(path, columns, spec.inputs))
        outputs.append(_matrix(path, columns, spec.outputs))
        if len(inputs[-1]) != len(outputs[-1]):
            raise UserError(f"{path}: {len(inputs[-1])} rows of inputs, {len(outputs[-1])} of outputs")
        found = _widths(path, columns, spec.inputs), _widths(path, columns, spec.outputs)
        widths = widths or found
        if found != widths:
            raise UserError(f"{path}: columns of width {found}, but {widths} in {shards[0]}")
        generator = stream(spec.seed, "learn/split", index)
        validation.append(validation_side(len(inputs[-1]), generator, spec.validation_block))
    softenings = [
        np.repeat([spec.softening.get(name, 0.0) for name in names], width).astype(np.float32)
        for names, width in zip((spec.inputs, spec.outputs), widths, strict=True)
    ]
    columns = [np.concatenate(parts) for parts in (inputs, outputs, validation)]
    if spec.samples is not None:
        if len(columns[0]) < spec.samples:
            raise UserError(f"{spec.name}: {spec.samples} samples wanted, the shards hold {len(columns[0])}")
        kept = _subset(columns[2], spec.samples, stream(spec.seed, "learn/samples"))
        columns = [values[kept] for values in columns]
    if columns[2].all() or not columns[2].any():
        raise UserError(f"{spec.name}: {len(columns[2])} pairs are too few to be split in ten")
    return Pairs(*columns, *softenings)


def _scale(values: np.ndarray) -> np.ndarray:
    """Return the standard deviation of columns, 1 for those that do not vary."""
    deviation = values.std(axis=0, dtype=float)
    floor = 1e-6 * np.abs(values).max(axis=0)  # rounding noise of a constant is no variation
    return np.where(deviation > floor, deviation, 1.0)


def normalisation(pairs: Pairs) -> dict[str, np.ndarray]:
    """Return means and scales from the training side, in the form of `FeedForward.normalisation`."""
    training = ~pairs.validation
    inputs = soften(pairs.inputs, pairs.softening)[training]
    outputs = soften(pairs.outputs, pairs.output_softening)[training]
    values = {
        "input_softening": pairs.softening,
        "input_mean": inputs.mean(axis=0, dtype=float),
        "input_scale": _scale(inputs),
        "output_softening": pairs.output_softening,
        "output_mean": outputs.mean(axis=0, dtype=float),
        "output_scale": _scale(outputs),
        "output_limit": np.where(pairs.output_softening > 0, np.abs(pairs.outputs[training]).max(axis=0), 0.0),
    }
    return {name: value.astype(np.float32) for name, value in values.items()}


def normalise(pairs: Pairs, factors: dict[str, np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
    """Return the normalised inputs (n, n_in) and outputs (n, n_out), float32."""
    inputs = (soften(pairs.inputs, factors["input_softening"]) - factors["input_mean"]) / factors["input_scale"]
    outputs = (soften(pairs.outputs, factors["output_softening"]) - factors["output_mean"]) / factors["output_scale"]
    return inputs, outputs
