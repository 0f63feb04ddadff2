"""The networks online: feed-forward prediction in NumPy, and the one format of networks on disk."""

import os
from collections.abc import Mapping, Sequence
from itertools import pairwise

import numpy as np
from numba import njit
from scipy.special import expit

from anthro.errors import UserError
from anthro.files import read_shard, write_shard

ACTIVATIONS = ("relu", "sigmoid")
NORMALISATION = (
    "input_softening",
    "input_mean",
    "input_scale",
    "output_softening",
    "output_mean",
    "output_scale",
    "output_limit",
)


def soften(values: np.ndarray, softening: np.ndarray) -> np.ndarray:
    """Compress the tails of columns: ``asinh(x / s)`` where s > 0, x itself where s is 0.

    Parameters
    ----------
    values : ndarray, (..., n)
        Raw inputs or outputs.
    softening : ndarray, (n,)
        Scale s of each column, in the column's unit; 0 leaves a column linear.

    Returns
    -------
    ndarray, (..., n)
        A new array of the same type.
    """
    values = np.array(values)
    soft = np.flatnonzero(softening)
    values[..., soft] = np.arcsinh(values[..., soft] / softening[soft])
    return values


def reach_of(softening: np.ndarray, limit: np.ndarray) -> np.ndarray:
    """Largest softened value of each output, ``asinh(limit / s)``: no bound where the limit is 0."""
    bounded = (softening > 0.0) & (limit > 0.0)
    reach = np.where(softening > 0.0, np.inf, 0.0)
    reach[bounded] = np.arcsinh(limit[bounded] / softening[bounded])
    return reach


def harden(values: np.ndarray, softening: np.ndarray, reach: np.ndarray) -> np.ndarray:
    """Undo :func:`soften`: ``s sinh(x)`` where s > 0, x itself where s is 0. A new array.

    Softened columns are kept within ``reach`` first: the inverse grows so fast that a small error
    far out would become a large one.
    """
    bent = softening * np.sinh(np.maximum(np.minimum(values, reach), -reach))
    return np.where(softening > 0.0, bent, values)


@njit(cache=True, nogil=True, fastmath={"contract"})
def _layer(columns, bias, inputs, rectified, outputs):
    """``bias + inputs @ columns`` (n_out,) for one sample, negative values set to 0 where ``rectified``.

    A network online waits for its weights to come from memory: those of inputs that are 0, which half of the rectified
    units are, are not read.
    """
    active, count = np.empty(len(inputs), np.int64), 0
    for j in range(len(inputs)):
        if inputs[j] != 0.0:
            active[count] = j
            count += 1
    for i in range(len(outputs)):
        outputs[i] = bias[i]
    whole = count - count % 4
    for k in range(0, whole, 4):
        j0, j1, j2, j3 = active[k], active[k + 1], active[k + 2], active[k + 3]
        x0, x1, x2, x3 = inputs[j0], inputs[j1], inputs[j2], inputs[j3]
        for i in range(len(outputs)):
            outputs[i] += x0 * columns[j0, i] + x1 * columns[j1, i] + x2 * columns[j2, i] + x3 * columns[j3, i]
    for k in range(whole, count):
        x0, j0 = inputs[active[k]], active[k]
        for i in range(len(outputs)):
            outputs[i] += x0 * columns[j0, i]
    if rectified:
        for i in range(len(outputs)):
            if outputs[i] < 0.0:
                outputs[i] = 0.0


class FeedForward:
    """A trained fully-connected network, of rectified linear units (Nakada 2018, Sec. 5) or sigmoids, ready to predict.

    Parameters
    ----------
    matrices : sequence of ndarray, (out, in)
        Weights of each layer, first to last; they act on normalised inputs and give normalised outputs.
    biases : sequence of ndarray, (out,)
        Biases of each layer.
    normalisation : mapping of str to ndarray, optional
        ``input_softening``, ``input_mean``, ``input_scale`` (n_in,), ``output_softening``,
        ``output_mean``, ``output_scale``, ``output_limit`` (n_out,): inputs become
        ``(soften(x) - mean) / scale``, outputs ``harden(y * scale + mean)``. What is not given
        changes nothing.
    attrs : mapping, optional
        What is known about the network: name, spec, epoch, validation_mse; ``activation`` of its hidden
        units, one of `ACTIVATIONS`, "relu" if it is not told.

    Raises
    ------
    ValueError
        When the shapes do not fit together.
    """

    def __init__(
        self,
        matrices: Sequence[np.ndarray],
        biases: Sequence[np.ndarray],
        normalisation: Mapping[str, np.ndarray] | None = None,
        attrs: Mapping | None = None,
    ):
        self.matrices = [np.ascontiguousarray(matrix, dtype=np.float32) for matrix in matrices]
        self.biases = [np.ascontiguousarray(bias, dtype=np.float32) for bias in biases]
        self.sizes = (self.matrices[0].shape[1], *(len(matrix) for matrix in self.matrices))
        neutral = {name: np.full(self._width(name), name.endswith("scale")) for name in NORMALISATION}
        given = neutral | dict(normalisation or {})
        self.normalisation = {name: np.asarray(given[name], dtype=np.float32) for name in NORMALISATION}
        self.attrs = dict(attrs or {})
        self.activation = self.attrs.get("activation", "relu")
        self._check()
        self._fold()

    def _width(self, name: str) -> int:
        return self.sizes[0] if name.startswith("input") else self.sizes[-1]

    def _check(self) -> None:
        if self.activation not in ACTIVATIONS:
            raise ValueError(f"activation {self.activation!r} is not one of {', '.join(ACTIVATIONS)}")
        for layer, (n_in, n_out) in enumerate(pairwise(self.sizes)):
            if self.matrices[layer].shape != (n_out, n_in) or self.biases[layer].shape != (n_out,):
                raise ValueError(f"layer {layer} does not fit a layer of {n_in} in, {n_out} out")
        for name, values in self.normalisation.items():
            if values.shape != (self._width(name),):
                raise ValueError(f"{name} has shape {values.shape}, not ({self._width(name)},)")

    def _fold(self) -> None:
        """Put the scales into the first and the last layer, and make room for the layers' outputs."""
        scale = {name: values.astype(float) for name, values in self.normalisation.items()}
        folded = list(self.matrices)
        folded[0] = (folded[0] / scale["input_scale"]).astype(np.float32)
        folded[-1] = (folded[-1] * scale["output_scale"][:, None]).astype(np.float32)
        last_bias = self.biases[-1] * scale["output_scale"] + scale["output_mean"]
        self._soft = np.flatnonzero(self.normalisation["input_softening"])
        self._soft_scale = self.normalisation["input_softening"][self._soft]
        self._mean = self.normalisation["input_mean"]
        biases = [*self.biases[:-1], last_bias.astype(np.float32)]
        self._layers = [
            (np.ascontiguousarray(matrix.T), bias, np.empty_like(bias))
            for matrix, bias in zip(folded, biases, strict=True)
        ]
        self._softening = self.normalisation["output_softening"]
        self._reach = reach_of(self._softening, self.normalisation["output_limit"]).astype(np.float32)

    @property
    def n_in(self) -> int:
        """Number of inputs."""
        return self.sizes[0]

    @property
    def n_out(self) -> int:
        """Number of outputs."""
        return self.sizes[-1]

    @property
    def units(self) -> int:
        """Number of units, input and output layer included."""
        return sum(self.sizes)

    @property
    def weights(self) -> int:
        """Number of weights, biases not counted."""
        return sum(matrix.size for matrix in self.matrices)

    def predict(self, x: np.ndarray) -> np.ndarray:
        """Predict outputs, in physical units, from inputs in physical units.

        Parameters
        ----------
        x : ndarray, (n_in,) or (n, n_in)
            One input vector or n of them.

        Returns
        -------
        ndarray of float32, (n_out,) or (n, n_out)
            A new array.

        Raises
        ------
        ValueError
            When x has another width.
        """
        z = np.array(x, dtype=np.float32)
        if z.shape[-1] != self.sizes[0]:
            raise ValueError(f"{z.shape[-1]} inputs given to a network of {self.sizes[0]}")
        if self._soft.size:
            z[..., self._soft] = np.arcsinh(z[..., self._soft] / self._soft_scale)
        z -= self._mean
        last, rectified = len(self._layers) - 1, self.activation == "relu"
        if z.ndim == 1:
            for index, (columns, bias, out) in enumerate(self._layers):
                _layer(columns, bias, z, rectified and index < last, out)
                if not rectified and index < last:
                    expit(out, out=out)
                z = out
            return self._harden(z.copy())
        for index, (columns, bias, _) in enumerate(self._layers):
            z = z @ columns
            z += bias
            if index < last:
                np.maximum(z, 0.0, out=z) if rectified else expit(z, out=z)
        return self._harden(z)

    def _harden(self, y: np.ndarray) -> np.ndarray:
        return harden(y, self._softening, self._reach) if self._reach.any() else y

    def save(self, path: str | os.PathLike) -> None:
        """Write the network as one HDF5 file, atomically; the same network gives the same bytes.

        Raises
        ------
        UserError
            Naming the file, when it cannot be written.
        """
        layers = enumerate(zip(self.matrices, self.biases, strict=True))
        columns = {f"{kind}{i}": v for i, pair in layers for kind, v in zip(("weight", "bias"), pair, strict=True)}
        write_shard(path, columns | self.normalisation, self.attrs)

    @classmethod
    def load(cls, path: str | os.PathLike, inputs: int | None = None, outputs: int | None = None) -> "FeedForward":
        """Read a network.

        Parameters
        ----------
        path : path-like
            The file, ``weights.h5``.
        inputs, outputs : int, optional
            The widths that the caller needs.

        Raises
        ------
        UserError
            Naming the file, when it is missing, truncated, no network, holds weights that are not
            finite, or has other widths than those needed.
        """
        columns, attrs = read_shard(path)
        count = sum(name.startswith("weight") for name in columns)
        attrs.pop("complete")
        try:
            matrices = [columns[f"weight{i}"] for i in range(count)]
            biases = [columns[f"bias{i}"] for i in range(count)]
            network = cls(matrices, biases, {name: columns[name] for name in NORMALISATION}, attrs)
        except (KeyError, IndexError, ValueError) as error:
            raise UserError(f"{path}: not a network ({error})") from None
        if (inputs or network.n_in, outputs or network.n_out) != (network.n_in, network.n_out):
            raise UserError(
                f"{path}: a network of {network.n_in} inputs and {network.n_out} outputs, "
                f"but {inputs or network.n_in} and {outputs or network.n_out} are needed"
            )
        if not all(np.isfinite(values).all() for values in columns.values()):
            raise UserError(f"{path}: weights that are not finite")
        return network
