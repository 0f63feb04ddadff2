"""What a network's answer hangs on: its derivatives by what each photoreceptor tells."""

from __future__ import annotations

import numpy as np

from anthro.errors import UserError
from anthro.motor.network import FeedForward, reach_of, soften

BATCH = 32  # vectors whose derivatives are in memory at once
FULL = 255.0  # of a stored byte


def gradients(network: FeedForward, x: np.ndarray) -> np.ndarray:
    """Derivatives of a network's outputs by its inputs, by back propagation.

    Parameters
    ----------
    network : FeedForward
    x : ndarray (n, n_in)
        Inputs in physical units, as for `FeedForward.predict`.

    Returns
    -------
    ndarray (n, n_out, n_in) of float32
        In an output's unit over an input's; 0 for outputs beyond their limit, which are held there.
    """
    scales, x = network.normalisation, np.asarray(x, np.float32)
    z = (soften(x, scales["input_softening"]) - scales["input_mean"]) / scales["input_scale"]
    active = []
    layers = list(zip(network.matrices, network.biases, strict=True))
    for matrix, bias in layers[:-1]:
        z = np.maximum(z @ matrix.T + bias, 0.0)
        active.append(z > 0.0)
    last, bias = layers[-1]
    y = (z @ last.T + bias) * scales["output_scale"] + scales["output_mean"]
    back = (_hardening(y, scales) * scales["output_scale"])[:, :, None] * last
    for (matrix, _), on in zip(reversed(layers[:-1]), reversed(active), strict=True):
        back = (back * on[:, None]) @ matrix
    return back * (_softening(x, scales["input_softening"]) / scales["input_scale"])[:, None]


def saliency(network: FeedForward, stored: np.ndarray, receptors: int) -> np.ndarray:
    """How far a network's answer moves with each receptor, on average over some optic nerve vectors.

    The size over all outputs of the derivatives by a colour of a receptor, from dark to bright, is averaged over the
    vectors; a receptor's colours are summed.

    Parameters
    ----------
    network : FeedForward
        From bytes to a direction, rad, or to an offset, m.
    stored : ndarray (n, n_in) of uint8
        Optic nerve vectors.
    receptors : int

    Returns
    -------
    ndarray (receptors,)
        rad or m.

    Raises
    ------
    UserError
        There are no vectors, or they are no multiple of the receptors.
    """
    if not len(stored) or stored.shape[1] != network.n_in or network.n_in % receptors:
        raise UserError(f"{len(stored)} vectors of {stored.shape[1:]} numbers: no answers of {receptors} receptors")
    total = np.zeros(network.n_in)
    for start in range(0, len(stored), BATCH):
        moved = FULL * gradients(network, stored[start : start + BATCH])
        total += np.linalg.norm(moved, axis=1).sum(axis=0)
    return total.reshape(receptors, -1).sum(axis=1) / len(stored)


def _softening(x: np.ndarray, softening: np.ndarray) -> np.ndarray:
    """Derivative of `soften`."""
    bent = softening > 0.0
    return np.where(bent, 1.0 / np.hypot(x, np.where(bent, softening, 1.0)), 1.0)


def _hardening(y: np.ndarray, scales: dict[str, np.ndarray]) -> np.ndarray:
    """Derivative of `anthro.motor.network.harden`."""
    softening = scales["output_softening"]
    reach = reach_of(softening, scales["output_limit"])
    within = np.abs(y) <= reach
    bent = np.where(within, softening * np.cosh(np.where(within, y, 0.0)), 0.0)
    return np.where(softening > 0.0, bent, 1.0)
