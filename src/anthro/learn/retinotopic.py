"""A start for vision DNNs whose first units see patches of the retina, as ganglion cells do, and not noise everywhere.

He's random weights (Nakada 2018, Sec. 5, footnote 1) let every unit of the first layer listen to all 10,800 numbers of
an optic nerve vector, whose order does not say where receptors lie: neighbours in the picture are strangers to the
network, and a few ten thousand pictures do not teach it better. Here each unit starts with a Gaussian receptive field
about a receptor, as wide as the receptors lie there, and one kind of cone to listen to: a picture that moves a little
moves the first layer a little. Deeper layers start at He's weights.
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

CONES = {"red": [1.0, 0.0, 0.0], "green": [0.0, 1.0, 0.0], "blue": [0.0, 0.0, 1.0]}
REACH = 3.0  # widths at which a receptive field ends
SPACING = 4  # receptors to whose distance receptors are said to lie apart
SELDOM = 0.005  # of the median unit's size: units that hardly ever see anything are scaled as if theirs were that
SAMPLE = 4096  # pairs by which units are scaled


def spread_evenly(directions: np.ndarray, count: int, rng: np.random.Generator) -> np.ndarray:
    """Indices (count,) of receptors with unit directions (n, 3) that lie as evenly as receptors do.

    The first is drawn; each further one lies furthest from all before, in units of the receptors' spacing.
    All are taken as often as the others when there are more to choose than receptors.
    """
    spacing = cKDTree(directions).query(directions, SPACING + 1)[0][:, -1]
    chosen = np.empty(min(count, len(directions)), int)
    chosen[0], away = rng.integers(len(directions)), np.full(len(directions), np.inf)
    for k in range(1, len(chosen)):
        last = chosen[k - 1]
        apart = np.linalg.norm(directions - directions[last], axis=1) / (spacing + spacing[last])
        away = np.minimum(away, apart)
        chosen[k] = np.argmax(away)
    return np.resize(chosen, count)


def receptive_fields(directions: np.ndarray, centres: np.ndarray, neighbours: int) -> np.ndarray:
    """Gaussian weights (units, n) of units about some receptors (units,) on all, with unit directions (n, 3).

    A receptive field is as wide as that many neighbours lie apart; its weights are of length one.
    """
    tree = cKDTree(directions)
    fields = np.zeros((len(centres), len(directions)))
    for field, centre in zip(fields, directions[centres], strict=True):
        width = tree.query(centre, neighbours + 1)[0][-1]
        within = tree.query_ball_point(centre, REACH * width)
        field[within] = np.exp(-0.5 * (np.linalg.norm(directions[within] - centre, axis=1) / width) ** 2)
    return fields / np.linalg.norm(fields, axis=1, keepdims=True)


def start_retinotopic(network: Network, rows: Rows, spec: TrainingSpec) -> None:
    """Set the first layer of a network whose weights were drawn as He does; each unit varies by one over the data."""
    eye = spec.receptive_fields
    receptors = layout(eye["retina"], eye["side"], spec.seed).directions
    rng = stream(spec.seed, f"learn/retinotopic/{eye['side']}")
    kinds = [(cone, neighbours) for cone in eye["cones"] for neighbours in eye["neighbours"]]
    weights = []
    for units, (cone, neighbours) in zip(np.array_split(np.arange(network.sizes[1]), len(kinds)), kinds, strict=True):
        fields = receptive_fields(receptors, spread_evenly(receptors, len(units), rng), neighbours)
        weights.append(np.kron(fields, CONES[cone]))
    first = network.layers[0]
    with torch.no_grad():
        first.weight.copy_(torch.from_numpy(np.concatenate(weights)))
        inputs, _ = next(rows.batches(np.arange(min(SAMPLE, rows.training)), SAMPLE))
        size = (inputs.cpu() @ first.weight.T).square().mean(dim=0).sqrt()
        first.weight /= size.clamp(min=float(SELDOM * size.median()) or 1.0)[:, None]
