"""A start for deep networks that already knows the linear part of the map: least squares, carried through all layers.

He's random weights (Nakada 2018, Sec. 5, footnote 1) pass hundreds of input columns through a stack of layers hardly
wider than they are many. Of the core's 446 inputs such a stack must first learn to hand on its own drive. Here the
least-squares map starts in units that a bias lifts above the bend of their rectifier, so that every layer hands them
on as they are; the other units start at He's weights, with no say in the output. Training then moves all weights.
"""

from __future__ import annotations

import numpy as np
import torch

from anthro.learn.networks import Network
from anthro.learn.rows import Rows

BLOCK = 8192  # pairs at once
SMALLEST = 1e-9  # variance of a direction, as a share of the largest
RIDGES = (1e-4, 1e-3, 1e-2, 3e-2, 0.1, 0.3, 1.0)  # of normalised inputs' variance
LIFT = 5.0  # standard deviations by which the units that hand on are lifted


def least_squares(rows: Rows, rank: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Linear map of a given rank at most with the least squared error, ridged as the validation side likes it best.

    Reduced-rank regression: the ridge solution, projected on the outputs' directions in which it varies most.

    Returns
    -------
    into : (rank, n_in), of unit variance over the training side.
    out : (n_out, rank).
    offset : (n_out,).
    """
    mean, square, cross = _moments(rows)
    weights = min(
        (np.linalg.solve(square + np.diag(np.full(rows.n_in, ridge)), cross) for ridge in RIDGES),
        key=_error(rows, mean),
    )
    variance, directions = np.linalg.eigh(weights.T @ square @ weights)
    variance, directions = variance[::-1][:rank], directions[:, ::-1][:, :rank]
    scale = np.sqrt(np.maximum(variance, SMALLEST * variance[0]))
    into, out = (weights @ directions / scale).T, directions * scale
    return into, out, mean[1] - out @ (into @ mean[0])


def _moments(rows: Rows) -> tuple[tuple[np.ndarray, np.ndarray], np.ndarray, np.ndarray]:
    """Means of inputs and outputs, covariance of inputs, covariance of inputs with outputs; training side."""
    total = np.zeros((rows.n_in + 1, rows.n_in + rows.n_out + 1))
    for x, y in rows.batches(np.arange(rows.training), BLOCK):
        x, y = x.cpu().double(), y.cpu().double()
        first = torch.cat([torch.ones(len(x), 1, dtype=torch.float64), x], dim=1)
        total += (first.T @ torch.cat([first, y], dim=1)).numpy()
    total /= rows.training
    width = rows.n_in + 1
    mean = total[0, 1:width], total[0, width:]
    return mean, total[1:, 1:width] - np.outer(mean[0], mean[0]), total[1:, width:] - np.outer(*mean)


def _error(rows: Rows, mean):
    """Function of weights (n_in, n_out): their squared error on the validation side."""

    def of(weights: np.ndarray) -> float:
        matrix, offset = torch.from_numpy(weights), torch.from_numpy(mean[1] - mean[0] @ weights)
        return sum(
            float((x.cpu().double() @ matrix + offset - y.cpu().double()).square().sum()) for x, y in rows.held_out()
        )

    return of


def start_linear(network: Network, rows: Rows) -> None:
    """Set a network's weights, drawn as He does, so that it begins as the least-squares map of the training side."""
    rank = min(rows.n_in, rows.n_out, *network.sizes[1:-1])
    into, out, offset = (torch.from_numpy(value).float() for value in least_squares(rows, rank))
    handed, layers = slice(0, len(into)), network.layers
    with torch.no_grad():
        layers[0].weight[handed] = into
        layers[0].bias[handed] = LIFT
        for layer in layers[1:-1]:
            layer.weight[handed] = 0.0
            layer.weight[handed, handed] = torch.eye(len(into))
        layers[-1].weight.zero_()
        layers[-1].weight[:, handed] = out
        layers[-1].bias.copy_(offset - LIFT * out.sum(dim=1))
