"""From shards to pairs, a shard at a time: joined columns, the 90/10 split, statistics of the training side.

No more than one shard is in memory: a training of a million pairs of 1,332 columns needs little more than a small one.
"""

import hashlib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from anthro.errors import UserError
from anthro.files import read_shard
from anthro.learn.spec import TrainingSpec
from anthro.motor.network import soften
from anthro.streams import stream

FOLDS = 10  # one block in ten validates (Nakada 2018, footnote 5: 90 % train, 10 % are reserved)
BLOCK = 4096  # pairs that are worked on at once
TRAINING, VALIDATION, UNUSED = 0, 1, 2  # sides of the split


@dataclass(frozen=True)
class Block:
    """Some successive pairs of a shard, in physical units.

    Attributes
    ----------
    inputs : ndarray of float32 or uint8, (n, n_in)
        The input columns, joined; bytes stay bytes.
    outputs : ndarray of float32, (n, n_out)
        The labels, joined.
    side : ndarray of int8, (n,)
        `TRAINING` or `VALIDATION`.
    """

    inputs: np.ndarray
    outputs: np.ndarray
    side: np.ndarray


@dataclass(frozen=True)
class Pairs:
    """The pairs of a training; they are read from their shards whenever they are wanted.

    Attributes
    ----------
    spec : TrainingSpec
        Says which columns.
    shards : tuple of str
        Their files, oldest round of aggregation first.
    sides : tuple of ndarray of int8, (rows of the shard,)
        For each shard, the side of each of its rows: `TRAINING`, `VALIDATION` or `UNUSED`.
    softening : ndarray of float32, (n_in,)
        The spec's softening of each input.
    output_softening : ndarray of float32, (n_out,)
        The spec's softening of each label.
    of_bytes : bool
        Whether inputs are bytes, such as optic nerve vectors.
    """

    spec: TrainingSpec
    shards: tuple[str, ...]
    sides: tuple[np.ndarray, ...]
    softening: np.ndarray
    output_softening: np.ndarray
    of_bytes: bool = False

    def count(self, side: int) -> int:
        """Return the number of pairs on a side."""
        return sum(int((sides == side).sum()) for sides in self.sides)

    def blocks(self) -> Iterator[Block]:
        """Read all pairs that are used, in the shards' order.

        Raises
        ------
        UserError
            Naming the shard (and column), when one is truncated, not finite, or of another width.
        """
        names = self.spec.inputs, self.spec.outputs
        widths = len(self.softening), len(self.output_softening)
        for path, sides in zip(self.shards, self.sides, strict=True):
            columns, _ = read_shard(path, dict.fromkeys(sum(names, ())))
            inputs, outputs = (_matrix(path, columns, part) for part in names)
            del columns
            found = inputs.shape[1], outputs.shape[1]
            if found != widths:
                raise UserError(f"{path}: inputs and outputs of width {found}, but {widths} in {self.shards[0]}")
            if len(inputs) != len(sides) or len(outputs) != len(sides):
                raise UserError(f"{path}: {len(inputs)} rows of inputs, {len(outputs)} of outputs")
            for start in range(0, len(sides), BLOCK):
                part = slice(start, start + BLOCK)
                used = np.flatnonzero(sides[part] != UNUSED)
                yield Block(inputs[part][used], outputs[part][used], sides[part][used])


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
    return np.concatenate(parts, axis=1, dtype=np.uint8 if _of_bytes(columns, names) else np.float32)


def _of_bytes(columns: dict[str, np.ndarray], names: Sequence[str]) -> bool:
    return all(columns[name].dtype == np.uint8 for name in names)


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
        True for a tenth of the pairs, exactly so when n is a multiple of ten blocks; of fewer blocks, for one.
    """
    blocks = -(-n // block)
    chosen = generator.integers(FOLDS, size=-(-blocks // FOLDS)) % max(1, min(blocks, FOLDS))
    index = np.arange(n) // block
    return index % FOLDS == chosen[index // FOLDS]


def _subset(sides: np.ndarray, samples: int, generator: np.random.Generator) -> np.ndarray:
    """Return the sides with all but `samples` pairs unused; a tenth of these validate."""
    reserved = min(max(1, round(samples / FOLDS)), int((sides == VALIDATION).sum()))
    kept = np.full(len(sides), UNUSED, dtype=np.int8)
    for side, count in ((VALIDATION, reserved), (TRAINING, samples - reserved)):
        kept[generator.permutation(np.flatnonzero(sides == side))[:count]] = side
    return kept


def find_pairs(spec: TrainingSpec, shards: Sequence[str]) -> Pairs:
    """Look how many pairs the shards hold and split them.

    A shard's split depends on the run's seed and on the shard's place in the list alone. With the
    shards of a new round of aggregation at the end, a pair that validates does so in all rounds.

    Parameters
    ----------
    spec : TrainingSpec
        Columns, softening, seed, `samples`, `validation_block`.
    shards : sequence of path-like
        Files of `anthro.files.write_shard`, oldest round first.

    Returns
    -------
    Pairs
        All pairs, or `spec.samples` of them.

    Raises
    ------
    UserError
        Naming the shard (and column), when one is truncated, or when there are fewer pairs than wanted.
    """
    sides, softenings, of_bytes = [], [], False
    for index, path in enumerate(shards):
        names = spec.inputs[:1] if index else spec.inputs + spec.outputs
        columns, _ = read_shard(path, dict.fromkeys(names))
        if not index:
            softenings = [_softening(spec, columns, part) for part in (spec.inputs, spec.outputs)]
            of_bytes = _of_bytes(columns, spec.inputs)
        rows, generator = len(np.atleast_1d(columns[names[0]])), stream(spec.seed, "learn/split", index)
        sides.append(validation_side(rows, generator, spec.validation_block).astype(np.int8))
    total = sum(map(len, sides))
    if spec.samples is not None:
        if total < spec.samples:
            raise UserError(f"{spec.name}: {spec.samples} samples wanted, the shards hold {total}")
        ends = np.cumsum([len(side) for side in sides])[:-1]
        sides = np.split(_subset(np.concatenate(sides), spec.samples, stream(spec.seed, "learn/samples")), ends)
    pairs = Pairs(spec, tuple(map(str, shards)), tuple(sides), *softenings, of_bytes)
    if of_bytes and pairs.softening.any():
        raise UserError(f"{spec.name}: inputs of bytes are not softened")
    counts = pairs.count(TRAINING), pairs.count(VALIDATION)
    if not all(counts):
        raise UserError(f"{spec.name}: {sum(counts)} pairs are too few to be split in ten")
    return pairs


def _softening(spec: TrainingSpec, columns: dict[str, np.ndarray], names: Sequence[str]) -> np.ndarray:
    """Return the spec's softening of each column of a matrix that joins `names`."""
    widths = [columns[name].shape[1] if columns[name].ndim == 2 else 1 for name in names]
    return np.repeat([spec.softening.get(name, 0.0) for name in names], widths).astype(np.float32)


class Moments:
    """Mean, variance and largest size of columns whose rows come in parts (Chan, Golub & LeVeque 1983).

    Attributes
    ----------
    count : int
        Rows so far.
    mean : ndarray, (width,)
        Their mean.
    largest : ndarray, (width,)
        The largest absolute value.
    """

    def __init__(self):
        self.count, self.mean, self.largest, self._squares = 0, 0.0, 0.0, 0.0

    def add(self, values: np.ndarray) -> None:
        """Take in rows, (n, width)."""
        if not len(values):
            return
        mean = values.mean(axis=0, dtype=float)
        total, gap = self.count + len(values), mean - self.mean
        squares = np.square(values - mean).sum(axis=0)
        self._squares = self._squares + squares + gap**2 * (self.count * len(values) / total)
        self.mean = self.mean + gap * (len(values) / total)
        self.largest = np.maximum(self.largest, np.abs(values).max(axis=0))
        self.count = total

    @property
    def variance(self) -> np.ndarray:
        """Variance of the columns, (width,)."""
        return self._squares / self.count

    @property
    def scale(self) -> np.ndarray:
        """Standard deviation of the columns, 1 for those that do not vary, (width,)."""
        deviation = np.sqrt(self.variance)
        floor = 1e-6 * self.largest  # rounding noise of a constant is no variation
        return np.where(deviation > floor, deviation, 1.0)


class ByteMoments:
    """What bytes mostly are, and how far they are from it.

    Most photoreceptors see the background. Taken as zero, it costs nothing online: `FeedForward` passes over inputs
    that are zero. One scale serves all columns, or receptors that hardly ever see anything would shout.

    Attributes
    ----------
    mean : ndarray, (width,)
        Median of each column in the first rows.
    """

    def __init__(self):
        self.mean = np.zeros(0)
        self._squares = self._count = 0

    def add(self, values: np.ndarray) -> None:
        """Count rows (n, width) in."""
        if not len(values):
            return
        if not len(self.mean):
            self.mean = np.median(values, axis=0).astype(np.float32)
        self._squares += np.square(values - self.mean).sum(dtype=float)
        self._count += values.size

    @property
    def scale(self) -> np.ndarray:
        """Root mean square distance from `mean` over all columns, in each, (width,); 1 if nothing varies."""
        return np.full(len(self.mean), np.sqrt(self._squares / self._count) or 1.0)


def survey(pairs: Pairs) -> tuple[dict[str, np.ndarray], str]:
    """Read all pairs once.

    Returns
    -------
    normalisation : dict of str to ndarray of float32
        Means and scales of the training side, in the form of `FeedForward.normalisation`.
    digest : str
        SHA-256 (hex) of everything that training sees.

    Raises
    ------
    UserError
        See `Pairs.blocks`.
    """
    inputs = ByteMoments() if pairs.of_bytes else Moments()
    outputs, limit, total = Moments(), 0.0, hashlib.sha256()
    for block in pairs.blocks():
        chosen = block.side == TRAINING
        inputs.add(soften(block.inputs, pairs.softening)[chosen])
        outputs.add(soften(block.outputs, pairs.output_softening)[chosen])
        limit = np.maximum(limit, np.abs(block.outputs[chosen]).max(axis=0, initial=0.0))
        for values in (block.inputs, block.outputs, block.side):
            total.update(str(values.shape).encode())
            total.update(np.ascontiguousarray(values))
    for values in (pairs.softening, pairs.output_softening):
        total.update(values)
    values = {
        "input_softening": pairs.softening,
        "input_mean": inputs.mean,
        "input_scale": inputs.scale,
        "output_softening": pairs.output_softening,
        "output_mean": outputs.mean,
        "output_scale": outputs.scale,
        "output_limit": np.where(pairs.output_softening > 0, limit, 0.0),
    }
    return {name: value.astype(np.float32) for name, value in values.items()}, total.hexdigest()


def packed(block: Block, factors: dict[str, np.ndarray]) -> np.ndarray:
    """Return the pairs as rows of bytes (n, width): normalised float32, inputs first; inputs of bytes as they are."""
    if block.inputs.dtype != np.uint8:
        return normalise(block, factors).view(np.uint8)
    return np.concatenate([block.inputs, _standard(block.outputs, factors, "output").view(np.uint8)], axis=1)


def normalise(block: Block, factors: dict[str, np.ndarray]) -> np.ndarray:
    """Return the normalised pairs, inputs first, (n, n_in + n_out) float32."""
    return np.concatenate(
        [_standard(block.inputs, factors, "input"), _standard(block.outputs, factors, "output")], axis=1
    )


def _standard(values: np.ndarray, factors: dict[str, np.ndarray], side: str) -> np.ndarray:
    return (soften(values, factors[f"{side}_softening"]) - factors[f"{side}_mean"]) / factors[f"{side}_scale"]
