"""Conjugate gradients over all pairs at once, for small networks (Grzeszczuk 1998, Sec. 2.3 and 3.5)."""

import numpy as np
import torch
from scipy.optimize import minimize

from anthro.learn.networks import Network
from anthro.learn.rows import Rows


def search(network: Network, rows: Rows, searches: int) -> float:
    """Move a network's weights along conjugate directions, in place.

    Sums are in double precision, as a line search compares losses that hardly differ.

    Parameters
    ----------
    network : Network
        In double precision.
    rows : Rows
        Its training side is read once and held in memory.
    searches : int
        Line searches at most; the first goes down the gradient.

    Returns
    -------
    float
        The mean loss at the end.
    """
    inputs, outputs = next(rows.batches(np.arange(rows.training), rows.training))
    inputs, outputs = inputs.double(), outputs.double()
    parameters = list(network.parameters())

    def loss(flat: np.ndarray) -> tuple[float, np.ndarray]:
        torch.nn.utils.vector_to_parameters(torch.from_numpy(flat).to(rows.device), parameters)
        value = torch.nn.functional.mse_loss(network(inputs), outputs)
        slopes = torch.autograd.grad(value, parameters)
        return value.item(), torch.nn.utils.parameters_to_vector(slopes).cpu().numpy()

    start = torch.nn.utils.parameters_to_vector(parameters).detach().cpu().numpy()
    found = minimize(loss, start, jac=True, method="CG", options={"maxiter": searches, "gtol": 0.0})
    torch.nn.utils.vector_to_parameters(torch.from_numpy(found.x).to(rows.device), parameters)
    return float(found.fun)
