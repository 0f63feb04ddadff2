"""A start for vision DNNs whose first units see patches of the retina, as ganglion cells do, and not noise everywhere.

He's random weights (Nakada 2018, Sec. 5, footnote 1) let every unit of the first layer listen to all 10,800 numbers of
an optic nerve vector, whose order says nothing about where receptors lie: neighbours in the picture are strangers to
the network, and a few ten thousand pictures do not teach it better. Here each unit starts with a Gaussian receptive
field about a receptor, as wide as the receptors lie there, and with a colour of its own: a picture that moves a little
moves the first layer a little. Deeper layers start at He's weights. Training then moves all weights.
"""

from __future__ import annotations

import numpy as np
import torch
from scipy.spatial import cKDTree

from anthro.eyes.layout import layout
from anthro.learn.networks import Network
from anthro.learn.rows import Rows
from anthro.learn.spec import TrainingSpec
from anthro.streams import stream

# Of red, green and blue: light and dark, red and green, blue and yellow, each on and off.
OPPONENTS = np.array([[1.0, 1.0, 1.0], [1.0, -1.0, 0.0], [-0.5, -0.5, 1.0]])
NEIGHBOURS = (4, 12, 40)  # receptors within a receptive field's width, of a third of the units each
COLOURS = 2 * len(OPPONENTS)  # successive units differ in colour, then in width
REACH = 3.0  # widths at which a receptive field ends
SAMPLE = 4096  # pairs by which units are scaled


def receptive_fields(directions: np.ndarray, count: int, rng: np.random.Generator) -> np.ndarray:
    """Gaussian weights (count, n) of units on receptors with unit directions (n, 3), each unit's of length one.

    Units lie where receptors do, so densest in the fovea; their widths are the distances to some neighbours.
    """
    tree, n = cKDTree(directions), len(directions)
    fields = np.zeros((count, n))
    for unit, centre in enumerate(np.resize(rng.permutation(n), count)):
        near = min(NEIGHBOURS[unit // COLOURS % len(NEIGHBOURS)], n - 1)
        width = tree.query(directions[centre], near + 1)[0][-1]
        within = tree.query_ball_point(directions[centre], REACH * width)
        away = np.linalg.norm(directions[within] - directions[centre], axis=1)
        fields[unit, within] = np.exp(-0.5 * (away / width) ** 2)
    return fields / np.linalg.norm(fields, axis=1, keepdims=True)


def start_retinotopic(network: Network, rows: Rows, spec: TrainingSpec) -> None:
    """Set the first layer of a network whose weights were drawn as He does; each unit varies by one over the data."""
    rng = stream(spec.seed, f"learn/retinotopic/{spec.eye['side']}")
    receptors = layout(spec.eye["retina"], spec.eye["side"], spec.seed)
    units = network.sizes[1]
    fields = receptive_fields(receptors.directions, units, rng)
    cones = OPPONENTS if rows.n_in == 3 * len(receptors.directions) else np.ones((1, 1))
    colours = np.resize(np.concatenate([cones, -cones]), (units, cones.shape[1]))
    colours /= np.linalg.norm(colours, axis=1, keepdims=True)
    weights = (fields[:, :, None] * colours[:, None, :]).reshape(units, -1)
    first = network.layers[0]
    with torch.no_grad():
        first.weight.copy_(torch.from_numpy(weights))
        inputs, _ = next(rows.batches(np.arange(min(SAMPLE, rows.training)), SAMPLE))
        size = (inputs.cpu() @ first.weight.T).square().mean(dim=0).sqrt()
        first.weight /= torch.where(size > 0, size, 1.0)[:, None]
