"""Normalised pairs in a file that is mapped into memory, and the batches that are drawn from it.

The file holds one row a pair, inputs first, the training side before the validation side; bytes stay bytes, and are
normalised in their batch. While memory is free the system keeps all of it there, and a batch costs what it costs from
an array; when memory is scarce the system drops what it likes and reads it again. The file has no name: it is gone
with its process.
"""

import mmap
import os
import tempfile
from collections.abc import Iterable, Iterator
from pathlib import Path

import numpy as np
import torch
from torch import nn

from anthro.errors import UserError
from anthro.learn.data import TRAINING, VALIDATION, Pairs, packed

CHUNK = 4096  # validation pairs at once
RESIDENT = 2**31  # bytes of the file that count as the process's own at most
FAULT = 2**21  # bytes that the system may map around a row that is read (its largest page)
GPU_SHARE = 0.5  # of the GPU's free memory that the rows may fill


class Table:
    """Rows of inputs and outputs in a nameless file, the training side before the validation side.

    Parameters
    ----------
    folder : path-like
        Where the file lies; created.
    device : str or torch.device
        Where batches are wanted. A GPU holds all rows, if they fill at most half of its free memory.
    counts : pair of int
        Pairs of the training and of the validation side.
    widths : pair of int
        Bytes of a row's inputs and of its outputs.
    blocks : iterable of pairs of ndarray
        Rows (n, width) uint8 and their sides (n,).

    Attributes
    ----------
    folder : Path
    training, validation : int
        Pairs of each side.

    Raises
    ------
    UserError
        When there is no room in `folder`.
    """

    def __init__(
        self,
        folder: str | os.PathLike,
        device: str | torch.device,
        counts: tuple[int, int],
        widths: tuple[int, int],
        blocks: Iterable[tuple[np.ndarray, np.ndarray]],
    ):
        self.device = torch.device(device)
        self.training, self.validation = counts
        self._first, self._width = widths[0], sum(widths)
        self.folder = Path(folder)
        self.folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=self.folder) as file:
            try:
                self._write(file, blocks)
            except OSError as error:
                raise UserError(f"{self.folder}: no room for {self.bytes / 2**30:.3g} GiB of rows ({error})") from None
            self._map = mmap.mmap(file.fileno(), self.bytes)
        self._resident = 0
        self._table = torch.frombuffer(self._map, dtype=torch.uint8).view(-1, self._width)
        if self.device.type == "cuda" and self.bytes < GPU_SHARE * torch.cuda.mem_get_info(self.device)[0]:
            table = torch.empty(self._table.shape, dtype=torch.uint8, device=self.device)
            for start in range(0, len(table), CHUNK):
                table[start : start + CHUNK] = self._table[start : start + CHUNK]
                self._release(CHUNK)
            self._table = table

    @property
    def bytes(self) -> int:
        """Size of the file."""
        return self._width * (self.training + self.validation)

    def _write(self, file, blocks: Iterable[tuple[np.ndarray, np.ndarray]]) -> None:
        """Write blocks of rows (n, width) uint8 and their sides (n,)."""
        place = {TRAINING: 0, VALIDATION: self.training * self._width}
        for rows, sides in blocks:
            for side in place:
                chosen = rows[sides == side]
                file.seek(place[side])
                file.write(chosen)
                place[side] += chosen.nbytes
        file.flush()

    def batches(self, order: np.ndarray, size: int) -> Iterator[tuple[torch.Tensor, torch.Tensor]]:
        """Draw the training side in an order.

        Parameters
        ----------
        order : ndarray of int, (n,)
            Pairs, from 0 to `training` - 1.
        size : int
            Pairs a batch; the last may have fewer.

        Yields
        ------
        inputs, outputs : Tensor, (size, n_in) and (size, n_out)
            On the device, normalised.
        """
        for index in torch.from_numpy(order).to(self._table.device).split(size):
            yield self._sides(self._table.index_select(0, index))
            self._release(len(index))

    def held_out(self) -> Iterator[tuple[torch.Tensor, torch.Tensor]]:
        """Yield the validation side's inputs and outputs, normalised, some thousand at a time."""
        for part in self._table[self.training :].split(CHUNK):
            yield self._sides(part)
            self._release(len(part))

    def _sides(self, rows: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
        if rows.device.type != self.device.type:
            rows = rows.pin_memory().to(self.device, non_blocking=True)
        inputs, outputs = rows[:, : self._first].contiguous(), rows[:, self._first :].contiguous()
        return self._inputs(inputs), outputs.view(torch.float32)

    def _inputs(self, stored: torch.Tensor) -> torch.Tensor:
        """Inputs (n, n_in) float32, normalised, as they are stored (n, bytes)."""
        raise NotImplementedError

    def _release(self, count: int) -> None:
        """Give the file's pages back to the system before more of them than `RESIDENT` are the process's own."""
        self._resident += count * max(FAULT, self._width)
        if self.bytes > RESIDENT and self._resident > RESIDENT:
            self._map.madvise(mmap.MADV_DONTNEED)
            self._resident = 0


class Rows(Table):
    """The rows of a training.

    Parameters
    ----------
    pairs : Pairs
        The data set.
    factors : dict of str to ndarray
        The normalisation, in the form of `FeedForward.normalisation`.
    folder : path-like
        Where the file lies (4 bytes a number, 1 an input of bytes); created.
    device : str or torch.device
        Where batches are wanted.

    Attributes
    ----------
    n_in, n_out : int
        Columns of inputs and of outputs.

    Raises
    ------
    UserError
        When there is no room in `folder`, and on shards that are no pairs (see `Pairs.blocks`).
    """

    def __init__(
        self,
        pairs: Pairs,
        factors: dict[str, np.ndarray],
        folder: str | os.PathLike,
        device: str | torch.device = "cpu",
    ):
        self.factors, self._of_bytes = factors, pairs.of_bytes
        self.n_in, self.n_out = len(factors["input_mean"]), len(factors["output_mean"])
        counts = pairs.count(TRAINING), pairs.count(VALIDATION)
        widths = self.n_in * (1 if pairs.of_bytes else 4), 4 * self.n_out
        super().__init__(folder, device, counts, widths, ((packed(b, factors), b.side) for b in pairs.blocks()))
        if pairs.of_bytes:
            centre, scale = (torch.from_numpy(factors[f"input_{name}"]) for name in ("mean", "scale"))
            self._centre, self._scale = centre.to(self.device), scale.to(self.device)

    def _inputs(self, stored: torch.Tensor) -> torch.Tensor:
        if self._of_bytes:
            return (stored.float() - self._centre) / self._scale
        return stored.view(torch.float32)


class Activations(Table):
    """What a first layer that stays as it is makes of the rows: computed once, in half precision.

    Parameters
    ----------
    rows : Rows
    layer : nn.Linear
        Before its rectifier.
    """

    def __init__(self, rows: Rows, layer: nn.Linear):
        counts, widths = (rows.training, rows.validation), (2 * layer.out_features, 4 * rows.n_out)
        super().__init__(rows.folder, rows.device, counts, widths, _passed(rows, layer))

    def _inputs(self, stored: torch.Tensor) -> torch.Tensor:
        return stored.view(torch.float16).float()


@torch.no_grad()
def _passed(rows: Rows, layer: nn.Linear) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Blocks of rows behind a layer, and their sides, in the rows' order."""
    for side, part in ((TRAINING, rows.batches(np.arange(rows.training), CHUNK)), (VALIDATION, rows.held_out())):
        for inputs, outputs in part:
            units = torch.relu(layer(inputs)).half().cpu().numpy()
            packed_rows = [values.view(np.uint8) for values in (units, outputs.cpu().numpy())]
            yield np.concatenate(packed_rows, axis=1), np.full(len(inputs), side)
