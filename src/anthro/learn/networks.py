"""The network that learns: fully connected, rectified linear units or sigmoids, random initial weights."""

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
import torch
from torch import nn

from anthro.motor.network import FeedForward


class Network(nn.Module):
    """Layers between normalised inputs and outputs (Nakada 2018, Sec. 5, footnote 1; Grzeszczuk 1998, Sec. 2.1).

    Parameters
    ----------
    sizes : sequence of int
        Units of each layer, input and output layer included, such as (32, 300, ..., 300, 29).
    generator : numpy.random.Generator, optional
        Draws the initial weights: normal, mean 0, standard deviation sqrt(2 / fan_in); biases are 0.
        Without it the weights are 0.
    activation : {"relu", "sigmoid"}
        Of the hidden units.
    uniform : bool
        Draw weights and biases uniformly from -1 to 1 over sqrt(fan_in) instead.
    """

    def __init__(
        self,
        sizes: Sequence[int],
        generator: np.random.Generator | None = None,
        activation: str = "relu",
        uniform: bool = False,
    ):
        super().__init__()
        self.sizes, self.activation = tuple(sizes), activation
        self.layers = nn.ModuleList(nn.utils.skip_init(nn.Linear, n_in, n_out) for n_in, n_out in pairwise(self.sizes))
        for layer in self.layers:
            nn.init.zeros_(layer.bias)
            nn.init.zeros_(layer.weight)
            if generator is not None and uniform:
                for values in (layer.weight, layer.bias):
                    drawn = generator.uniform(-1.0, 1.0, tuple(values.shape)) / np.sqrt(layer.in_features)
                    values.data.copy_(torch.from_numpy(drawn))
            elif generator is not None:
                deviation = np.sqrt(2 / layer.in_features)
                values = generator.normal(0.0, deviation, (layer.out_features, layer.in_features))
                layer.weight.data.copy_(torch.from_numpy(values))

    @property
    def units(self) -> int:
        """Number of units, input and output layer included.

        Counted so, the core's two nets (446-6x600-443, 886-6x600-443) have the 9,418 units of Zhou 2021, Sec. 3.
        """
        return sum(self.sizes)

    @property
    def weights(self) -> int:
        """Number of weights, biases not counted (the core's two nets: the 4,930,800 of Zhou 2021, Sec. 3)."""
        return sum(layer.weight.numel() for layer in self.layers)

    def forward(self, x: torch.Tensor, after: int = 0) -> torch.Tensor:
        """Map normalised inputs (n, n_in), or activations behind the first `after` layers, to outputs (n, n_out)."""
        bend = torch.relu if self.activation == "relu" else torch.sigmoid
        for layer in self.layers[after:-1]:
            x = bend(layer(x))
        return self.layers[-1](x)

    def export(self, normalisation: dict[str, np.ndarray] | None = None, attrs: dict | None = None) -> FeedForward:
        """Return the network for use online, with the given normalisation and attributes."""
        matrices = [layer.weight.detach().cpu().numpy().copy() for layer in self.layers]
        biases = [layer.bias.detach().cpu().numpy().copy() for layer in self.layers]
        told = {} if self.activation == "relu" else {"activation": self.activation}
        return FeedForward(matrices, biases, normalisation, {**(attrs or {}), **told})
